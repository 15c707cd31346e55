"""Good FMUs that other tools make here: PythonFMU (FMI 2.0), PythonFMU3 (FMI 3.0), and containers of fmu-manipulation-toolbox."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from armrs.fmu.check import check_fmu
from armrs.fmu.description import read_description
from pythonfmu_builds import built

SLAVE_2 = """
from pythonfmu import {kind}, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability


class Small(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = self.y = self.p = {value}
        kind = {{"start": {value}, "variability": Fmi2Variability.{variability}}}
        tunable = {{"start": {value}, "variability": Fmi2Variability.tunable}}
        self.register_variable({kind}("u", causality=Fmi2Causality.input, **kind))
        self.register_variable({kind}("p", causality=Fmi2Causality.parameter, **tunable))
        self.register_variable({kind}("y", causality=Fmi2Causality.output, initial=Fmi2Initial.exact, **kind))

    def do_step(self, current_time, step_size):
        self.y = self.u
        return True
"""
SLAVE_3 = """
from pythonfmu3 import {kind}, Float64, Fmi3Causality, Fmi3Initial, Fmi3Slave, Fmi3Variability


class Small(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = 0.0
        self.u = self.y = self.p = {value}
        kind = {{"variability": Fmi3Variability.{variability}}}
        tunable = {{"variability": Fmi3Variability.tunable}}
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        self.register_variable({kind}("u", causality=Fmi3Causality.input, **kind))
        self.register_variable({kind}("p", causality=Fmi3Causality.parameter, **tunable))
        self.register_variable({kind}("y", causality=Fmi3Causality.output, initial=Fmi3Initial.calculated, **kind))

    def do_step(self, current_time, step_size):
        self.time = current_time + step_size
        self.y = self.u
        return True
"""
KINDS = {
    2: {"Real": 1.5, "Integer": 3, "Boolean": True, "String": "text"},
    3: {"Float64": 1.5, "Int32": 3, "Int64": -3, "UInt64": 3, "Boolean": True, "String": "text"},
}
CASES = [(fmi, kind, state) for fmi, kinds in KINDS.items() for kind in kinds for state in (False, True)]
# Around FMUs of PythonFMU it lists outputs with exact start values as InitialUnknown, which FMPy reports too.
CONTAINERS = [(kind, fmi, option) for kind in ("Float64", "Int32", "Boolean") for fmi in (2, 3) for option in ("", "-sequential", "-mt")]


def small(folder: Path, fmi: int, kind: str, *, state: bool = False) -> Path:
    """Make an FMU with an input, an output and a parameter of one type."""
    variability = "continuous" if kind in ("Real", "Float64") else "discrete"
    text = (SLAVE_2 if fmi == 2 else SLAVE_3).format(kind=kind, value=repr(KINDS[fmi][kind]), variability=variability)
    return built(folder, text, "Small", *(["--handle-state"] if state else []), fmi=fmi)


def errors(path: Path) -> list[str]:
    return [str(f) for f in check_fmu(path) if f.level == "error"]


@pytest.mark.parametrize(("fmi", "kind", "state"), CASES)
def test_nothing_is_found_in_a_good_fmu(fmi: int, kind: str, state: bool, tmp_path: Path) -> None:
    path = small(tmp_path, fmi, kind, state=state)
    assert read_description(path).fmi == fmi
    assert errors(path) == []


@pytest.mark.parametrize(("kind", "fmi", "option"), CONTAINERS)
def test_nothing_is_found_in_a_good_container(kind: str, fmi: int, option: str, tmp_path: Path) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    small(tmp_path, 3, kind)
    content = {"name": "container.fmu", "fmu": ["Small.fmu"], "step_size": 0.01}
    (tmp_path / "container.json").write_text(json.dumps(content), encoding="utf-8")
    program = "from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer; fmucontainer()"
    command = [sys.executable, "-c", program, "-container", "container.json", "-fmi", str(fmi), *([option] if option else [])]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert errors(tmp_path / "container.fmu") == []
