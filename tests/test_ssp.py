"""Systems as files of SSP 1.0: written, validated with the standard's schema, run by FMPy, and read back; files by hand."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

from armrs import cli
from armrs.cosim.master import run_system
from armrs.cosim.ssp import ROOT, load_ssp
from armrs.cosim.ssp_export import export_ssp
from armrs.cosim.system import load_system
from armrs.errors import BadInput
from pythonfmu_builds import built

ARM = Path(__file__).parents[1] / "examples" / "cosim" / "arm.toml"
GAIN = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Gain(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.k, self.u, self.y, self.n, self.on, self.label = 2.0, 0.0, 0.0, 1, True, "text"
        self.register_variable(Real("k", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=2.0))
        self.register_variable(Integer("n", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=1))
        self.register_variable(Boolean("on", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=True))
        self.register_variable(String("label", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start="text"))
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.y = self.k * self.n * self.u

    def do_step(self, current_time, step_size):
        self.y = self.k * self.n * self.u if self.on else 0.0
        return True
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an FMU of PythonFMU."""
    return built(tmp_path_factory.mktemp("ssp"), GAIN, "Gain").parent


def arms(folder: Path) -> Path:
    """Two arms and a gain between them: what the first moves pushes the second."""
    text = f"""
[system]
step_s = 0.01
duration_s = 0.2
accuracy = 0.02
[[slave]]
name = "one"
model = {str(ARM)!r}
start_deg = [-120.0, 30.0]
[[slave]]
name = "gain"
fmu = "Gain.fmu"
[slave.start]
k = -3.5
n = 2
on = true
label = "a < b"
[[slave]]
name = "two"
model = {str(ARM)!r}
start_deg = [-90.0, 10.0]
[slave.start]
"body[1].m" = 2.5
[[connection]]
from = "one.qd[1]"
to = "gain.u"
factor = 0.5
[[connection]]
from = "gain.y"
to = "two.tau[1]"
within = "start"
offset = 1.5
"""
    path = folder / "arms.toml"
    path.write_text(text, encoding="utf-8")
    return path


def ran(system: object) -> dict[str, np.ndarray]:
    try:
        return run_system(system).columns  # type: ignore[arg-type]
    finally:
        system.free()  # type: ignore[attr-defined]


def test_a_system_goes_there_and_back(folder: Path) -> None:
    system = load_system(arms(folder))
    path = export_ssp(system, folder / "arms.ssp")
    first = path.read_bytes()
    assert export_ssp(system, path).read_bytes() == first
    expected = ran(system)
    read = load_ssp(path)
    assert (read.step, read.duration, read.accuracy, read.algorithm) == (system.step, system.duration, system.accuracy, system.algorithm)
    ends = [(c.source, c.target, c.within, c.dual, c.sign, c.factor, c.offset) for c in read.connections]
    assert ends == [(c.source, c.target, c.within, c.dual, c.sign, c.factor, c.offset) for c in system.connections]
    assert read.starts == {"one": {}} | system.starts
    found = ran(read)
    assert set(found) == set(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)


@pytest.mark.long
def test_the_example_goes_there_and_back(folder: Path) -> None:
    """Two arms hand in hand: energies have the same sign where they are read back."""
    system = load_system(ARM.parent / "two-arms.toml")
    read = load_ssp(export_ssp(system, folder / "two-arms.ssp"))
    lines = [{(c.source, c.target, c.within, c.dual, c.sign) for c in each.connections} for each in (system, read)]
    assert lines[0] == lines[1]
    expected, found = ran(system), ran(read)
    assert float(np.ptp(expected["two.contact.F[1]"])) > 1.0
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)


def test_the_standard_s_schema_takes_it(folder: Path) -> None:
    fmpy, etree = pytest.importorskip("fmpy"), pytest.importorskip("lxml.etree")
    system = load_system(arms(folder))
    path = export_ssp(system, folder / "valid.ssp")
    system.free()
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureDescription.xsd"))
    with zipfile.ZipFile(path) as files:
        schema.assertValid(etree.fromstring(files.read(ROOT)))


def test_fmpy_runs_it(folder: Path) -> None:
    """FMPy gives inputs what the outputs were before the step, as Jacobi does; it takes no parameters of components and no transformations."""
    pytest.importorskip("fmpy")
    from fmpy.ssp.simulation import simulate_ssp

    text = arms(folder).read_text(encoding="utf-8")
    text = re.sub(r"(?m)^((factor|offset|k|n|on|label) =|\[slave.start\]|\"body).*\n", "", text).replace(
        "accuracy", 'algorithm = "jacobi"\naccuracy'
    )
    (folder / "jacobi.toml").write_text(text, encoding="utf-8")
    system = load_system(folder / "jacobi.toml")
    path = export_ssp(system, folder / "jacobi.ssp")
    expected = ran(system)
    found = simulate_ssp(str(path), start_time=0.0, stop_time=0.2, step_size=0.01)
    assert np.ptp(expected["two.q[1]"]) > 0.01
    for name in ("one.qd[1]", "gain.y", "two.q[1]"):
        np.testing.assert_array_equal(found[name], expected[name][1:])


