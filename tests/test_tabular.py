"""Results in Python: one screen in a notebook, escaped; data frames and labelled arrays with units; figures and reports."""

from __future__ import annotations

import base64
import copy
import dataclasses
import json
import pickle
import re
import shutil
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

import armrs
from armrs import cli, view_registry
from armrs.cosim.error_estimate import run_checked
from armrs.cosim.system import load_system
from armrs.demo import true_model
from armrs.tabular import Framed, Tabular, Tidy
from armrs.workflows import history
from browser import opened
from results import kinds, returned, series_faults
from sessions import again as recorded_again
from test_docs import DOCS, ROOT, blocks


@pytest.fixture(scope="module")
def run() -> armrs.Simulated:
    return armrs.simulate(true_model(), armrs.Movement(np.radians([[-60, 60], [-48, 60]]), speed=0.5, acceleration=2.0))


@pytest.fixture(scope="module")
def identified(slow_arm: Path) -> armrs.Identified:
    return armrs.identify(slow_arm, with_effects="coulomb")


@pytest.fixture(autouse=True)
def pyplot() -> Iterator[None]:
    matplotlib.use("Agg")
    from matplotlib import pyplot

    yield
    pyplot.close("all")


def test_a_run_is_a_data_frame_with_units(run: armrs.Simulated) -> None:
    frame = run.to_dataframe()
    assert list(frame.columns[:3]) == ["t", "q1", "q2"]
    assert frame.attrs["units"]["force_on_arm_y"] == "N"
    assert np.array_equal(frame["q2"], run.q[:, 1])
    pd.testing.assert_frame_equal(pd.DataFrame(run), frame)


def test_a_run_is_a_labelled_data_set_with_units(run: armrs.Simulated) -> None:
    data = run.to_xarray()
    assert data["torque.gravity"].dims == ("time", "joint") and data["torque.gravity"].attrs["units"] == "N m"
    assert np.array_equal(data["q"].sel(joint="elbow"), run.q[:, 1])
    assert np.array_equal(data["force_on_arm"].sel(axis="z"), run.force_on_arm[:, 1])
    assert data.time.attrs["units"] == "s" and data["energy.kinetic"].dims == ("time",)
    # Whatever is recorded and has numbers is in it, but for what belongs to single effects and inner states.
    left = {name for name, values in run.columns.items() if isinstance(values, np.ndarray)} - set(data.variables)
    assert left == {"resisting", "memory", "energy_error"}


