"""Defective FMUs: edits of a good description, and a small library in C that breaks one promise at a time."""

from __future__ import annotations

import re
import subprocess
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from armrs.fmu import standard_names
from armrs.fmu.shared_library import platform_folder

Change = Callable[[str], str]
SOURCE = Path(__file__).parent / "defective.c"

SMALL = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="small" instantiationToken="{small}" variableNamingConvention="structured">
  <ModelExchange modelIdentifier="small"/>
  <CoSimulation modelIdentifier="small" canGetAndSetFMUState="true" canSerializeFMUState="true" providesDirectionalDerivatives="true"
    canHandleVariableCommunicationStepSize="true" maxOutputDerivativeOrder="1" hasEventMode="true" providesIntermediateUpdate="true"
    canReturnEarlyAfterIntermediateUpdate="true" providesAdjointDerivatives="true"/>
  <ScheduledExecution modelIdentifier="small"/>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="x" valueReference="1" causality="input" variability="continuous" intermediateUpdate="true" start="0"/>
    <Float64 name="k" valueReference="2" causality="parameter" variability="tunable" initial="exact" start="2"/>
    <Float64 name="s" valueReference="3" causality="output" variability="continuous" initial="exact" intermediateUpdate="true" start="1"/>
    <Float64 name="z" valueReference="4" causality="output" variability="continuous" initial="calculated"/>
    <Int32 name="n" valueReference="5" causality="input" variability="discrete" start="3"/>
    <Boolean name="b" valueReference="6" causality="input" variability="discrete" start="true"/>
    <String name="label" valueReference="7" causality="parameter" variability="tunable" initial="exact"><Start value="text"/></String>
    <Float64 name="der(s)" valueReference="8" causality="local" variability="continuous" initial="calculated" derivative="3"/>
    <UInt64 name="size" valueReference="9" causality="structuralParameter" variability="fixed" start="3"/>
    <Binary name="blob" valueReference="10" causality="input" variability="discrete"><Start value="C000FE"/></Binary>
    <Clock name="tick" valueReference="11" causality="input" intervalVariability="constant" intervalDecimal="0.01" priority="1"/>
    <Clock name="go" valueReference="12" causality="input" intervalVariability="triggered" priority="2"/>
    <Clock name="later" valueReference="13" causality="input" intervalVariability="countdown" priority="3"/>
    <Clock name="rang" valueReference="14" causality="output" intervalVariability="triggered" clocks="11"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="3" dependencies="3"/>
    <Output valueReference="4" dependencies="1" dependenciesKind="dependent"/>
    <Output valueReference="14" dependencies="11"/>
    <ContinuousStateDerivative valueReference="8" dependencies="1"/>
    <InitialUnknown valueReference="4" dependencies="1 2"/>
    <InitialUnknown valueReference="8" dependencies="1"/>
  </ModelStructure>
