"""Names defined by the standards: functions of a library, attributes of a description."""

from __future__ import annotations

from collections.abc import Iterable

_FUNCTIONS_2 = """
    GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode
    ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean GetString SetReal SetInteger SetBoolean SetString
    GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative
    EnterEventMode NewDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates GetDerivatives
    GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates SetRealInputDerivatives GetRealOutputDerivatives DoStep
    CancelStep GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus GetStringStatus
"""

_FUNCTIONS_3 = """
    GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation InstantiateScheduledExecution FreeInstance
    EnterInitializationMode ExitInitializationMode EnterEventMode Terminate Reset GetFloat32 GetFloat64 GetInt8 GetUInt8 GetInt16
    GetUInt16 GetInt32 GetUInt32 GetInt64 GetUInt64 GetBoolean GetString GetBinary GetClock SetFloat32 SetFloat64 SetInt8 SetUInt8
    SetInt16 SetUInt16 SetInt32 SetUInt32 SetInt64 SetUInt64 SetBoolean SetString SetBinary SetClock
    GetNumberOfVariableDependencies GetVariableDependencies GetFMUState SetFMUState FreeFMUState SerializedFMUStateSize
    SerializeFMUState DeserializeFMUState GetDirectionalDerivative GetAdjointDerivative EnterConfigurationMode
    ExitConfigurationMode GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction SetIntervalDecimal
    SetIntervalFraction SetShiftDecimal SetShiftFraction EvaluateDiscreteStates UpdateDiscreteStates EnterContinuousTimeMode
    CompletedIntegratorStep SetTime SetContinuousStates GetContinuousStateDerivatives GetEventIndicators GetContinuousStates
    GetNominalsOfContinuousStates GetNumberOfEventIndicators GetNumberOfContinuousStates EnterStepMode GetOutputDerivatives DoStep
    ActivateModelPartition
"""

FUNCTIONS = {2: tuple(_FUNCTIONS_2.split()), 3: tuple(_FUNCTIONS_3.split())}
"""Functions of the standards, without the prefix `fmi2` or `fmi3`: 44 and 75."""

_EXCHANGE_2 = """
    EnterEventMode NewDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates GetDerivatives
    GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates
"""
_SIMULATION_2 = """
    SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus
    GetStringStatus
"""


def functions(fmi: int, interfaces: Iterable[str]) -> tuple[str, ...]:
    """Return the functions that a library must export: all of FMI 3.0; of FMI 2.0 those of the interfaces that it offers (section 2.3)."""
    offered = set(interfaces)
    needless: set[str] = set()
    if fmi == 2:
        needless |= set() if "ModelExchange" in offered else set(_EXCHANGE_2.split())
        needless |= set() if "CoSimulation" in offered else set(_SIMULATION_2.split())
    return tuple(name for name in FUNCTIONS[fmi] if name not in needless)


_BOTH = """
    modelIdentifier needsExecutionTool canBeInstantiatedOnlyOncePerProcess canHandleVariableCommunicationStepSize
    maxOutputDerivativeOrder
"""
CO_SIMULATION = {
    2: frozenset(
        f"{_BOTH} canInterpolateInputs canRunAsynchronuously canNotUseMemoryManagementFunctions canGetAndSetFMUstate "
        "canSerializeFMUstate providesDirectionalDerivative".split()
    ),
    3: frozenset(
        f"{_BOTH} canGetAndSetFMUState canSerializeFMUState providesDirectionalDerivatives providesAdjointDerivatives "
        "providesPerElementDependencies fixedInternalStepSize recommendedIntermediateInputSmoothness providesIntermediateUpdate "
        "mightReturnEarlyFromDoStep canReturnEarlyAfterIntermediateUpdate hasEventMode providesEvaluateDiscreteStates".split()
    ),
}
"""Attributes of the element CoSimulation."""
_EXCHANGE_ATTRIBUTES = {
    2: """
        modelIdentifier needsExecutionTool completedIntegratorStepNotNeeded canBeInstantiatedOnlyOncePerProcess
        canNotUseMemoryManagementFunctions canGetAndSetFMUstate canSerializeFMUstate providesDirectionalDerivative
    """,
    3: """
        modelIdentifier needsExecutionTool canBeInstantiatedOnlyOncePerProcess canGetAndSetFMUState canSerializeFMUState
        providesDirectionalDerivatives providesAdjointDerivatives providesPerElementDependencies needsCompletedIntegratorStep
        providesEvaluateDiscreteStates
    """,
}
MODEL_EXCHANGE = {fmi: frozenset(text.split()) for fmi, text in _EXCHANGE_ATTRIBUTES.items()}
"""Attributes of the element ModelExchange."""

_VARIABLE = "name valueReference description causality variability canHandleMultipleSetPerTimeInstant"
_REAL = "declaredType quantity unit displayUnit relativeQuantity unbounded min max nominal start derivative reinit"
VARIABLE = {
    2: frozenset(f"{_VARIABLE} initial {_REAL}".split()),
    3: frozenset(
        f"{_VARIABLE} initial {_REAL} intermediateUpdate previous clocks mimeType maxSize canBeDeactivated priority "
        "intervalVariability intervalDecimal shiftDecimal supportsFraction resolution intervalCounter shiftCounter".split()
    ),
}
"""Attributes of a variable."""

VARIABILITIES = {
    "parameter": ("fixed", "tunable"),
    "structuralParameter": ("fixed", "tunable"),
    "calculatedParameter": ("fixed", "tunable"),
    "input": ("discrete", "continuous"),
    "output": ("constant", "discrete", "continuous"),
    "local": ("constant", "fixed", "tunable", "discrete", "continuous"),
    "independent": ("continuous",),
}
"""Variabilities that each causality allows."""


def initials(fmi: int, causality: str, variability: str) -> tuple[str, ...]:
    """Return the values of `initial` that are allowed, the default first (FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.5)."""
    if causality in ("parameter", "structuralParameter") or variability == "constant":
        return ("exact",)
    if causality == "input":
        return ("exact",) if fmi == 3 else ()
    if causality == "independent":
        return ()
    if causality == "calculatedParameter" or variability in ("fixed", "tunable"):
        return ("calculated", "approx")
    return ("calculated", "exact", "approx")
