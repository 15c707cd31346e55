"""From measured data to a device: identify, `armrs export-c`, an image, and its torques against those of this computer."""

from __future__ import annotations

import json
import os
import re
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import online
from armrs.catalogue import catalogue
from armrs.cli import main
from armrs.demo import true_model
from armrs.errors import BadInput
from armrs.model import Effect
from armrs.workflows.firmware import FirmwareSource, covariance_of, export_c, unknowns_of

ROOT = Path(__file__).parents[1]
INCLUDE = ROOT / "crates" / "arm-capi" / "include"
BASE_FLAGS = ["-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{INCLUDE}", "-DARMRS_TWO_JOINTS"]


@pytest.fixture(scope="module")
def identified(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A measured arm (DFKI double pendulum), identified by the command."""
    folder = tmp_path_factory.mktemp("identified")
    main(["identify", str(data / "dfki_a0"), "--with", "coulomb,viscous", "-o", str(folder), "--json", str(folder / "identified.json")])
    return folder


def run(model: Path, target: str) -> list[list[str]]:
    """Build and run the image of a model; the words of each line that it prints."""
    if target != "host-double" and not os.environ.get("ARMRS_EMULATOR"):
        pytest.skip("builds three more libraries: with ARMRS_EMULATOR=1, as make crosscheck does")
    if not (ROOT / "scripts" / "firmware.sh").exists() or shutil.which("cargo") is None:
        pytest.skip("no source tree with cargo")
    environment = os.environ | {"MODEL": str(model), "TWO_JOINTS": "1"}
    done = subprocess.run(
        [str(ROOT / "scripts" / "firmware.sh"), target], env=environment, capture_output=True, text=True, check=False, timeout=1500
    )
    if done.returncode == 77:
        pytest.skip(done.stderr.strip().splitlines()[-1])
    assert done.returncode == 0, done.stdout + done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def numbers(lines: list[list[str]], name: str, single: bool) -> np.ndarray:
    code = ">f" if single else ">d"
    return np.array([[struct.unpack(code, bytes.fromhex(word))[0] for word in line[1:]] for line in lines if line[0] == name])


@pytest.mark.long
@pytest.mark.parametrize("target", ["host-double", "m7", "host-single", "m4"])
def test_the_torques_of_the_device_are_those_of_the_computer(identified: Path, target: str, tmp_path: Path) -> None:
    single = target in ("host-single", "m4")
    source = export_c(identified / "identified.toml", precision="single" if single else "double", identified=identified / "identified.json")
    source.write(tmp_path)
    lines = run(tmp_path, target)
    assert lines[-1] == ["self-test", "passed"]
    torques = numbers(lines, "torque", single)
    largest = np.abs(source.torques).max(axis=1, keepdims=True)
    if single:
        assert np.all(np.abs(torques - source.torques) <= 1e-5 * largest)
    else:
        assert np.array_equal(torques, source.torques)
    sd = numbers(lines, "sd", single)
    assert np.all(sd > 0) and np.all(sd < 0.5)


def test_the_covariance_of_the_device_has_the_correlations_of_the_identification(identified: Path) -> None:
    """What trades in the data is known better together: the torque's deviation is not that of independent errors."""
    path = identified / "identified.json"
    result, model = json.loads(path.read_text()), armrs.load_model(identified / "identified.toml")
    covariance = covariance_of(model, path)
    sd = np.array([e["std"] for e in result["combinations"]])
    assert np.allclose(np.diag(covariance)[:4], sd**2, rtol=1e-12)
    assert result["correlated"][:4] == [e["name"] for e in result["combinations"]]
    between = np.array(result["correlations"])
    assert np.allclose(between, between.T) and np.allclose(np.diag(between), 1.0) and np.linalg.eigvalsh(between).min() > -1e-9
    assert np.abs(between - np.eye(len(between))).max() > 0.3
    assert np.allclose(covariance[:4, :4] / np.outer(sd, sd), between[:4, :4])
    # The parameters of friction stand behind, each with its own standard deviation and not that of a neighbour of its kind.
    own = {(e["kind"], e["joint"], e["name"]): e["std"] for e in result["parameters"]}
    for place, (name, joint, _) in enumerate(unknowns_of(model)[4:], start=4):
        kind, parameter = name.split(" ")
        assert covariance[place, place] == own.get((kind, joint, parameter), 0.0) ** 2
    q = np.array([[0.0, 0.0], [-1.0, 0.8]])
    with_all = online.Compensation(model, path).carry(q)
    alone = np.sqrt([self_of(model, covariance, row) for row in q])
    assert np.allclose(with_all.sd[:, 0], alone, rtol=1e-9)


def self_of(model: armrs.Model, covariance: np.ndarray, q: np.ndarray) -> float:
    """Return the variance of the shoulder's carrying torque at rest, by hand: g (cos q1, cos(q1 + q2)) times the first moments, and springs."""
    weights = np.zeros(len(covariance))
    weights[:2] = model.gravity * np.cos(np.cumsum(q))
    return float(weights @ covariance @ weights)


def test_an_older_result_without_correlations_is_taken(identified: Path, tmp_path: Path) -> None:
    result = json.loads((identified / "identified.json").read_text())
    del result["correlated"], result["correlations"]
    (tmp_path / "old.json").write_text(json.dumps(result))
    covariance = covariance_of(armrs.load_model(identified / "identified.toml"), tmp_path / "old.json")
    assert np.array_equal(covariance, np.diag(np.diag(covariance)))


@pytest.mark.long
def test_a_device_whose_torque_differs_by_a_bit_says_so(identified: Path, tmp_path: Path) -> None:
    source = export_c(identified / "identified.toml")
    first = float(source.torques[0, 0])
    text = source.source.replace(f"R({first.hex()})", f"R({float(np.nextafter(first, np.inf)).hex()})")
    assert text != source.source
    FirmwareSource(source.header, text, source.vectors, source.torques, source.hash).write(tmp_path)
    done = subprocess.run(
        [str(ROOT / "scripts" / "firmware.sh"), "host-double"],
        env=os.environ | {"MODEL": str(tmp_path), "TWO_JOINTS": "1"}, capture_output=True, text=True, check=False, timeout=1500,
    )  # fmt: skip
    assert done.returncode != 0
    assert "the self-test failed" in done.stdout


@pytest.mark.parametrize("kind", sorted(catalogue()))
def test_every_kind_reaches_the_device_or_is_refused_by_name(kind: str) -> None:
    about = catalogue()[kind]
    joint = max(about.first_joint, 1) if about.address == "joint" else None
    effect = Effect(kind, joint, "Fy" if about.address == "channel" else None, {p.name: _value(p) for p in about.parameters})
    plain = true_model().replace(effects=())
    model = plain.replace(effects=(effect,))
    if about.where == "contact" or about.feels_activity or kind in ("shoulder_motion", "shoulder_heave", "force_drift"):
        with pytest.raises(BadInput, match=kind):
            export_c(model)
        return
    with_effect, without = export_c(model), export_c(plain)
    sensed = "sensor" in about.where
    # These act later: a spring that starts relaxed, a reflex with a latency, and a burst that begins after time zero.
    late = kind in ("relaxation", "stretch_reflex", "voluntary")
    assert np.array_equal(with_effect.torques, without.torques) == (sensed or late)
    assert (f'"{kind}"' in with_effect.source) != sensed
    if sensed:
        assert with_effect.source != without.source or with_effect.header != without.header


def test_a_law_of_ones_own_is_refused_by_name() -> None:
    """What Python computes no device can: neither the export nor what stands for the device here takes it."""
    armrs.own_effect("thick_oil", lambda q, qd, viscosity: viscosity * qd, [armrs.Parameter("viscosity", "N m s", 0.0, 5.0, 0.0)])
    model = true_model().replace(effects=(Effect("thick_oil", 1, parameters={"viscosity": 0.3}),))
    for use in (export_c, online.Compensation, lambda m: online.default_settings(m, 0.001)):
        with pytest.raises(BadInput, match="thick_oil"):
            use(model)


def _value(parameter: armrs.catalogue.Parameter) -> float:  # type: ignore[name-defined]
    small = parameter.default if parameter.default else min(0.05, parameter.max)
    return float(np.clip(small, parameter.min, parameter.max))


def test_the_calibration_takes_back_what_the_sensors_add(tmp_path: Path) -> None:
    """Against the formulas of the catalogue: offset of an angle, bias and gain of a force, a sensor that is turned."""
    plain = true_model().replace(effects=())
    sensors = (
        Effect("angle_offset", 2, parameters={"offset": 0.02}),
        Effect("force_bias", channel="Fy", parameters={"bias": 1.5}),
        Effect("time_delay", parameters={"delay": 0.004}),
    )
    source = export_c(plain.replace(effects=sensors))
    assert f"R({(0.02).hex()})" in source.source
    assert f"R({(1.5).hex()})" in source.source
    assert "ARMRS_MODEL_FORCE_DELAY ((armrs_real)0.004)" in source.header


def test_the_verb_writes_two_files_and_says_what(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "model.toml"
    true_model().write(model)
    assert main(["export-c", str(model), "-o", str(tmp_path / "out"), "--precision", "single", "--json", str(tmp_path / "o.json")]) == 0
    written = json.loads((tmp_path / "o.json").read_text())
    assert [Path(f).name for f in written["files"]] == ["armrs_model.h", "armrs_model.c"]
    assert written["hash"] in (tmp_path / "out" / "armrs_model.h").read_text()
    backlash = true_model().replace(effects=(Effect("backlash", parameters={"y": 0.001, "z": 0.001}),))
    backlash.write(model)
    assert main(["export-c", str(model), "-o", str(tmp_path / "none")]) == 2
    assert "backlash" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("compiler", [["cc", "-std=c99"], ["cc", "-std=c99", "-fshort-enums"], ["c++", "-std=c++17", "-xc++"]])
def test_the_source_is_plain_c_and_cpp(compiler: list[str], tmp_path: Path) -> None:
    if shutil.which(compiler[0]) is None:
        pytest.skip(f"no {compiler[0]}")
    export_c(true_model()).write(tmp_path)
    command = [*compiler, *BASE_FLAGS, f"-I{tmp_path}", "-c", str(tmp_path / "armrs_model.c"), "-o", str(tmp_path / "model.o")]
    compiled = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (compiled.returncode, compiled.stderr) == (0, "")


def test_the_firmware_example_carries_an_arm_a_tenth_heavier_than_the_one_that_was_recorded() -> None:
    """Erratum 42: table 1 of appendix D has moments of inertia about the long axes; both arms have those of de Leva (1996) about the joints."""
    number = r"(?:\(armrs_real\))?([0-9.]+)"
    rust = re.search(r"fn human_arm.*?\n}", (ROOT / "crates/arm-core/src/arm/sample_arms.rs").read_text(encoding="utf-8"), flags=re.S)
    c = re.search(r"segments\[ARMRS_JOINTS\] = {.*?};", (ROOT / "firmware/main.c").read_text(encoding="utf-8"), flags=re.S)
    assert rust and c
    recorded = np.array(re.findall(r"segment\(([0-9.]+), ([0-9.]+), ([0-9.]+), ([0-9.]+)\)", rust[0]), dtype=float)
    carried = np.array(re.findall(rf"{{{number}, {number}, {{{number}, 0}}, {number}}}", c[0]), dtype=float)
    length, com, mass, inertia = recorded.T
    assert carried.shape == (3, 4)
    # In the order of C; the last digit of each is rounded.
    for found, expected, digit in zip(carried.T, (length, 1.1 * mass, com, 1.1 * inertia), (1e-3, 1e-3, 1e-3, 1e-4), strict=True):
        np.testing.assert_allclose(found, expected, atol=0.51 * digit, rtol=0.0)
    assert np.all(inertia > 0.9 * np.array([0.0155, 0.0055, 0.0010])), "not a third of the transverse moments"


def test_a_library_of_another_precision_does_not_link(identified: Path, tmp_path: Path) -> None:
    export_c(identified / "identified.toml").write(tmp_path)
    run(tmp_path, "host-double")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    library = target / "crosscheck" / "host-double-two" / "firmware" / "libarmrs_c.a"
    program = tmp_path / "main.c"
    program.write_text('#include "armrs.h"\nint main(void) { armrs_effect e; return armrs_effect_named("coulomb", 0, &e) != ARMRS_OK; }\n')

    def link(*flags: str) -> subprocess.CompletedProcess[str]:
        command = [
            "cc",
            "-std=c99",
            f"-I{INCLUDE}",
            *flags,
            str(program),
            str(library),
            "-lm",
            "-lpthread",
            "-ldl",
            "-o",
            str(tmp_path / "a"),
        ]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert link("-DARMRS_TWO_JOINTS").returncode == 0
    for wrong, symbol in ((["-DARMRS_TWO_JOINTS", "-DARMRS_SINGLE"], "single_two"), ([], "double_three")):
        done = link(*wrong)
        assert done.returncode != 0
        assert f"armrs_abi_3_{symbol}_joints" in done.stderr
    assert link("-DARMRS_TWO_JOINTS", "-fshort-enums").returncode == 0
    assert subprocess.run([tmp_path / "a"], check=False).returncode == 0
