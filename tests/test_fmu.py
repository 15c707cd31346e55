"""FMUs as files: packing, what a check finds, and what other tools say of them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli
from armrs.cosim import Slave
from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.errors import BadInput, SlaveError
from armrs.fmu import standard_names
from armrs.fmu.archive import unpack
from armrs.fmu.check import check_fmu
from armrs.fmu.description import read_description
from armrs.fmu.imported_slave import ImportedSlave
from armrs.fmu.shared_library import platform_folder
from armrs.model import Model, Segment

ROOT = Path(__file__).parents[1]
START = np.radians([-60.0, 50.0])
VARIANTS = [(fmi, port) for fmi in (2, 3) for port in ("force", "motion")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("fmu")
    for fmi, port in VARIANTS:
        export_fmu(true_model(), place / f"{port}{fmi}.fmu", fmi=fmi, port=port, start=START)
    return place


@pytest.mark.parametrize(("fmi", "port"), VARIANTS)
def test_nothing_wrong_is_found_in_our_own(folder: Path, fmi: int, port: str) -> None:
    assert check_fmu(folder / f"{port}{fmi}.fmu") == []


@pytest.mark.parametrize(("fmi", "port"), VARIANTS)
def test_other_tools_accept_and_simulate_it(folder: Path, fmi: int, port: str) -> None:
    """FMPy's validation, and its simulation with the bits of the slave in Python."""
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    path = folder / f"{port}{fmi}.fmu"
    assert list(validate_fmu(str(path))) == []
    result = fmpy.simulate_fmu(str(path), stop_time=1.0, step_size=0.01, output_interval=0.01, output=["q[1]", "q[2]", "energy"])
    slave = Slave(true_model(), port=port, start=START)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    for k in range(100):
        slave.do_step(k * 0.01, 0.01)
    last = result[-1].tolist()
    assert last[0] == pytest.approx(1.0)
    assert [v.hex() for v in last[1:]] == [v.hex() for v in slave.get(["q[1]", "q[2]", "energy"]).tolist()]


@pytest.mark.parametrize("port", ["force", "motion"])
def test_descriptions_and_terminals_fit_the_schemas_of_the_standard(folder: Path, port: str) -> None:
    fmpy = pytest.importorskip("fmpy")
    etree = pytest.importorskip("lxml.etree")
    schemas = Path(fmpy.__file__).parent / "schema" / "fmi3"
    with zipfile.ZipFile(folder / f"{port}3.fmu") as files:
        for name, schema in (
            ("modelDescription.xml", "fmi3ModelDescription"),
            ("terminalsAndIcons/terminalsAndIcons.xml", "fmi3TerminalsAndIcons"),
        ):
            etree.XMLSchema(etree.parse(str(schemas / f"{schema}.xsd"))).assertValid(etree.fromstring(files.read(name)))


def test_the_same_arm_has_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    again = export_fmu(true_model(), tmp_path / "force3.fmu", start=START)
    assert again.read_bytes() == (folder / "force3.fmu").read_bytes()
    heavier = true_model().replace(gravity=9.82)
    other = export_fmu(heavier, tmp_path / "other.fmu", start=START, name="force3")
    tokens = [read_description(p).token for p in (again, other)]
    table, arm = [[t[1:-1].split("-")[k] for t in tokens] for k in (1, 2)]
    assert table[0] != table[1]
    assert arm[0] != arm[1]


def test_every_function_of_the_standards_is_there_and_no_python() -> None:
    from armrs.fmu.bundled_libraries import library

    content = library().read_bytes()
    for version, count in ((2, 44), (3, 75)):
        assert len(set(standard_names.FUNCTIONS[version])) == count
        for name in standard_names.FUNCTIONS[version]:
            assert f"fmi{version}{name}\0".encode() in content
    assert b"Py_" not in content
    assert b"_Py" not in content


def test_the_library_needs_no_newer_glibc_than_the_documentation_says() -> None:
    from armrs.fmu.bundled_libraries import library

    found = re.findall(rb"\0GLIBC_(\d+)\.(\d+)", library().read_bytes())
    if not found:
        pytest.skip("no library for glibc")
    said = re.search(r"needs glibc (\d+)\.(\d+) as `make build` makes it", (ROOT / "docs" / "cosim.md").read_text(encoding="utf-8"))
    assert said is not None
    assert max((int(a), int(b)) for a, b in found) <= tuple(map(int, said.groups()))