</fmiModelDescription>
"""

LIBRARY = {
    "VERSION": "library, GetVersion",
    "CRASH_AT_START": "is killed by signal",
    "CRASH_AT_END": "is killed by signal",
    "SECOND_REFUSED": "a second instance is refused",
    "SHARED": "after a step of a second instance",
    "TOKEN_REFUSED": "refused with the instantiationToken",
    "INITIALIZATION_FAILS": "EnterInitializationMode",
    "EVENT_MODE_REFUSED": "hasEventMode",
    "STEP_MODE_REFUSED": "EnterStepMode",
    "EVENTS_NEVER_END": "need more than",
    "CONFIGURATION_REFUSED": "EnterConfigurationMode",
    "STRUCTURE_REFUSED": "variable size: its own start value cannot be set in configuration mode",
    "BINARY_START": "variable blob: start is c000fe in the description and c000 in the library",
    "BINARY_REFUSED": "SetBinary",
    "ADJOINT_REFUSED": "GetAdjointDerivative",
    "ADJOINT_WRONG": "the derivative of z with respect to x is 3, GetDirectionalDerivative gives 2",
    "UPDATE_REFUSED": "providesIntermediateUpdate",
    "UPDATE_BEYOND": "the callback is called for 0.02 s in the step from 0 s to 0.01 s",
    "UPDATE_BACK": "the callback is called for 0.0025 s after the steps up to 0.005 s were finished",
    "UPDATE_UNREADABLE": "s cannot be read in an intermediate update that allows it",
    "UPDATE_UNSETTABLE": "x cannot be set in an intermediate update that allows it",
    "UPDATE_CHANGES": "with intermediate updates",
    "EARLY_OFFERED": "it offers early return, which was not allowed",
    "EARLY_REFUSED": "an instance with early returns is refused",
    "EARLY_IGNORED": "it offered early return but did not return early when requested at 0.005 s",
    "EARLY_AT_START": "it returns early from the step from 0 s to 0.01 s with lastSuccessfulTime 0 s",
    "EXCHANGE_REFUSED": "Model Exchange is refused",
    "STATES_MISCOUNTED": "GetNumberOfContinuousStates",
    "RATES_REFUSED": "GetContinuousStateDerivatives",
    "NOMINAL_ZERO": "GetNominalsOfContinuousStates",
    "CLOCK_REFUSED": "SetClock",
    "CLOCK_UNREADABLE": "GetClock",
    "INTERVAL_REFUSED": "GetIntervalDecimal",
    "INTERVAL_NEGATIVE": "clock later: its interval is -1 s in the initialization",
    "QUALIFIER_STRANGE": "clock later: its interval has the qualifier 7",
    "SCHEDULED_REFUSED": "scheduled execution is refused",
    "PARTITION_REFUSED": "clock go: its partition cannot be activated at 0 s",
    "PARTITION_ABORTS": "is killed by signal 6 (SIGABRT) while activating the partitions",
    "PREEMPTION_LOCKED": "clock tick: its partition returns with 1 more preemption locks than unlocks",
    "CLOCK_UPDATE_FAILS": "a clock update fails: GetIntervalDecimal",
    "TERMINATE_FAILS": "Terminate",
    "RESET_FAILS": "Reset",
    "RESET_KEEPS": "Reset",
    "UNREADABLE": "cannot be read",
    "NOT_FINITE": "is nan after a step",
    "INPUT_REFUSED": "cannot be set between steps",
    "PARAMETER_REFUSED": "cannot be set before the initialization",
    "TUNABLE_REFUSED": "cannot be set between steps",
    "INT_REFUSED": "variable n",
    "BOOLEAN_REFUSED": "variable b",
    "STRING_REFUSED": "variable label",
    "FLOAT_START": "variable k",
    "INT_START": "variable n",
    "BOOLEAN_START": "variable b",
    "STRING_START": "variable label",
    "ABORTS": "is killed by signal",
    "EXITS": "ends the process with status 0",
    "FORGES": "ends the process with status 0",
    "HANGS": "does not return within",
    "FLOODS": "prints more than",
    "EATS": "is killed by signal",
    "STEP_FAILS": "do_step",
    "STEP_DISCARDED": "is discarded",
    "STRANGE_STATUS": "do_step",
    "ONE_STEP_SIZE": "do_step",
    "WRONG_LAST_TIME": "lastSuccessfulTime",
    "EARLY": "returns early",
    "RANDOM": "from the restored state",
    "STATE_REFUSED": "GetFMUState",
    "STATE_IGNORED": "from the restored state",
    "STATE_WITHOUT_S": "from the restored state",
    "STATE_WITHOUT_INPUT": "from the restored state",
    "NO_BYTES": "the serialized state is empty",
    "SERIALIZE_FAILS": "SerializeFMUState",
    "BYTES_WRONG": "from the deserialized state",
    "DERIVATIVE_REFUSED": "GetDirectionalDerivative",
    "DERIVATIVE_WRONG": "finite differences give",
    "OUTPUT_DERIVATIVES_REFUSED": "GetOutputDerivatives",
}
"""What the library in C does wrong, and words of the finding that names it."""


def edit(old: str, new: str) -> Change:
    """Replace the first match of a pattern, which must be there."""

    def change(text: str) -> str:
        edited, count = re.subn(old, new, text, count=1)
        assert count == 1, old
        return edited

    return change


def swap(first: str, second: str) -> Change:
    """Swap two elements that are at the top of a description."""

    def change(text: str) -> str:
        one = re.search(rf"  <{first}>.*?</{first}>\n", text, flags=re.S)
        other = re.search(rf"  <{second}>.*?</{second}>\n", text, flags=re.S)
        assert one is not None
        assert other is not None
        return text.replace(one[0], "@").replace(other[0], one[0]).replace("@", other[0])

    return change


BOTH: dict[str, tuple[Change, str]] = {
    "no model name": (edit(r' modelName="[^"]*"', ""), "modelName"),
    "no token": (edit(r' (?:instantiationToken|guid)="[^"]*"', ""), "required but missing"),
    "unknown element at the top": (edit(r"  <UnitDefinitions>", "  <Units/>\n  <UnitDefinitions>"), "Units"),
    "unknown element among the variables": (edit(r"  <ModelVariables>\n", "  <ModelVariables>\n    <Complex/>\n"), "Complex"),
    "elements in another order": (swap("UnitDefinitions", "ModelVariables"), "not expected"),
    "no ModelVariables": (edit(r"(?s)  <ModelVariables>.*</ModelVariables>\n", ""), "ModelVariables"),
    "no ModelStructure": (edit(r"(?s)  <ModelStructure>.*</ModelStructure>\n", ""), "ModelStructure"),
    "identifier with a path": (edit(r'modelIdentifier="ArmRs"', 'modelIdentifier="../../lib/ArmRs"'), "allowed is a C identifier"),
    "identifier with a space": (edit(r'modelIdentifier="ArmRs"', 'modelIdentifier="Arm Rs"'), "allowed is a C identifier"),
    "capability that is no truth value": (edit(r'(canGetAndSetFMU[sS]tate=)"true"', r'\1"yes"'), "yes"),
    "typing error in a capability": (edit("canHandleVariableCommunicationStepSize", "canHandleVariableStepSize"), "nearest known"),
    "derivative order that is no number": (edit('(maxOutputDerivativeOrder=)"1"', r'\1"one"'), "one"),
    "serialization without states": (edit(r'(<CoSimulation[^>]*) canGetAndSetFMU[sS]tate="true"', r"\1"), "without canGetAndSetFMU"),
    "stop before the start": (edit('stopTime="2.0"', 'stopTime="-2.0"'), "before the start"),
    "step size of zero": (edit('stepSize="0.001"', 'stepSize="0.0"'), "stepSize"),
    "start time that is no number": (edit('startTime="0.0"', 'startTime="now"'), "startTime"),
    "value reference that is no whole number": (edit('valueReference="3"', 'valueReference="3.7"'), "3.7"),
    "value reference that is negative": (edit('valueReference="3"', 'valueReference="-1"'), "-1"),
    "value reference beyond all": (edit('valueReference="3"', 'valueReference="1e300"'), "1e300"),
    "value reference that is missing": (edit(' valueReference="3"', ""), "valueReference"),
    "variable without a name": (edit(' name="gravity"', ""), "name"),
    "two variables of one name": (edit(r'name="tau\[2\]"', 'name="tau[1]"'), "2 variables have this name"),
    "name that is not structured": (edit('name="gravity"', 'name="gravity!"'), "not a structured name"),
    "quoted name with a letter beyond ASCII": (edit('name="gravity"', "name=\"'größe'.g\""), "ASCII letters, digits and punctuation"),
    "unknown causality": (edit('causality="input"', 'causality="inputs"'), "inputs"),
    "unknown variability": (edit('variability="continuous"', 'variability="smooth"'), "smooth"),
    "unknown initial": (edit('initial="exact"', 'initial="exactly"'), "exactly"),
    "parameter that is continuous": (edit('(name="gravity".*?variability=)"fixed"', r'\1"continuous"'), "with variability continuous"),
    "parameter that is calculated": (edit('(name="gravity".*?initial=)"exact"', r'\1"calculated"'), "initial calculated"),
    "input that is fixed": (edit(r'(name="tau\[1\]".*?variability=)"continuous"', r'\1"fixed"'), "with variability fixed"),
    "start that is no number": (edit(r'(name="gravity"(?s:.*?)start=)"9.81"', r'\1"g"'), "g"),
    "start missing": (edit(r'(name="gravity"(?s:.*?)) start="9.81"', r"\1"), "no start value"),
    "start below min": (edit(r'(name="body\[1\].m"(?s:.*?)min=)"[^"]*"', r'\1"100.0"'), "start is"),
    "max below min": (edit(r'(name="body\[1\].m"(?s:.*?)min="[^"]*")', r'\1 max="-1.0"'), "max is -1"),
    "attribute that is not known": (edit(r'(name="body\[1\].m"(?s:.*?))min=', r"\1mim="), "mim"),
    "unit that is not defined": (edit(r'(name="gravity"(?s:.*?)unit=)"m/s2"', r'\1"m/s^2"'), "is not defined"),
    "unit that is defined twice": (edit('<Unit name="m/s2">', '<Unit name="m">'), "unit m: defined more than once"),
    "exponent that is no number": (edit('<BaseUnit s="1"/>', '<BaseUnit s="one"/>'), "one"),
    "exponent that is broken": (edit('<BaseUnit s="1"/>', '<BaseUnit s="0.5"/>'), "0.5"),
    "factor of zero": (edit('<BaseUnit kg="1"/>', '<BaseUnit kg="1" factor="0"/>'), "allowed a finite number other than 0"),
    "exponents of another unit": (edit('<BaseUnit m="1" s="-1"/>', '<BaseUnit m="1" s="-2"/>'), "unit m/s:"),
    "display unit that is not defined": (edit('displayUnit="deg"', 'displayUnit="grad"'), "'grad' is not defined"),
    "type that is not defined": (edit(r'(name="gravity"(?s:.*?)unit="m/s2")', r'\1 declaredType="Gravity"'), "'Gravity' is not defined"),
    "derivative of no variable": (edit(r' derivative="\d+"', ' derivative="9999"'), "9999"),
    "derivative not said": (edit(r' derivative="\d+"', ""), "has no attribute derivative"),
    "output not listed": (edit(r"(?s)(<ModelStructure>(?:\s*<Outputs>)?)\s*<(?:Output|Unknown) [^>]*/>\n", r"\1"), "is not listed"),
    "unknown encoding": (edit('encoding="UTF-8"', 'encoding="UTF-1"'), "unknown encoding"),
    "document type": (edit("<fmiModelDescription", '<!DOCTYPE x [<!ENTITY a "a">]>\n<fmiModelDescription'), "a document type"),
    "XML that does not end": (edit("</fmiModelDescription>", ""), "XML"),
    "version that is unknown": (edit('fmiVersion="[23].0"', 'fmiVersion="4.0"'), "4.0"),
    "license twice": (edit('license="MIT OR Apache-2.0"', 'license="MIT" license="MIT"'), "XML"),
}
"""Edits of a description of either version, and words of the finding that names them."""

THREE: dict[str, tuple[Change, str]] = {
    "negative internal step": (edit('fixedInternalStepSize="', 'fixedInternalStepSize="-'), "fixedInternalStepSize"),
    "no independent variable": (edit(r"    <Float64 name=\"time\".*?/>\n", ""), "0 independent variables"),
    "time with a start": (edit('name="time"', 'name="time" start="0.0"'), "start is 0.0"),
    "start of what is calculated": (edit(r'(name="handle.r\[1\]")', r'\1 start="0.1"'), "allowed is none"),
    "input without start": (edit(r'(name="tau\[1\]".*?) start="0.0"', r"\1"), "no start value, which causality input"),
    "one value reference twice": (edit('valueReference="2"', 'valueReference="1"'), "share the value reference 1"),
    "type that is unknown": (edit('<Float64 name="gravity"', '<Double name="gravity"'), "Double"),
    "continuous whole number": (edit(r'<Float64 name="tau\[1\]"', '<Int32 name="tau[1]"'), "Int32"),
    "parameter as output": (edit(r'(    <Output valueReference=)"\d+"', r'\1"30"'), "is listed as output but is not one"),
    "output of no variable": (edit(r'(    <Output valueReference=)"\d+"', r'\1"9999"'), "an Output that is not a variable"),
    "output listed twice": (edit(r"(    <Output [^>]*/>\n)", r"\1\1"), "is listed 2 times"),
    "initial unknown missing": (edit(r"    <InitialUnknown [^>]*/>\n", ""), "not listed as InitialUnknown"),
    "initial unknown that is known": (edit(r'(    <InitialUnknown valueReference=)"\d+"', r'\1"5"'), "is not calculated at initialization"),
    "dependency on no variable": (
        edit(r'(<Output valueReference="\d+" dependencies=)"[^"]*"', r'\1"9999"'),
        "it depends on something that is not a variable",
    ),
    "dependency that is no number": (edit(r'(<Output valueReference="\d+" dependencies=)"[^"]*"', r'\1"q"'), "q"),
    "dependency listed twice": (edit(r'(<Output valueReference="\d+" dependencies=)"[^"]*"', r'\1"1 1"'), "a dependency is listed twice"),
    "kinds without dependencies": (
        edit(r'(<Output valueReference="\d+") dependencies="[^"]*"', r'\1 dependenciesKind="constant"'),
        "dependenciesKind without dependencies",
    ),
    "fewer kinds than dependencies": (
        edit(r'(<Output valueReference="\d+") dependencies="[^"]*"', r'\1 dependencies="1 2" dependenciesKind="constant"'),
        "2 dependencies and 1 dependenciesKind",
    ),
    "unknown kind of dependency": (
        edit(r'(<Output valueReference="\d+") dependencies="[^"]*"', r'\1 dependencies="1" dependenciesKind="linear"'),
        "linear",
    ),
    "clocks that are numbers": (edit('name="gravity"', 'name="gravity" clocks="x"'), "clocks"),
    "structural parameter that is continuous": (
        edit(r'(name="gravity".*?causality=)"parameter"', r'\1"structuralParameter" start="x"'),
        "XML",
    ),
    "dimension without a length": (edit(r'(<Float64 name="gravity".*?)/>', r"\1><Dimension/></Float64>"), "Dimension"),
}

TWO: dict[str, tuple[Change, str]] = {
    "index of an output beyond all": (edit(r'(<Outputs>\s*<Unknown index=)"\d+"', r'\1"9999"'), "an Output that is not a variable"),
    "index of an output that is zero": (edit(r'(<Outputs>\s*<Unknown index=)"\d+"', r'\1"0"'), "an Output that is not a variable"),
    "input as output": (edit(r'(<Outputs>\s*<Unknown index=)"\d+"', r'\1"1"'), "is listed as output but is not one"),
    "no InitialUnknowns": (edit(r"(?s)    <InitialUnknowns>.*</InitialUnknowns>\n", ""), "not listed as InitialUnknown"),
    "empty InitialUnknowns": (edit(r"(?s)<InitialUnknowns>.*</InitialUnknowns>", "<InitialUnknowns></InitialUnknowns>"), "InitialUnknown"),
    "initial of an input": (
        edit(r'(name="tau\[1\]".*?variability="continuous")', r'\1 initial="exact"'),
        "initial exact with causality input",
    ),
    "variable without a type": (edit(r'(<ScalarVariable name="gravity"[^>]*>)\s*<Real[^>]*/>', r"\1"), "Missing child element"),
    "variable of two types": (edit(r'(<ScalarVariable name="gravity"[^>]*>\s*<Real[^>]*/>)', r"\1<Integer/>"), "Integer"),
    "continuous whole number": (
        edit(r'(name="tau\[1\]"[^>]*>\s*)<Real[^>]*/>', r'\1<Integer start="0"/>'),
        "variability continuous for type",
    ),
    "alias with two starts": (edit('valueReference="2"', 'valueReference="1"'), "share the value reference 1"),
    "output without its derivative's index": (
        edit(r"<Derivatives>\s*<Unknown index=\"\d+\"", '<Derivatives><Unknown index="1"'),
        "has no attribute derivative",
    ),
    "structural parameter in FMI 2": (edit('(name="gravity".*?causality=)"parameter"', r'\1"structuralParameter"'), "structuralParameter"),
    "start of what is calculated": (edit(r'(name="handle.r\[1\]"(?s:.*?)<Real )', r'\1start="0.1" '), "allowed is none"),
}


CLOCKS: dict[str, tuple[Change, str]] = {
    "clock without a kind": (edit(' intervalVariability="constant"', ""), "intervalVariability"),
    "clock of an unknown kind": (edit('"countdown"', '"sometimes"'), "sometimes"),
    "constant clock without an interval": (edit(' intervalDecimal="0.01"', ""), "clock tick: no interval"),
    "interval of zero": (edit('intervalDecimal="0.01"', 'intervalDecimal="0"'), "clock tick: interval 0 s"),
    "shift below zero": (edit('intervalDecimal="0.01"', 'intervalDecimal="0.01" shiftDecimal="-1"'), "clock tick: shift -1 s"),
    "no priority in scheduled execution": (edit(' priority="2"', ""), "clock go: no priority"),
    "priority of an output": (edit('name="rang"', 'name="rang" priority="4"'), "clock rang: priority 4 of an output clock"),
    "output that ticks by time": (
        edit('(name="rang".*?intervalVariability=)"triggered"', r'\1"countdown"'),
        "causality output of a time-based clock",
    ),
    "clocked by what is no clock": (edit('clocks="11"', 'clocks="3"'), "variable rang: clocks refers to 3"),
}
"""Edits of the small FMU's description, which has clocks."""


