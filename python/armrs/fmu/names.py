"""Names that the standards fix: the functions of a library, the attributes of a description."""

from __future__ import annotations

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
"""Functions that a library must export, without the prefix `fmi2` or `fmi3`: 44 and 75."""

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