@pytest.mark.parametrize("fmi", [2, 3])
def test_licences_travel_whole(fmi: int, folder: Path) -> None:
    """Those of armrs, and of what is compiled into the library, which the MIT licence and Apache's want."""
    with zipfile.ZipFile(folder / f"force{fmi}.fmu") as files:
        text = files.read("documentation/licenses/license.txt").decode()
    for licence in ("LICENSE-MIT", "LICENSE-APACHE"):
        assert (ROOT / licence).read_text(encoding="utf-8").strip() in text
    for package in ("libm", "nalgebra", "serde_json"):
        assert re.search(rf"^{package} \d", text, flags=re.M), package


@pytest.mark.long
def test_an_arm_of_each_length(tmp_path: Path) -> None:
    segment = Segment("part", 0.3, 1.5, 0.15, 0.01)
    for n, port in enumerate(("force", "motion") * 3, start=1):
        arm = Model(tuple(segment for _ in range(n)), tuple(armrs.Joint(f"joint {k}", viscosity=0.2) for k in range(n)))
        path = export_fmu(arm, tmp_path / "arm.fmu", port=port, start=np.full(n, -0.3))
        assert check_fmu(path) == []


# ---- the 23 defects, of which public validators miss twelve
Files = dict[str, bytes]


def xml(old: str, new: str, count: int = 1) -> Callable[[Files], Files]:
    """Edit the description; the pattern must be there."""

    def change(files: Files) -> Files:
        text = files["modelDescription.xml"].decode()
        edited, n = re.subn(old, new, text, count=count)
        assert n == count, old
        return files | {"modelDescription.xml": edited.encode()}

    return change


def terminals(old: str, new: str) -> Callable[[Files], Files]:
    def change(files: Files) -> Files:
        name = "terminalsAndIcons/terminalsAndIcons.xml"
        text = files[name].decode()
        assert old in text
        return files | {name: text.replace(old, new, 1).encode()}

    return change


def without(prefix: str) -> Callable[[Files], Files]:
    return lambda files: {name: data for name, data in files.items() if not name.startswith(prefix)}


def renamed_symbol(files: Files) -> Files:
    place, suffix = platform_folder(3)
    name = f"binaries/{place}/ArmRs{suffix}"
    assert b"fmi3SetTime\0" in files[name]
    return files | {name: files[name].replace(b"fmi3SetTime\0", b"fmi3SetTima\0")}


def backslashed(files: Files) -> Files:
    return {name.replace("documentation/index", "documentation\\index"): data for name, data in files.items()}


OUTPUT = '<Float64 name="handle.r[1]"'
MUTANTS: dict[str, tuple[Callable[[Files], Files], str]] = {
    "no binary": (without("binaries/"), "no library for any platform"),
    "wrong modelIdentifier": (xml('modelIdentifier="ArmRs"', 'modelIdentifier="Other"'), "expected Other"),
    "negative internal step": (xml('fixedInternalStepSize="', 'fixedInternalStepSize="-'), "fixedInternalStepSize: -0.00025"),
    "start outside min and max": (xml(r'(name="body\[1\].m".*?min=)"[^"]*"', r'\1"100.0"'), "variable body[1].m: start is 1.4"),
    "typing error in a capability": (xml("canGetAndSetFMUState", "canGetAndSetFMUStat"), "nearest known: canGetAndSetFMUState"),
    "wrong exponents of a unit": (xml('<BaseUnit kg="1" m="1" s="-2"/>', '<BaseUnit kg="1" m="2" s="-2"/>'), "unit N: kg^1 m^2 s^-2"),
    "broken terminals": (terminals("</Terminals>", ""), "terminalsAndIcons.xml: cannot be read"),
    "terminal of an unknown variable": (
        terminals('variableName="handle.F[1]"', 'variableName="handle.G[1]"'),
        "'handle.G[1]' is not a variable",
    ),
    "LZMA": (lambda files: files, "compressed with lzma"),
    "missing function": (renamed_symbol, "fmi3SetTime"),
    "wrong token": (xml('instantiationToken="{armrs-0?', 'instantiationToken="{armrs-f'), "refused with the instantiationToken"),
    "start that differs from the library": (xml(r'(name="body\[1\].m".*?start=")1', r"\g<1>2"), "in the description and"),
    "InitialUnknown missing": (xml(r"    <InitialUnknown [^>]*/>\n", ""), "not listed as InitialUnknown"),
    "undefined unit": (xml(r'(name="handle.F\[1\]".*?unit=")N"', r'\1lbf"'), "the unit 'lbf' is not defined"),
    "illegal structured name": (xml('name="gravity"', 'name="gravity acceleration"'), "not a structured name"),
    "no independent variable": (xml(r"    <Float64 name=\"time\".*?/>\n", ""), "0 independent variables"),
    "backslash in a path": (backslashed, "a backslash in a name"),
    "Output missing": (xml(r"    <Output [^>]*/>\n", ""), "is not listed"),
    "duplicate name": (xml('name="tau\\[2\\]"', 'name="tau[1]"'), "2 variables have this name"),
    "duplicate value reference": (xml('valueReference="2"', 'valueReference="1"'), "share the value reference 1"),
    "input without start": (xml(r'(name="handle.F\[1\]".*?) start="0.0"', r"\1"), "no start value, which causality input"),
    "illegal causality and variability": (
        xml(r'(name="gravity".*?)variability="fixed"', r'\1variability="continuous"'),
        "causality parameter with variability continuous",
    ),
    "start where the value is calculated": (
        xml(OUTPUT.replace("[", r"\[").replace("]", r"\]"), OUTPUT + ' start="0.1"'),
        "allowed is none",
    ),
}