@cache
def stubs() -> str:
    """Return C for the functions of FMI 3.0 that the small library does not have: each says that it failed."""
    text = SOURCE.read_text(encoding="utf-8")
    missing = [f"fmi3{name}" for name in standard_names.FUNCTIONS[3] if f" fmi3{name}(" not in text and f"*fmi3{name}(" not in text]
    return "".join(f"int {name}(void) {{ return 3; }}\n" for name in missing)


@cache
def library(defect: str, *others: str) -> bytes:
    """Compile the small library with one thing that it does wrong, and other C behind it, as one source: a start costs more than its text."""
    with TemporaryDirectory() as folder:
        built = Path(folder) / "small"
        command = ["cc", "-shared", "-fPIC", "-w", *([f"-D{defect}"] if defect else []), "-o", str(built), "-x", "c", "-", "-lm"]
        source = "\n".join((SOURCE.read_text(encoding="utf-8"), stubs(), *others))
        subprocess.run(command, input=source.encode(), check=True, capture_output=True)
        return built.read_bytes()


def small(folder: Path, defect: str = "", description: str = SMALL) -> Path:
    """Write the small FMU with one thing that it does wrong."""
    return packed(folder / f"small{defect}.fmu", description, small=library(defect))


def packed(path: Path, description: str, **libraries: bytes) -> Path:
    """Write an FMU of libraries by their names."""
    place, suffix = platform_folder(3)
    with zipfile.ZipFile(path, "w") as files:
        files.writestr("modelDescription.xml", description)
        for name, content in libraries.items():
            files.writestr(f"binaries/{place}/{name}{suffix}", content)
    return path


def edited(source: Path, target: Path, change: Change) -> Path:
    """Write an FMU with another description and without its library, which is not tried."""
    with zipfile.ZipFile(source) as good, zipfile.ZipFile(target, "w") as packed:
        for name in good.namelist():
            data = good.read(name)
            packed.writestr(name, change(data.decode()).encode() if name == "modelDescription.xml" else data)
    return target