def test_without_xarray_the_refusal_names_the_extra(run: armrs.Simulated, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, method in (("xarray", run.to_xarray), ("pandas", run.to_dataframe)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(armrs.ArmrsError, match=rf'{name}: pip install "armrs\[notebook\]"'):
            method()


def test_estimates_are_a_tidy_frame_and_json(identified: armrs.Identified) -> None:
    frame = identified.to_dataframe()
    assert set(frame["group"]) >= {"parameter", "combination"}
    first = identified.combinations[0]
    row = frame[(frame["group"] == "combination") & (frame["name"] == first.name)].iloc[0]
    assert (row["value"], row["low"], row["high"]) == (first.value, *first.interval)
    assert json.loads(identified.to_json())["combinations"][0]["name"] == first.name


def test_a_notebook_shows_one_screen_and_no_markup_of_files(run: armrs.Simulated, identified: armrs.Identified) -> None:
    shown = run._repr_html_()
    assert shown.count("<tr>") == 31 and "more rows: to_dataframe()" in shown
    named = identified.dataset.replace(name="<script>alert(1)</script>")
    html = dataclasses.replace(identified, dataset=named)._repr_html_()
    assert "<script>" not in html and "&lt;script&gt;" in html
    assert len(html) < 20_000


def test_passive_curves_are_tidy(slow_arm: Path) -> None:
    frame = armrs.passive_moments(slow_arm).to_dataframe()
    assert {"configuration", "joint", "angle", "half_width"} <= set(frame.columns)
    assert frame.attrs["units"]["angle"] == "rad"


def results(identified: armrs.Identified, run: armrs.Simulated, folder: Path) -> dict[str, object]:
    """A result of every kind but those that take long, which have tests of their own."""
    movement = armrs.Movement(np.radians([[-60, 60], [-20, 90], [-60, 60]]), speed=1.0, acceleration=4.0)
    for day in (1, 2):
        followed = history.add(folder / "s1.sqlite", recorded_again(identified, day), f"2026-01-0{day}")
    return {
        "parameters": identified,
        "simulated": run,
        "passive-slow": armrs.passive_moments(identified.dataset),
        "predictions": armrs.forecast(true_model(), [movement], repeats=2),
        "history": followed,
    }


@pytest.mark.long
def test_every_result_draws_and_writes_the_figures_of_its_report(
    identified: armrs.Identified, run: armrs.Simulated, tmp_path: Path
) -> None:
    from matplotlib import pyplot

    for name, result in results(identified, run, tmp_path).items():
        before = dict(matplotlib.rcParams)
        axes = result.plot()
        assert dict(matplotlib.rcParams) == before
        assert len(axes) > 0 and all(isinstance(ax, Axes) for ax in axes)
        assert pyplot.gcf() is axes[0].figure and pyplot.get_fignums() == [1]
        with pytest.raises(armrs.BadInput, match=rf"name: found unknown figure 'nothing', allowed .*{name}"):
            result.plot("nothing")
        pyplot.close("all")
        page = result.report(tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert pyplot.get_fignums() == []
        pictures = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
        assert pictures and all(base64.b64decode(text).startswith(b"\x89PNG") for text in pictures)
        assert "<h1>" in page and not re.search(r"\bnan\b|None|Markup", page)


def test_whatever_is_public_can_be_kept_and_copied(identified: armrs.Identified, run: armrs.Simulated, tmp_path: Path) -> None:
    model = true_model()
    one_of_each = [
        *results(identified, run, tmp_path).values(), identified.dataset, identified.dataset.trials[0], model,
        armrs.Arm.from_model(model), armrs.check_dataset(identified.dataset.folder), identified.dataset.tolerance,
    ]  # fmt: skip
    for one in one_of_each:
        for again in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
            assert type(again) is type(one) and repr(again).split(" at 0x")[0] == repr(one).split(" at 0x")[0]
    trial = pickle.loads(pickle.dumps(identified.dataset.trials[0]))
    assert np.array_equal(trial.q, identified.dataset.trials[0].q) and not trial.q.flags.writeable
    with pytest.raises(TypeError, match="does not support item assignment"):
        trial.emg["biceps"] = trial.t
    arm = armrs.Arm([0.3, 0.2], [2.0, 1.0], [0.1, 0.1], [0.01, 0.02], gravity=1.6, com_normals=[0.01, 0.0], base=(0.1, 0.2))
    angles = np.array([0.3, 0.4])
    for again in (pickle.loads(pickle.dumps(arm)), copy.deepcopy(arm)):
        assert np.array_equal(again.gravity(angles), arm.gravity(angles))
        assert np.array_equal(again.forward_kinematics(angles), arm.forward_kinematics(angles))


def test_a_figure_is_chosen_by_its_name(identified: armrs.Identified) -> None:
    axes = identified.plot("torques-slow")
    assert [ax.get_title(loc="left") for ax in axes[:2]] == ["shoulder", "elbow"]
    assert np.array_equal(axes[0].lines[1].get_ydata()[:5], next(e for e in identified.explained if e.trial.role == "test").fitted[:5, 0])


def test_a_report_is_a_page_of_html(run: armrs.Simulated, tmp_path: Path) -> None:
    with pytest.raises(armrs.BadInput, match=r"allowed the name of a file that ends with \.html"):
        run.report(tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []


def test_a_history_is_a_tidy_frame(identified: armrs.Identified, tmp_path: Path) -> None:
    history.add(tmp_path / "s1.sqlite", identified, "2026-01-01")
    followed = history.add(tmp_path / "s1.sqlite", recorded_again(identified, 1), "2026-02-01")
    frame = followed.to_dataframe()
    assert set(frame["date"]) == {"2026-01-01", "2026-02-01"} and len(frame) == 2 * len(followed.courses)
    assert "nothing changed in the last session" in repr(followed)


@pytest.mark.long
def test_tables_of_a_report_fit_on_a4(identified: armrs.Identified, tmp_path: Path) -> None:
    passive = armrs.passive_moments(identified.dataset)
    for result in (identified, passive):
        page = result.report(tmp_path / "report.html")
        # 210 mm less margins of 10 mm, in CSS pixels.
        with opened(page, width=718) as seen:
            seen.page.emulate_media(media="print")
            widths = seen.page.evaluate("[...document.querySelectorAll('table')].map(t => [t.offsetWidth, t.parentNode.clientWidth])")
        assert widths and all(table <= room for table, room in widths), widths


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.__name__)
def test_every_kind_of_result_has_its_own_words_and_a_page(kind: type) -> None:
    assert kind.__repr__ is not object.__repr__ and kind.tidy is not Tabular.tidy and callable(kind.to_dict)
    assert view_registry._load(view_registry.DRAWN_BY[kind.__name__]).report


@pytest.mark.parametrize("name", returned())
def test_what_public_functions_return_is_a_table_in_notebooks(name: str) -> None:
    assert issubclass(returned()[name], Framed)


def test_a_data_set_is_a_table_of_trials_and_labelled_samples(slow_arm: Path) -> None:
    dataset = armrs.load_dataset(slow_arm)
    frame = dataset.to_dataframe()
    assert list(frame["role"]) == ["fit", "fit", "fit", "test"] and frame.attrs["units"] == {"rate": "Hz", "duration": "s"}
    assert "trials/slow_4.csv" in dataset._repr_html_() and len(dataset.plot()) > 4
    short = dataset.replace(trials=(*dataset.trials[:3], cut(dataset.trials[3], 100)))
    assert series_faults(short) == []
    samples = short.to_xarray()
    assert np.array_equal(samples["q"].sel(trial="trials/slow_1.csv", joint="elbow"), dataset.trials[0].q[:, 1])
    assert np.isnan(samples["force_on_arm"].sel(trial="trials/slow_4.csv")[100:]).all() and samples["force_on_arm"].attrs["units"] == "N"
    with pytest.raises(armrs.BadInput, match="trials: found none"):
        dataset.replace(trials=()).plot()


def cut(trial: armrs.Trial, n: int) -> armrs.Trial:
    """Return the first samples of a trial."""
    return armrs.Trial(trial.file, trial.configuration, trial.repeat, trial.role, trial.t[:n], trial.q[:n], trial.force_on_arm[:n])


def test_fits_and_first_models_are_tables(tmp_path: Path) -> None:
    made = armrs.initialise(tmp_path / "subject", body_mass=78.0, height=1.80, sex="male")
    assert list(made.to_dataframe()["name"]) == ["upper arm", "forearm", "hand"] and "forearm" in made._repr_html_()
    fit = armrs.SimulationFit({"coulomb1 torque": 0.2}, {"coulomb1 torque": 0.01}, ("coulomb1 torque",), 1.0, 3, True, ())
    assert fit.to_dataframe().to_dict("records") == [{"name": "coulomb1 torque", "value": 0.2, "std": 0.01, "at_bound": True}]


def test_what_a_result_warns_of_is_a_warning_once(slow_arm: Path, tmp_path: Path) -> None:
    """Warnings stood in `warnings` of the result alone, where nobody looked."""
    folder = tmp_path / "set"
    shutil.copytree(slow_arm, folder)
    text = (folder / "dataset.toml").read_text(encoding="utf-8").replace('role = "test"', 'role = "fit"')
    subject = '[subject]\nbody_mass = 78.0\nheight = 1.80\nsex = "male"\nlengths_m = [0.322, 0.264]\n\n[[trial]]'
    text = re.sub(r"^model = .*\n", "", re.sub(r"(?ms)^\[subject\].*?(?=^\[)", "", text), flags=re.M).replace("[[trial]]", subject, 1)
    (folder / "dataset.toml").write_text(text, encoding="utf-8")
    with pytest.warns(armrs.ArmrsWarning, match="no model is named") as first:
        dataset = armrs.load_dataset(folder)
    assert [str(w.message) for w in first] == list(dataset.warnings) and {w.filename for w in first} == {__file__}
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        found = armrs.identify(dataset)
    with warnings.catch_warnings(record=True) as read:
        warnings.simplefilter("always")
        armrs.identify(folder)
        assert cli.main(["identify", str(folder), "--json", str(tmp_path / "i.json")]) in (0, 1)
    assert [str(w.message) for w in given] == list(found.warnings)
    assert [str(w.message) for w in read] == [*dataset.warnings, *found.warnings]


def test_the_tables_of_a_check_an_import_a_recording_and_a_coupled_run(slow_arm: Path, tmp_path: Path) -> None:
    files = sorted((slow_arm / "trials").glob("*.csv"))
    imported = armrs.import_recordings(files, tmp_path / "set", model=slow_arm / "model.toml")
    checked = armrs.check_dataset(imported.folder)
    experiment = next(content for _, name, content in blocks(DOCS / "files.md") if name == "EXPERIMENT.toml")
    (tmp_path / "EXPERIMENT.toml").write_text(experiment, encoding="utf-8")
    recorded = armrs.record(tmp_path / "EXPERIMENT.toml", tmp_path / "recorded")
    coupled = run_checked(load_system(ROOT / "examples" / "cosim" / "wall.toml"))
    assert list(imported.to_dataframe()["symbol"])[:3] == ["t", "q1", "q2"]
    assert list(checked.to_dataframe().columns) == ["level", "text", "next_step"]
    assert recorded.to_dataframe()["tracking_error"].max() < 0.1
    series = coupled.to_xarray()
    assert series.sizes["time"] == len(coupled.t) and series["arm.q[1]"].attrs["units"] == "rad"


def test_minus_zero_has_no_sign() -> None:
    """Forces of a wall that is not touched were shown as -0."""

    class Forces(Framed):
        def tidy(self) -> Tidy:
            return Tidy({"F": [-0.0, -0.5]}, {})

    assert re.findall(r"<td>(.*?)</td>", Forces()._repr_html_()) == ["0", "-0.5"]
