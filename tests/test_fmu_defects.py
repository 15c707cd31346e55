"""What `armrs fmu check` finds in defective FMUs, and that it finds nothing in good ones of other tools."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import fmu_defects
from armrs import cli
from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.errors import BadInput, SlaveError
from armrs.fmu.check import check_fmu
from armrs.fmu.imported_slave import ImportedSlave

CASES = [(fmi, name) for fmi in (2, 3) for name in (*fmu_defects.BOTH, *(fmu_defects.TWO if fmi == 2 else fmu_defects.THREE))]
NEEDS_COMPILER = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
LIMITED = pytest.mark.skipif(sys.platform != "linux", reason="memory and writing are limited on Linux alone")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    pytest.importorskip("fmpy")
    place = tmp_path_factory.mktemp("good")
    return {fmi: export_fmu(true_model(), place / f"arm{fmi}.fmu", fmi=fmi, start=np.radians([-60.0, 50.0])) for fmi in (2, 3)}


def errors(path: Path, **settings: float) -> list[str]:
    return [str(f) for f in check_fmu(path, **settings) if f.level == "error"]


@pytest.mark.parametrize(("fmi", "defect"), CASES)
def test_every_defect_of_a_description_is_found_and_named(fmi: int, defect: str, good: dict[int, Path], tmp_path: Path) -> None:
    own = fmu_defects.TWO if fmi == 2 else fmu_defects.THREE
    change, words = (fmu_defects.BOTH | own)[defect]
    path = fmu_defects.edited(good[fmi], tmp_path / "edited.fmu", change)
    found = errors(path, library=False)
    assert any(words in text for text in found), found


@NEEDS_COMPILER
@pytest.mark.parametrize("defect", fmu_defects.CLOCKS)
def test_every_defect_of_a_clock_is_found_and_named(defect: str, tmp_path: Path) -> None:
    pytest.importorskip("fmpy")
    change, words = fmu_defects.CLOCKS[defect]
    found = errors(fmu_defects.small(tmp_path, description=change(fmu_defects.SMALL)), library=False)
    assert any(words in text for text in found), found


@NEEDS_COMPILER
def test_the_small_fmu_is_good(tmp_path: Path) -> None:
    assert errors(fmu_defects.small(tmp_path)) == []


@NEEDS_COMPILER
@pytest.mark.parametrize("defect", fmu_defects.LIBRARY)
def test_every_broken_promise_is_found_and_named(defect: str, tmp_path: Path) -> None:
    if defect == "EATS" and sys.platform != "linux":
        pytest.skip("memory is limited on Linux alone")
    found = errors(fmu_defects.small(tmp_path, defect), seconds=2.0 if defect == "HANGS" else 60.0)
    assert any(fmu_defects.LIBRARY[defect] in text for text in found), found


@NEEDS_COMPILER
def test_an_fmu_that_wants_the_event_mode_is_no_defect(tmp_path: Path) -> None:
    found = [str(f) for f in check_fmu(fmu_defects.small(tmp_path, "EVENT_MODE_ASKED"))]
    with pytest.raises(SlaveError, match="armrs couples FMUs without their event mode"):
        ImportedSlave(fmu_defects.small(tmp_path, "EVENT_MODE_ASKED"))
    assert any(text.startswith("note: CoSimulation, hasEventMode: an instance without event mode is refused") for text in found)
    assert not any(text.startswith("error") for text in found), found


@NEEDS_COMPILER
def test_wrong_dependencies_are_found(tmp_path: Path) -> None:
    description = fmu_defects.SMALL.replace('"4" dependencies="1 2"', '"4" dependencies="2"')
    [found] = errors(fmu_defects.small(tmp_path, description=description))
    assert "InitialUnknown z: changes with x, which is not among its dependencies" in found


@NEEDS_COMPILER
@pytest.mark.parametrize("defect", ["", "EXCHANGE_REFUSED", "RATES_REFUSED", "STATES_MISCOUNTED"])
def test_an_fmu_for_model_exchange_alone_is_tried(defect: str, tmp_path: Path) -> None:
    description = re.sub(r"(?s)  <(CoSimulation|ScheduledExecution).*?/>\n", "", fmu_defects.SMALL)
    found = errors(fmu_defects.small(tmp_path, defect, description))
    assert [fmu_defects.LIBRARY[defect] in text for text in found] == [True] if defect else found == []


@NEEDS_COMPILER
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('priority="1"', 'priority="first"'),
        ('"0.01" priority', '"1e-300" priority'),
        ('intervalDecimal="0.01"', 'intervalCounter="1" resolution="0"'),
    ],
)
def test_clocks_that_make_no_sense_are_findings(old: str, new: str, tmp_path: Path) -> None:
    pytest.importorskip("fmpy")
    found = errors(fmu_defects.small(tmp_path, description=fmu_defects.SMALL.replace(old, new)))
    assert not any("Traceback" in text or "status 1" in text for text in found), found
    assert bool(found) == ("1e-300" not in new)


@NEEDS_COMPILER
@pytest.mark.parametrize("defect", ["", "SCHEDULED_REFUSED", "PREEMPTION_LOCKED"])
def test_an_fmu_for_scheduled_execution_alone_is_tried(defect: str, tmp_path: Path) -> None:
    description = re.sub(r"(?s)  <(CoSimulation|ModelExchange).*?/>\n", "", fmu_defects.SMALL)
    found = errors(fmu_defects.small(tmp_path, defect, description))
    assert [fmu_defects.LIBRARY[defect] in text for text in found][:1] == [True] if defect else found == []


@pytest.mark.long
@NEEDS_COMPILER
def test_an_fmu_that_can_be_instantiated_only_once_is_tried_in_several_processes(tmp_path: Path) -> None:
    once = fmu_defects.SMALL.replace('modelIdentifier="small"', 'modelIdentifier="small" canBeInstantiatedOnlyOncePerProcess="true"')
    assert errors(fmu_defects.small(tmp_path, "ONLY_ONCE", once)) == []
    assert errors(fmu_defects.small(tmp_path, "ONLY_ONCE"))
    [found] = errors(fmu_defects.small(tmp_path, "EARLY_IGNORED", once))
    assert fmu_defects.LIBRARY["EARLY_IGNORED"] in found


@NEEDS_COMPILER
def test_an_fmu_that_needs_its_tool_is_no_defect(tmp_path: Path) -> None:
    description = fmu_defects.SMALL.replace(
        '<CoSimulation modelIdentifier="small"', '<CoSimulation modelIdentifier="small" needsExecutionTool="true"'
    )
    assert errors(fmu_defects.small(tmp_path, "TOKEN_REFUSED", description)) == []


@NEEDS_COMPILER
def test_each_interface_may_have_a_library_of_its_own(tmp_path: Path) -> None:
    description = fmu_defects.SMALL.replace('<ModelExchange modelIdentifier="small"', '<ModelExchange modelIdentifier="other"')
    source = fmu_defects.packed(
        tmp_path / "two.fmu", description, small=fmu_defects.library(""), other=fmu_defects.library("RATES_REFUSED")
    )
    [found] = errors(source)
    assert "GetContinuousStateDerivatives" in found


ALIAS = """
    <ScalarVariable name="alias" valueReference="{reference}" variability="{variability}" causality="local"><Real {unit}/></ScalarVariable>
