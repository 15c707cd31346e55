/* Two instances, one after the other: 2 s in steps of 10 ms, pushed by a force that goes up and down along straight lines; then from
   the state at 1 s, which went through bytes, once more. Prints q[1] and q[2] after each. -DFMI=2 is through FMI 2.0, -DFMI=3 FMI 3.0.
   Arguments: library, token, resources (FMI 2.0: their URI), and the value references of q[1], q[2], handle.F[1], der(handle.F[1]). */
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
#define open_library(path) ((void *)LoadLibraryA(path))
#define find(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#define close_library(library) FreeLibrary((HMODULE)(library))
#else
#include <dlfcn.h>
#define open_library(path) dlopen(path, RTLD_NOW)
#define find(library, name) dlsym(library, name)
#define close_library(library) dlclose(library)
#endif
#define FUNCTION(name) name##TYPE *name##_ = (name##TYPE *)find(library, #name); if (!name##_) return 1;

static int refused;

#if FMI == 2
#include "fmi2Functions.h"
typedef fmi2Component Arm;
typedef fmi2FMUstate State;
typedef unsigned int Reference;
typedef char Byte;
#define Refused fmi2Error
#define GetState fmi2GetFMUstate_
#define SetState fmi2SetFMUstate_
#define FreeState fmi2FreeFMUstate_
#define StateSize fmi2SerializedFMUstateSize_
#define Serialize fmi2SerializeFMUstate_
#define Deserialize fmi2DeSerializeFMUstate_
#define Terminate fmi2Terminate_
#define Free fmi2FreeInstance_
#define Read(arm, references, n, values) fmi2GetReal_(arm, references, n, values)

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
    if (environment == (void *)&refused && status == fmi2Error) refused++;
}
static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, &refused};
#define Instantiate(token, resources) fmi2Instantiate_("arm", fmi2CoSimulation, token, resources, &callbacks, 0, 0)
#define Begin(arm) fmi2SetupExperiment_(arm, 0, 0.0, 0.0, 0, 0.0) || fmi2EnterInitializationMode_(arm) || fmi2ExitInitializationMode_(arm)
#define Push(arm, force, rate) fmi2SetReal_(arm, pushed, 1, &force) || fmi2SetRealInputDerivatives_(arm, pushed, 1, &first, &rate)
#define Step(arm, time) fmi2DoStep_(arm, time, 0.01, 1)
#define Whole(arm) fmi2GetInteger_(arm, seen, 1, &whole)
#else
#include "fmi3Functions.h"
typedef fmi3Instance Arm;
typedef fmi3FMUState State;
typedef fmi3ValueReference Reference;
typedef fmi3Byte Byte;
#define Refused fmi3Error
#define GetState fmi3GetFMUState_
#define SetState fmi3SetFMUState_
#define FreeState fmi3FreeFMUState_
#define StateSize fmi3SerializedFMUStateSize_
#define Serialize fmi3SerializeFMUState_
#define Deserialize fmi3DeserializeFMUState_
#define Terminate fmi3Terminate_
#define Free fmi3FreeInstance_
#define Read(arm, references, n, values) fmi3GetFloat64_(arm, references, n, values, n)

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text) {
    if (environment == (void *)&refused && status == fmi3Error) refused++;
}
#define Instantiate(token, resources) \
    fmi3InstantiateCoSimulation_("arm", token, resources, 0, 0, 0, 0, NULL, 0, &refused, log_message, NULL)
#define Begin(arm) fmi3EnterInitializationMode_(arm, 0, 0.0, 0.0, 0, 0.0) || fmi3ExitInitializationMode_(arm)
#define Push(arm, force, rate) fmi3SetFloat64_(arm, pushed, 1, &force, 1) || fmi3SetFloat64_(arm, pushed + 1, 1, &rate, 1)
#define Step(arm, time) fmi3DoStep_(arm, time, 0.01, 0, &event, &terminate, &early, &last)
#define Whole(arm) fmi3GetInt32_(arm, seen, 1, &whole, 1)
#endif

int main(int argc, char **argv) {
    if (argc != 8) return 1;
    void *library = open_library(argv[1]);
    if (!library) return 1;
#if FMI == 2
    FUNCTION(fmi2Instantiate) FUNCTION(fmi2SetupExperiment) FUNCTION(fmi2EnterInitializationMode) FUNCTION(fmi2ExitInitializationMode)
    FUNCTION(fmi2SetReal) FUNCTION(fmi2SetRealInputDerivatives) FUNCTION(fmi2DoStep) FUNCTION(fmi2GetReal) FUNCTION(fmi2GetInteger)
    FUNCTION(fmi2GetFMUstate) FUNCTION(fmi2SetFMUstate) FUNCTION(fmi2FreeFMUstate) FUNCTION(fmi2SerializedFMUstateSize)
    FUNCTION(fmi2SerializeFMUstate) FUNCTION(fmi2DeSerializeFMUstate) FUNCTION(fmi2Terminate) FUNCTION(fmi2FreeInstance)
    const fmi2Integer first = 1;
    fmi2Integer whole;
#else
    FUNCTION(fmi3InstantiateCoSimulation) FUNCTION(fmi3EnterInitializationMode) FUNCTION(fmi3ExitInitializationMode)
    FUNCTION(fmi3SetFloat64) FUNCTION(fmi3DoStep) FUNCTION(fmi3GetFloat64) FUNCTION(fmi3GetInt32) FUNCTION(fmi3GetFMUState)
    FUNCTION(fmi3SetFMUState) FUNCTION(fmi3FreeFMUState) FUNCTION(fmi3SerializedFMUStateSize) FUNCTION(fmi3SerializeFMUState)
    FUNCTION(fmi3DeserializeFMUState) FUNCTION(fmi3Terminate) FUNCTION(fmi3FreeInstance)
    fmi3Boolean event, terminate, early;
    fmi3Float64 last;
    fmi3Int32 whole;
#endif
    const Reference seen[] = {atoi(argv[4]), atoi(argv[5])}, pushed[] = {atoi(argv[6]), atoi(argv[7])};
    double q[2];
    for (int round = 0; round < 2; round++) {
        Arm arm = Instantiate(argv[2], argv[3]);
        if (!arm || Begin(arm)) return 2;
        State state = NULL, read = NULL;
        for (int from = 0; from <= 100; from += 100) {
            for (int k = from; k < 200; k++) {
                if (k == 100 && from == 0 && GetState(arm, &state)) return 3;
                const int place = k % 40;
                const double force = 0.0625 * (place < 20 ? place : 40 - place), rate = place < 20 ? 6.25 : -6.25;
                if (Push(arm, force, rate) || Step(arm, k * 0.01)) return 4;
            }
            if (Read(arm, seen, 2, q)) return 5;
            printf("%a %a\n", q[0], q[1]);
            if (from) break;

            size_t size;
            if (StateSize(arm, state, &size)) return 6;
            Byte *bytes = malloc(size);
            if (Serialize(arm, state, bytes, size) || Deserialize(arm, bytes, size, &read)) return 7;
            free(bytes);
            if (SetState(arm, read)) return 8;
        }
        FreeState(arm, &state);
        FreeState(arm, &read);
        if (Terminate(arm)) return 9;
        if (Whole(arm) != Refused) return 10;
        Free(arm);
    }
    if (Instantiate("wrong", argv[3])) return 11;
    close_library(library);
    return refused == 3 ? 0 : 12;
}
