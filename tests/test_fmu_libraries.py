"""FMUs with libraries for several machines. The files here only look like libraries; real ones are not run by any test."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from armrs import __version__, cli
from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.errors import BadInput
from armrs.fmu import bundled_libraries
from armrs.fmu.bundled_libraries import PLATFORMS, Platform
from armrs.fmu.shared_library import platform_folder

ARM = Path(__file__).parents[1] / "examples" / "cosim" / "arm.toml"
MACHINES = ["x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin"]


def made(platform: Platform, version: str = __version__) -> bytes:
    """Return the bytes by which a library is known: how it begins, the machine, and the mark of armrs."""
    mark = f"armrs library for FMUs {version}\0".encode()
    if platform.suffix == ".dll":
        return b"MZ".ljust(60, b"\0") + (128).to_bytes(4, "little") + bytes(64) + b"PE\0\0" + platform.machine + mark
    if platform.suffix == ".dylib":
        return platform.magic + platform.machine + mark
    return platform.magic.ljust(18, b"\0") + platform.machine + mark


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, platform in PLATFORMS.items():
        (tmp_path / "libs" / name).mkdir(parents=True)
        (tmp_path / "libs" / name / platform.file).write_bytes(made(platform))
    (tmp_path / "libs" / "license.txt").write_text("licences of all", encoding="utf-8")
    return tmp_path / "libs"


def inside(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as files:
        return {name: files.read(name) for name in files.namelist() if "binaries/" in name or name.endswith("license.txt")}


def test_one_fmu_holds_the_libraries_of_all_machines(folder: Path, tmp_path: Path) -> None:
    found = inside(export_fmu(true_model(), tmp_path / "arm.fmu", libraries=folder))
    expected = {f"binaries/{name}/ArmRs{PLATFORMS[name].suffix}": made(PLATFORMS[name]) for name in MACHINES}
    here, suffix = platform_folder(3)
    assert found == expected | {"documentation/licenses/license.txt": b"licences of all"} | {
        name: data for name, data in found.items() if name == f"binaries/{here}/ArmRs{suffix}"
    }


def test_fmi_2_leaves_out_what_it_has_no_folder_for(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["fmu", "export", str(ARM), "--fmi", "2", "--library", str(folder)]) == 0
    places = sorted(name.split("/")[1] for name in inside(tmp_path / "arm.fmu") if name.startswith("binaries/"))
    assert places == ["darwin64", "linux64", "win64"]
    assert "left out: aarch64-darwin, aarch64-linux, because FMI 2.0 has no folder for them" in capsys.readouterr().err


def test_this_machine_s_own_library_is_always_there(folder: Path, tmp_path: Path) -> None:
    here, suffix = platform_folder(3)
    if here not in PLATFORMS:
        pytest.skip(f"no folder {here}")
    (folder / here / PLATFORMS[here].file).unlink()
    (folder / here).rmdir()
    found = inside(export_fmu(true_model(), tmp_path / "arm.fmu", libraries=folder))
    own = inside(export_fmu(true_model(), tmp_path / "own.fmu"))
    assert found[f"binaries/{here}/ArmRs{suffix}"] == own[f"binaries/{here}/ArmRs{suffix}"]
    assert len(found) == len(MACHINES) + 1


@pytest.mark.parametrize("name", MACHINES)
def test_a_library_for_another_machine_is_refused(name: str, folder: Path, tmp_path: Path) -> None:
    other = MACHINES[MACHINES.index(name) - 1]
    (folder / name / PLATFORMS[name].file).write_bytes(made(PLATFORMS[other]))
    with pytest.raises(BadInput, match=f"a file for another machine, allowed a library for {name}"):
        export_fmu(true_model(), tmp_path / "arm.fmu", libraries=folder)
    assert not (tmp_path / "arm.fmu").exists()


def test_a_package_with_the_library_of_another_machine_is_refused(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wheel for aarch64 that held the library for x86-64 wrote it into the folder for aarch64."""
    here = platform_folder(3)[0]
    if here not in PLATFORMS:
        pytest.skip(f"no folder {here}")
    other = MACHINES[MACHINES.index(here) - 1]
    monkeypatch.setattr(bundled_libraries, "library", lambda: folder / other / PLATFORMS[other].file)
    with pytest.raises(BadInput, match=f"a file for another machine, allowed a library for {here}"):
        export_fmu(true_model(), tmp_path / "arm.fmu")
    assert not (tmp_path / "arm.fmu").exists()


def test_a_library_of_another_version_is_refused(folder: Path, tmp_path: Path) -> None:
    path = folder / "x86_64-windows" / "arm_fmu.dll"
    for content, words in (
        (made(PLATFORMS["x86_64-windows"], "0.0.0"), "found 0.0.0"),
        (made(PLATFORMS["x86_64-windows"])[:140], "found no library of armrs"),
    ):
        path.write_bytes(content)
        with pytest.raises(BadInput, match=f"{words}, allowed that of armrs {__version__}"):
            export_fmu(true_model(), tmp_path / "arm.fmu", libraries=folder)


def test_a_folder_without_libraries_is_refused(folder: Path, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    odd = tmp_path / "odd"
    (odd / "linux64").mkdir(parents=True)
    hollow = tmp_path / "hollow"
    (hollow / "aarch64-linux").mkdir(parents=True)
    for place, words in (
        (empty, "no libraries"),
        (odd, "found 'linux64', allowed folders x86_64-linux"),
        (hollow, "allowed aarch64-linux/libarm_fmu.so"),
        (tmp_path / "absent", "no folder"),
    ):
        with pytest.raises(BadInput, match=words):
            export_fmu(true_model(), tmp_path / "arm.fmu", libraries=place)


def test_fmi_2_is_refused_on_a_machine_without_a_folder(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bundled_libraries, "library", lambda: folder / "aarch64-linux" / "libarm_fmu.so")
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(BadInput, match=r"FMI 2\.0 has no folder for libraries of aarch64-linux"):
        export_fmu(true_model(), tmp_path / "arm.fmu", fmi=2)
    assert not (tmp_path / "arm.fmu").exists()
