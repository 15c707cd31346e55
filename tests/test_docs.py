"""What the documents show is run as it stands, and what they name exists."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^```(\w+)(?: ([^\n]+))?\n(.*?)^```", flags=re.M | re.S)


def blocks(page: Path) -> list[tuple[str, str, str]]:
    """Return language, name and content of the blocks of a page."""
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def test_three_joints_find_their_own_balance_and_two_follow() -> None:
    """As the tutorial says: only the hand is held."""
    segments = tuple(armrs.Segment(n, 0.3 - 0.08 * k, 1.5 - 0.4 * k, 0.12, 0.01) for k, n in enumerate(("upper arm", "forearm", "hand")))
    joints = tuple(armrs.Joint(s.name, viscosity=0.2, stiffness=1.0 if s.name == "hand" else 0.0) for s in segments)
    aimed = np.radians([[-60, 60, 0], [-50, 60, 0]])
    off = [
        np.abs(armrs.simulate(armrs.Model(segments[:n], joints[:n]), armrs.Movement(aimed[:, :n])).q[0] - aimed[0, :n]).max()
        for n in (2, 3)
    ]
    assert off[0] < np.radians(1.0)  # the contact gives way by a millimetre or two
    assert off[1] > np.radians(3.0)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set from the examples of files.md; its trials have the columns shown there."""
    folder = tmp_path_factory.mktemp("session")
    (folder / "trials").mkdir()
    header = ""
    for language, name, content in blocks(DOCS / "files.md"):
        if language == "csv":
            header = content.splitlines()[0]
            (folder / "shown.csv").write_text(content, encoding="utf-8")
        elif name.endswith(".toml") and " " not in name:
            (folder / name).write_text(content, encoding="utf-8")
    run = armrs.simulate(folder / "model.toml", armrs.load_movement(folder / "swing.toml", 2))
    table = {"t_s": run.t, "emg_biceps": np.random.default_rng(1).standard_normal(len(run.t))}
    table |= {f"q{j + 1}_deg": np.degrees(run.q[:, j]) for j in range(2)}
    table |= {f"F{axis}_N": -run.force_on_arm[:, k] for k, axis in enumerate("yz")}  # on the robot
    table |= {f"qr{j + 1}_rad": run.columns["robot_q"][:, j] for j in range(2)}
    rows = zip(*(table[name] for name in header.split(",")), strict=True)
    lines = [header, *(",".join(repr(float(v)) for v in row) for row in rows)]
    for k in (1, 2):
        (folder / "trials" / f"slow_{k}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def test_the_model_of_files_md_loads(session: Path) -> None:
    model = armrs.load_model(session / "model.toml")
    assert [s.com_normal for s in model.segments] == [0.0, 0.004]
    assert [j.coulomb for j in model.joints] == [0.0, 0.16]
    assert [e.kind for e in model.effects] == ["stribeck", "added_mass"]
    appended = next(content for _, name, content in blocks(DOCS / "files.md") if name == "appended to model.toml")
    longer = session / "longer.toml"
    longer.write_text((session / "model.toml").read_text(encoding="utf-8") + appended, encoding="utf-8")
    assert armrs.load_model(longer).effects[-1].channel == "Fy"


def test_the_movement_of_files_md_loads(session: Path) -> None:
    movement = armrs.load_movement(session / "swing.toml", 2)
    assert (movement.waypoints.shape, movement.speed, movement.acceleration) == ((5, 2), 0.1, 0.5)
    assert (movement.pause, movement.shape) == (0.2, "smooth")


def test_the_session_of_files_md_loads_and_is_what_was_simulated(session: Path) -> None:
    data = armrs.load_dataset(session)
    assert (data.name, data.force_on, data.sample_rate, data.synthetic, data.warnings) == ("S1, slow", "robot", 50.0, False, ())
    assert (data.subject.body_mass, data.tolerance.force_bias_N, data.tolerance.force_gain) == (77.0, 0.4, 0.01)
    assert [(t.configuration, t.repeat, t.role) for t in data.trials] == [("slow", 1, "fit"), ("slow", 2, "test")]
    run = armrs.simulate(data.model, armrs.load_movement(session / "swing.toml", 2))
    for name in ("q", "force_on_arm"):
        assert np.allclose(getattr(data.trials[0], name), getattr(run, name), atol=1e-12)
    assert armrs.identify(data).status == "solved"
    assert armrs.simulate(data.model, data.trials[0]).q.shape == data.trials[0].q.shape


def test_the_rows_of_files_md_are_read_as_it_says(session: Path) -> None:
    from armrs.io.samples import read_samples

    shown = read_samples(session / "shown.csv")
    elbow = shown.values[shown.names.index("q2_deg")]
    assert [bool(np.isnan(v)) for v in elbow] == [False, False, True]


def test_a_horizontal_arm_that_is_carried_has_the_force_up() -> None:
    """The check of `force_on` in files.md: the last segment horizontal, the arm relaxed."""
    from armrs.demo import true_model

    model = true_model().replace(joints=(armrs.Joint("shoulder"), armrs.Joint("elbow")))
    for shoulder in (-80.0, -45.0, 40.0):
        rest = np.radians([[shoulder, -shoulder], [shoulder + 0.01, -shoulder]])
        assert (armrs.simulate(model, armrs.Movement(rest)).force_on_arm[:, 1] > 1.0).all()


def test_every_default_of_files_md_is_that_of_the_code() -> None:
    text = (DOCS / "files.md").read_text(encoding="utf-8")
    for field, value in armrs.Tolerance().to_dict().items():
        assert re.search(rf"^\| `{field}` \|[^|]*\| {value:g} \|", text, flags=re.M), field
    model = armrs.Model((armrs.Segment("a", 0.3, 1.0, 0.1, 0.01),), (armrs.Joint("a"),))
    for field in ("gravity", "segment_uncertainty"):
        default = getattr(model, field)
        assert re.search(rf"^\| `{field}` \|[^|]*\| {default:g} \|", text, flags=re.M), field
    movement = armrs.Movement([[0.0], [1.0]])
    assert re.search(rf"`speed_rad_s`[^|]*\|[^|]*\| {movement.speed:g} rad/s \|", text)
    assert re.search(rf"`acceleration_rad_s2`[^|]*\|[^|]*\| {movement.acceleration:g} rad/s² \|", text)


def test_files_md_names_every_key_of_an_identification(session: Path) -> None:
    from armrs.workflows.result_data import identified_data

    text = (DOCS / "files.md").read_text(encoding="utf-8")
    data = identified_data(armrs.identify(session))
    for key in (*data, *data["parameters"][0], *data["data"], *data["made_by"]):
        assert f"`{key}`" in text, key


@pytest.mark.long
def test_the_python_of_the_readme_prints_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Blocks that name a folder run where the demonstration has been; there a comment behind `print` is what it prints."""
    from armrs.demo import measure, true_model
    from armrs.io.dataset import write_dataset

    monkeypatch.chdir(tmp_path)
    write_dataset(measure(true_model()), "armrs-demo/data")
    checked = 0
    for language, name, content in blocks(ROOT / "README.md"):
        if language != "python":
            continue
        exec(compile(content, "README.md", "exec"), {})
        printed = capsys.readouterr().out
        if name:
            assert (name, printed.splitlines()) == ("armrs-demo/data", re.findall(r"^print\(.*\)  # (.*)$", content, flags=re.M))
            checked += 1
        for figure in re.findall(r"  # (force on the arm up to [\d.]+ N)", content):
            assert figure in printed
            checked += 1
    assert checked == 2


def test_every_effect_and_command_that_documents_name_exists() -> None:
    from typer.main import get_command

    known = set(get_command(cli.app).commands)
    for page in DOCS.glob("*.md"):
        named = set(re.findall(r"`armrs ([a-z]+)", page.read_text(encoding="utf-8")))
        assert named <= known, page


def test_every_link_leads_somewhere() -> None:
    for page in (*(ROOT / f"{name}.md" for name in ("README", "CHANGELOG", "CONTRIBUTING", "SECURITY")), *DOCS.glob("*.md")):
        for target in re.findall(r"\]\((?!https:)([^)]+)\)", page.read_text(encoding="utf-8")):
            file, _, place = target.partition("#")
            linked = page.parent / file if file else page
            assert linked.exists(), f"{page.name}: {target}"
            if linked.suffix == ".png":
                continue
            heads = re.findall(r"^#+ (.*)$", linked.read_text(encoding="utf-8"), flags=re.M)
            assert not place or place in {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in heads}, f"{page.name}: {target}"


def test_the_map_of_the_architecture_is_complete() -> None:
    """Every file it names is there, and every source file is named."""
    text = (DOCS / "architecture.md").read_text(encoding="utf-8").partition("## What is where")[2].partition("## Equations")[0]
    named: set[Path] = set()
    crate = ROOT
    for line in text.splitlines():
        if head := re.match(r"### `(crates/[a-z-]+)`", line):
            crate = ROOT / head[1]
        elif line.startswith("### "):
            crate = ROOT
        for item in re.findall(r"`([^`]+)`", line.split("|")[1] if line.startswith("|") else ""):
            before, braces, after = re.fullmatch(r"([^{]*)(?:\{([^}]*)\})?(.*)", item).groups()  # type: ignore[union-attr]
            named |= {crate / f"{before}{part}{after}" for part in (braces or "").split(",")}
    assert [str(p) for p in named if not p.exists()] == []
    inside = [p for p in named if p.is_dir()]
    sources = itertools.chain(*(ROOT.glob(pattern) for pattern in ("crates/arm-*/src/**/*.rs", "python/armrs/**/*.py")))
    entries = ("lib.rs", "__init__.py", "__main__.py")
    left = [p for p in sources if p not in named and p.name not in entries and not any(d in p.parents for d in inside)]
    assert [str(p) for p in left] == []


def test_the_map_of_the_readme_names_every_crate() -> None:
    """It lacked two of them."""
    named = set(re.findall(r"`crates/([a-z-]+)`", (ROOT / "README.md").read_text(encoding="utf-8")))
    assert named == {path.parent.name for path in ROOT.glob("crates/arm-*/Cargo.toml")}


def test_every_test_and_function_of_the_table_of_equations_exists() -> None:
    text = (ROOT / "python" / "armrs" / "thesis" / "equations.md").read_text(encoding="utf-8")
    suites: dict[str, list[str]] = {}
    for path in (*ROOT.glob("crates/*/tests/**/*.rs"), *ROOT.glob("tests/*.py")):
        suites.setdefault(path.name, []).append(path.read_text(encoding="utf-8"))
    tests = re.findall(r"`(\w+\.(?:rs|py))::(\w+)`", text)
    assert len(tests) > 15
    for file, name in tests:
        assert any(re.search(rf"^(?:fn|def) {name}\b", source, flags=re.M) for source in suites[file]), f"{file}::{name}"
    sources = [p.read_text(encoding="utf-8") for p in (*ROOT.glob("crates/*/src/**/*.rs"), *ROOT.glob("python/armrs/**/*.py"))]
    rows = [line.split("|") for line in text.splitlines() if re.match(r"\| 3\.", line)]
    for name in itertools.chain(*(re.findall(r"`(?:\w+::)?(\w+)`", row[2]) for row in rows)):
        declared = re.compile(rf"\b(?:fn|def|struct|class) {name}\b|\b{name}: |\"{name}\"")
        assert any(declared.search(source) for source in sources), name


def test_the_thesis_is_cited() -> None:
    """Author, title and year stand wherever a reader meets "the thesis" first."""
    from armrs.thesis.not_recomputed import THESIS

    for name in ("README.md", "docs/architecture.md", "CITATION.cff"):
        text = " ".join((ROOT / name).read_text(encoding="utf-8").split())
        assert "Kodek" in text and "Timotej" in text and "2004" in text, name
        assert "Estimation of Upper Extremity Biomechanical Parameters Using a Robot Manipulator" in text, name
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    cited = r"Timotej Kodek, \*Estimation of Upper Extremity Biomechanical Parameters[^*]+\*.*University\s+of Ljubljana.*2004"
    assert re.search(cited, readme, flags=re.S)
    assert all(part in THESIS for part in ("Timotej Kodek", "Using a Robot Manipulator", "2004"))


def test_the_readme_copies_no_lists_of_a_model() -> None:
    """Its library snippets built an arm from four lists beside the model."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "Arm.from_model(model)" in text and "armrs.Arm(" not in text