@pytest.mark.parametrize("defect", MUTANTS)
def test_every_defect_is_found_and_named(defect: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change, message = MUTANTS[defect]
    with zipfile.ZipFile(folder / "force3.fmu") as good:
        files = change({name: good.read(name) for name in good.namelist()})
    path = tmp_path / "mutant.fmu"
    method = zipfile.ZIP_LZMA if defect == "LZMA" else zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(path, "w", method) as packed:
        for name, data in files.items():
            packed.writestr(zipfile.ZipInfo(name), data, compress_type=method)
    assert cli.main(["fmu", "check", str(path)]) == 1
    assert message in capsys.readouterr().out


def test_there_are_23_of_them() -> None:
    assert len(MUTANTS) == 23


# ---- personal values
def repacked(source: Path, target: Path, name: str, change: Callable[[bytes], bytes] | None) -> Path:
    with zipfile.ZipFile(source) as good, zipfile.ZipFile(target, "w") as packed:
        for inside in good.namelist():
            data = good.read(inside)
            if inside != name:
                packed.writestr(inside, data)
            elif change is not None:
                packed.writestr(inside, change(data))
    return target


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (None, "arm.json: No such file"),
        (lambda data: data.replace(b'"gravity": 9.81', b'"gravity": 9.8'), "one of them was edited"),
        (lambda data: data.replace(b'"gravity"', b'"grafity"'), "unknown field `grafity`"),
        (lambda data: data[: len(data) // 2], "EOF"),
        (lambda data: data.replace(b"9.81", b"1e999"), "out of range"),
        (lambda data: b"", "EOF"),
        (lambda data: b"\xff\xfe" + data, "UTF-8"),
    ],
)
def test_an_edited_arm_is_refused(fmi: int, change: Callable[[bytes], bytes] | None, message: str, folder: Path, tmp_path: Path) -> None:
    path = repacked(folder / f"force{fmi}.fmu", tmp_path / "edited.fmu", "resources/arm.json", change)
    with pytest.raises(SlaveError, match=re.escape(message)):
        ImportedSlave(path)


def test_the_arm_travels_with_every_bit(folder: Path, tmp_path: Path) -> None:
    unpack(folder / "motion3.fmu", tmp_path)
    arm = json.loads((tmp_path / "resources" / "arm.json").read_text(encoding="utf-8"))
    assert [s["mass"] for s in arm["segments"]] == [s.mass for s in true_model().segments]
    assert arm["start"]["q"] == START.tolist()


# ---- the command line
def test_export_info_and_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    true_model().write("arm.toml")
    assert cli.main(["fmu", "export", "arm.toml", "--start-deg", "-60,50", "--port", "motion", "--rest", "--json", "e.json"]) == 0
    assert capsys.readouterr().out == "arm.fmu\n"
    token = json.loads(Path("e.json").read_text(encoding="utf-8"))["token"]
    assert cli.main(["fmu", "info", "arm.fmu", "--json", "-"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["token"], data["fmi_version"], data["capabilities"]["canGetAndSetFMUState"]) == (token, "3.0", "true")
    assert cli.main(["fmu", "info", "arm.fmu"]) == 0
    assert "contact.F[1]" in capsys.readouterr().out
    repacked(Path("arm.fmu"), Path("one.fmu"), "modelDescription.xml", lambda data: data.replace(b'FMUState="true"', b'FMUState="1"'))
    assert cli.main(["fmu", "info", "one.fmu"]) == 0
    assert "canGetAndSetFMUState                    true\n" in capsys.readouterr().out
    assert cli.main(["fmu", "check", "arm.fmu"]) == 0
    assert capsys.readouterr().out == "arm.fmu: no errors found\n"
    # At rest: nothing moves.
    slave = ImportedSlave("arm.fmu")
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    before = slave.get(["q[1]", "q[2]"])
    slave.do_step(0.0, 1.0)
    np.testing.assert_allclose(slave.get(["q[1]", "q[2]"]), before, atol=1e-9)
    slave.free()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["export", "nothing.toml"], "no such file"),
        (["export", "arm.toml", "--start-deg", "-60"], "found 1 values, allowed 2, one a joint"),
        (["export", "arm.toml", "--start-deg", "a,b"], "allowed numbers separated by commas"),
        (["export", "arm.toml", "--start-deg", "nan,0"], "allowed finite numbers"),
        (["export", "arm.toml", "--fmi", "1"], "--fmi"),
        (["export", "arm.toml", "-o", "arm.toml"], "an existing file with suffix '.toml'"),
        (["export", "arm.toml", "--dt", "0"], "--dt: found 0.0, allowed a finite number > 0 s"),
        (["info", "arm.toml"], "File is not a zip file"),
        (["check", "nothing.fmu"], "no such file"),
        (["info", "empty.fmu"], "no modelDescription.xml"),
    ],
)
def test_refuses(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    true_model().write("arm.toml")
    with zipfile.ZipFile("empty.fmu", "w") as packed:
        packed.writestr("readme.txt", "nothing")
    before = sorted(p.name for p in tmp_path.iterdir())
    assert cli.main(["fmu", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert message in err
    assert sorted(p.name for p in tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", ["../evil.txt", "/tmp/armrs-evil.txt", "..\\evil.txt"])
def test_an_archive_cannot_write_outside(name: str, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "evil.fmu"
    with zipfile.ZipFile(folder / "force3.fmu") as good, zipfile.ZipFile(path, "w") as packed:
        for inside in good.namelist():
            packed.writestr(inside, good.read(inside))
        packed.writestr(zipfile.ZipInfo(name), "evil")
    with pytest.raises(BadInput, match="names inside the archive"):
        ImportedSlave(path)


def test_a_library_that_crashes_is_a_finding(folder: Path, tmp_path: Path) -> None:
    source = tmp_path / "crash.c"
    body = "\n".join(f"int fmi3{name}(void) {{ return 0; }}" for name in standard_names.FUNCTIONS[3] if name != "InstantiateCoSimulation")
    source.write_text(f"#include <stdlib.h>\n{body}\nvoid *fmi3InstantiateCoSimulation(void) {{ abort(); }}\n", encoding="utf-8")
    library = tmp_path / "crash.so"
    try:
        subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(source)], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no C compiler")
    place, suffix = platform_folder(3)
    path = repacked(folder / "force3.fmu", tmp_path / "crash.fmu", f"binaries/{place}/ArmRs{suffix}", lambda _: library.read_bytes())
    found = check_fmu(path)
    assert any(" while creating an instance" in f.text for f in found)
    assert sys.platform != "linux" or any("is killed by signal 6 (SIGABRT)" in f.text for f in found)


def test_effects_that_do_not_travel_are_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    arm = true_model()
    arm.replace(effects=(*arm.effects, armrs.Effect("time_delay"), armrs.Effect("contact_damping"))).write("arm.toml")
    assert cli.main(["fmu", "export", "arm.toml", "--json", "e.json"]) == 0
    assert "left out" in capsys.readouterr().err
    assert json.loads(Path("e.json").read_text(encoding="utf-8"))["left_out"] == ["contact_damping", "time_delay"]
    assert cli.main(["fmu", "export", "arm.toml", "--port", "motion", "-o", "motion.fmu", "--json", "m.json"]) == 0
    assert json.loads(Path("m.json").read_text(encoding="utf-8"))["left_out"] == ["time_delay"]


def test_an_fmu_of_another_tool_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It was replaced without a word."""
    target, command = tmp_path / "arm.fmu", ["fmu", "export", str(tmp_path / "arm.toml"), "-o", str(tmp_path / "arm.fmu")]
    true_model().write(tmp_path / "arm.toml")
    with zipfile.ZipFile(target, "w") as other:
        other.writestr("modelDescription.xml", "<fmiModelDescription/>")
    before = target.read_bytes()
    assert cli.main(command) == 2
    assert "found a .fmu file that armrs did not write, allowed another name, or --force" in capsys.readouterr().err
    assert target.read_bytes() == before
    assert cli.main([*command, "--force"]) == 0
    written = target.read_bytes()
    assert cli.main([*command, "--fmi", "2"]) == 0 and target.read_bytes() != written