def test_the_verbs(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    arms(folder)
    monkeypatch.chdir(folder)
    assert cli.main(["fmu", "ssp", "arms.toml", "-o", "verb.ssp"]) == 0
    assert cli.main(["fmu", "run", "verb.ssp", "-o", "out", "--duration", "0.1", "--no-estimate"]) == 0
    assert (folder / "out" / "coupled.csv").exists()
    assert cli.main(["fmu", "run", "arms.toml", "--step", "0.1"]) == 2
    assert "step_s and duration_s in [system]" in capsys.readouterr().err


def test_a_wall_has_no_place_in_an_archive(tmp_path: Path) -> None:
    system = load_system(ARM.with_name("wall.toml"))
    with pytest.raises(BadInput, match="wall: found a wall, allowed an arm or an FMU"):
        export_ssp(system, tmp_path / "wall.ssp")
    assert not (tmp_path / "wall.ssp").exists()


# ---- files that others may write
HEAD = " ".join(
    f'xmlns:{part}="http://ssp-standard.org/SSP1/SystemStructure{word}"'
    for part, word in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"), ("ssm", "ParameterMapping"))
)
NESTED = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription name="nested" version="1.0" {HEAD}>
  <ssd:System name="top">
    <ssd:Connectors><ssd:Connector name="gain" kind="parameter"><ssc:Real/></ssd:Connector></ssd:Connectors>
    <ssd:ParameterBindings><ssd:ParameterBinding source="top.ssv"/></ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:System name="inner">
        <ssd:Connectors>
          <ssd:Connector name="in" kind="input"><ssc:Real/></ssd:Connector>
          <ssd:Connector name="k" kind="parameter"><ssc:Real/></ssd:Connector>
        </ssd:Connectors>
        <ssd:Elements>
          <ssd:Component name="last" source="Gain.fmu">
            <ssd:Connectors>
              <ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector>
              <ssd:Connector name="k" kind="parameter"><ssc:Real/></ssd:Connector>
              <ssd:Connector name="y" kind="output"><ssc:Real/></ssd:Connector>
            </ssd:Connectors>
          </ssd:Component>
        </ssd:Elements>
        <ssd:Connections>
          <ssd:Connection startConnector="in" endElement="last" endConnector="u"><ssc:LinearTransformation factor="10" offset="1"/></ssd:Connection>
          <ssd:Connection startConnector="k" endElement="last" endConnector="k"/>
        </ssd:Connections>
      </ssd:System>
      <ssd:Component name="first" source="Gain.fmu">
        <ssd:Connectors>
          <ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector>
          <ssd:Connector name="y" kind="output"><ssc:Real/></ssd:Connector>
        </ssd:Connectors>
        <ssd:ParameterBindings>
          <ssd:ParameterBinding>
            <ssd:ParameterValues>
              <ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>
                <ssv:Parameter name="start"><ssv:Real value="0.5"/></ssv:Parameter>
                <ssv:Parameter name="whole"><ssv:Integer value="3"/></ssv:Parameter>
              </ssv:Parameters></ssv:ParameterSet>
            </ssd:ParameterValues>
            <ssd:ParameterMapping>
              <ssm:ParameterMapping version="1.0">
                <ssm:MappingEntry source="start" target="u"><ssc:LinearTransformation factor="4"/></ssm:MappingEntry>
                <ssm:MappingEntry source="whole" target="n"/>
                <ssm:MappingEntry source="whole" target="nothing"/>
              </ssm:ParameterMapping>
            </ssd:ParameterMapping>
          </ssd:ParameterBinding>
        </ssd:ParameterBindings>
      </ssd:Component>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="first" startConnector="y" endElement="inner" endConnector="in"><ssc:LinearTransformation factor="2" offset="3"/></ssd:Connection>
      <ssd:Connection startConnector="gain" endElement="inner" endConnector="k"/>
    </ssd:Connections>
  </ssd:System>
  <ssd:DefaultExperiment startTime="0" stopTime="1"/>
</ssd:SystemStructureDescription>
"""
VALUES = f"""<?xml version="1.0"?>
<ssv:ParameterSet version="1.0" name="top" {HEAD}><ssv:Parameters>
  <ssv:Parameter name="gain"><ssv:Real value="7"/></ssv:Parameter>
</ssv:Parameters></ssv:ParameterSet>
"""


def nested(folder: Path, old: str = "", new: str = "", *, name: str = "nested.ssd") -> Path:
    assert old in NESTED
    (folder / "top.ssv").write_text(VALUES, encoding="utf-8")
    (folder / name).write_text(NESTED.replace(old, new, 1) if old else NESTED, encoding="utf-8")
    return folder / name


def test_systems_within_systems_mappings_and_transformations(folder: Path) -> None:
    system = load_ssp(nested(folder), step=0.5)
    [line] = system.connections
    assert (line.source, line.target, line.factor, line.offset) == (("first", "y"), ("inner/last", "u"), 20.0, 31.0)
    assert system.starts == {"inner/last": {"k": 7.0}, "first": {"u": 2.0, "n": 3}}
    assert [w for w in system.warnings if "nothing" in w] == ["first: the parameter nothing matches no variable of the FMU and is ignored"]
    # 2 · 3 · 2 comes out of the first, 20 · 12 + 31 goes into the last.
    assert ran(system)["inner/last.y"][-1] == 7.0 * 271.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('stopTime="1"', "", "duration: found nothing"),
        ('startTime="0"', 'startTime="3"', "startTime: found 3.0, allowed 0"),
        ('source="Gain.fmu"', 'source="Gain.fmu" type="application/x-ssp-definition"', "allowed application/x-fmu-sharedlibrary"),
        ('source="Gain.fmu"', 'source="Gain.fmu" implementation="ModelExchange"', "allowed any or CoSimulation"),
        ('source="Gain.fmu"', 'source="Absent.fmu"', "Absent.fmu"),
        ('factor="4"', 'factor="four"', "factor: found four, allowed a number"),
        ('<ssv:Real value="0.5"/>', '<ssv:Enumeration value="a"/>', "found Enumeration"),
        ('source="start"', 'source="begin"', "allowed a parameter of the binding"),
        ('endElement="inner" endConnector="k"', 'endElement="inner" endConnector="in"', "a second connection to this input"),
        ('startElement="first" startConnector="y"', 'startElement="first" startConnector="z"', "z"),
        (
            '<ssd:System name="inner">',
            '<ssd:SignalDictionaryReference name="d" dictionary="d"/><ssd:System name="inner">',
            "SignalDictionaryReference",
        ),
        ("<?xml", "<!DOCTYPE a><?xml", "a document type"),
        ('encoding="UTF-8"', 'encoding="UTF-1"', "unknown encoding"),
    ],
)
def test_what_is_not_taken_is_named(folder: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(BadInput, match=words.replace("(", r"\(")):
        load_ssp(nested(folder, old, new, name="broken.ssd"), step=0.5).free()


def test_a_mapping_from_nothing_maps_nothing(folder: Path) -> None:
    entry = '<ssm:MappingEntry source="whole" target="nothing"/>'
    system = load_ssp(nested(folder, entry, entry.replace("whole", ""), name="empty.ssd"), step=0.5)
    assert system.starts["first"] == {"u": 2.0, "n": 3}
    assert not [w for w in system.warnings if "nothing" in w]
    system.free()


def test_a_step_is_asked_for(folder: Path) -> None:
    with pytest.raises(BadInput, match="no annotation baseStepSize"):
        load_ssp(nested(folder))


def test_an_archive_reads_nothing_outside(folder: Path) -> None:
    nested(folder)
    path = folder / "outside.ssp"
    with zipfile.ZipFile(path, "w") as files:
        files.writestr(ROOT, NESTED.replace('source="top.ssv"', 'source="../../../../etc/passwd"'))
        files.write(folder / "Gain.fmu", "Gain.fmu")
    with pytest.raises(BadInput, match=r"outside\.ssp: source: found .*allowed a file inside the archive"):
        load_ssp(path, step=0.5)


def test_an_archive_of_another_tool_is_kept(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "arms.ssp"
    with zipfile.ZipFile(target, "w") as other:
        other.writestr("SystemStructure.ssd", "<ssd:SystemStructureDescription/>")
    system = load_system(arms(folder))
    with pytest.raises(BadInput, match=r"found a \.ssp file that armrs did not write, allowed another name, or --force"):
        export_ssp(system, target)
    ours = export_ssp(system, target, replace=True).read_bytes()
    assert export_ssp(system, target, fmi=3).read_bytes() != ours
    system.free()


def test_a_system_is_not_written_over_itself(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = load_system(arms(folder))
    path = export_ssp(system, tmp_path / "arms.ssp")
    system.free()
    monkeypatch.chdir(tmp_path)
    before = path.read_bytes()
    assert cli.main(["fmu", "ssp", "arms.ssp", "--fmi", "3"]) == 2
    assert path.read_bytes() == before