"""


@pytest.mark.parametrize(
    ("unit", "variability", "level", "words"),
    [
        ('unit="m/s2"', "fixed", "", ""),
        ('unit="m"', "fixed", "error", "with different units: 'm', 'm/s2'"),
        ('unit="m/s2"', "tunable", "note", "with different variabilities"),
    ],
)
def test_aliases_of_fmi_2_have_one_unit(unit: str, variability: str, level: str, words: str, good: dict[int, Path], tmp_path: Path) -> None:
    def add(text: str) -> str:
        element = re.search(r'<ScalarVariable name="gravity" valueReference="(\d+)"', text)
        assert element is not None
        alias = ALIAS.format(reference=element[1], variability=variability, unit=unit)
        return text.replace("</ModelVariables>", f"{alias}</ModelVariables>")

    found = [str(f) for f in check_fmu(fmu_defects.edited(good[2], tmp_path / "edited.fmu", add), library=False) if "gravity" in f.place]
    assert [f.startswith(level) and words in f for f in found] == ([True] if level else [])


@pytest.mark.parametrize(("starts", "count"), [(("2.0", "2.0"), 0), (("2.0", "3.0"), 1)])
def test_aliases_of_fmi_2_that_are_constants_have_one_start(
    starts: tuple[str, str], count: int, good: dict[int, Path], tmp_path: Path
) -> None:
    constant = (
        '<ScalarVariable name="{}" valueReference="99999" variability="constant" causality="local"><Real start="{}"/></ScalarVariable>'
    )

    def add(text: str) -> str:
        both = "".join(constant.format(name, start) for name, start in zip(("one", "other"), starts, strict=True))
        return text.replace("</ModelVariables>", f"{both}</ModelVariables>")

    found = [str(f) for f in check_fmu(fmu_defects.edited(good[2], tmp_path / "edited.fmu", add), library=False) if "one, other" in f.place]
    assert len(found) == count, found
    assert all("are constants with different start values" in text for text in found)


def test_there_are_more_than_120_of_them() -> None:
    assert len(CASES) + len(fmu_defects.LIBRARY) + 1 >= 120


@LIMITED
@NEEDS_COMPILER
def test_a_library_writes_nothing_outside_its_folder(tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    stub = f'#include <stdio.h>\n__attribute__((constructor)) static void leave(void) {{ FILE *f = fopen("{outside}", "w"); if (f) fclose(f); }}\n'
    source = fmu_defects.packed(tmp_path / "small.fmu", fmu_defects.SMALL, small=fmu_defects.library("", stub))
    found = check_fmu(source)
    if any(f.place == "sandbox" for f in found):
        pytest.skip("this kernel has no Landlock")
    assert not [f for f in found if f.level == "error"]
    assert not outside.exists()


@LIMITED
@NEEDS_COMPILER
def test_foreign_code_ends_with_its_parent(tmp_path: Path) -> None:
    """Also while it hangs, and also when the parent is killed."""
    path = fmu_defects.small(tmp_path, "HANGS")
    program = "import sys; from armrs.fmu.check import check_fmu; check_fmu(sys.argv[1])"
    marker = {"ARMRS_TEST_MARKER": str(os.getpid())}
    parent = subprocess.Popen(
        [sys.executable, "-c", program, str(path)], env=os.environ | marker | {"PYTHONPATH": os.pathsep.join(sys.path)}
    )
    try:
        assert wait_for(lambda: len(marked(marker)) >= 2), "the process of the FMU does not appear"
        parent.kill()
        parent.wait()
        assert wait_for(lambda: not marked(marker)), marked(marker)
    finally:
        parent.kill()


def wait_for(condition: object) -> bool:
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        if condition():  # type: ignore[operator]
            return True
        time.sleep(0.1)
    return False


def marked(marker: dict[str, str]) -> list[int]:
    """Processes that have inherited a word of the environment."""
    [(key, value)] = marker.items()
    found = []
    for entry in Path("/proc").glob("[0-9]*/environ"):
        try:
            if f"{key}={value}".encode() in entry.read_bytes().split(b"\0"):
                found.append(int(entry.parent.name))
        except OSError:  # noqa: PERF203 (processes end meanwhile)
            continue
    return found


# ---- archives
def packed(path: Path, *entries: tuple[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as files:
        for name, data in entries:
            files.writestr(name, data)
    return path


def test_a_description_of_millions_of_elements_is_refused_unread(tmp_path: Path) -> None:
    path = packed(tmp_path / "bomb.fmu", ("modelDescription.xml", b"<a>" + b"<b/>" * 2_000_000 + b"</a>"))
    [found] = errors(path)
    assert "allowed at most 1000000" in found


def test_a_description_beyond_all_sizes_is_refused_unread(tmp_path: Path) -> None:
    path = packed(tmp_path / "bomb.fmu", ("modelDescription.xml", b" " * (65 << 20)))
    [found] = errors(path)
    assert "allowed at most 67108864 bytes" in found


@pytest.mark.parametrize("place", ["/dev/zero", "/dev/null"])
def test_devices_are_no_files(place: str) -> None:
    if not Path(place).exists():
        pytest.skip(f"no {place}")
    with pytest.raises(BadInput, match="not a regular file"):
        check_fmu(place)


@pytest.mark.parametrize("name", ["a\0b", "a\nb", "x" * 300, "\udcff", "C:/evil.txt"])
def test_names_that_no_file_has_are_findings(name: str, good: dict[int, Path], tmp_path: Path) -> None:
    path = tmp_path / "names.fmu"
    shutil.copy(good[3], path)
    try:
        with zipfile.ZipFile(path, "a") as files:
            info = zipfile.ZipInfo("x")
            info.filename = info.orig_filename = name
            files.writestr(info, "evil")
    except (UnicodeError, ValueError):
        pytest.skip("zipfile does not write such a name")
    try:
        assert errors(path)
    except BadInput as error:
        assert "\n" not in str(error)


# ---- partners that die
@NEEDS_COMPILER
@pytest.mark.parametrize(
    ("defect", "how"), [("EXITS", "ends the process with status 0"), ("ABORTS", "signal 6"), ("HANGS", "does not return within 2 s")]
)
def test_a_partner_that_dies_ends_a_run_with_a_finding(
    defect: str, how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fmu_defects.small(tmp_path, defect)
    monkeypatch.chdir(tmp_path)
    system = f'[system]\nstep_s = 0.01\nduration_s = 0.1\n[[slave]]\nname = "small"\nfmu = "small{defect}.fmu"\nseconds = 2.0\n'
    Path("system.toml").write_text(system, encoding="utf-8")
    assert cli.main(["fmu", "run", "system.toml", "-o", "out"]) == 1
    assert how in capsys.readouterr().err
    assert Path("out/coupled.json").exists()
    assert not Path("out/coupled.csv").exists()


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_empty_token_is_no_defect(fmi: int, good: dict[int, Path], tmp_path: Path) -> None:
    """The standard says what the token is for, and not what it looks like."""

    def empty(text: str) -> str:
        return re.sub(r'(instantiationToken|guid)="[^"]*"', r'\1=""', text, count=1)

    found = [str(f) for f in check_fmu(fmu_defects.edited(good[fmi], tmp_path / "empty.fmu", empty), library=False)]
    assert not any(f.startswith("error") for f in found), found
    assert any("empty: nothing ties the description to the library" in f for f in found)


def test_an_fmu_of_another_version_is_refused_in_one_line(good: dict[int, Path], tmp_path: Path) -> None:
    path = fmu_defects.edited(good[2], tmp_path / "one.fmu", lambda text: text.replace('fmiVersion="2.0"', 'fmiVersion="1.0"'))
    assert errors(path) == ["error: modelDescription.xml, fmiVersion: found 1.0, allowed 2.0 or 3.0"]
