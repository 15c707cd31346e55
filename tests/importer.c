/* Two instances, one after the other: 2 s in steps of 10 ms; then from the state at 1 s, which went through bytes, once more.
   Prints q[1] and q[2] after each. Arguments: library, instantiation token, folder of resources. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi3Functions.h"

#define FUNCTION(name) name##TYPE *name##_ = (name##TYPE *)dlsym(library, #name); if (!name##_) return 1;

static int refused;

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    if (environment == (void *)&refused && status == fmi3Error) refused++;
}

int main(int argc, char **argv) {
    if (argc != 4) return 1;
    void *library = dlopen(argv[1], RTLD_NOW);
    if (!library) return 1;
    FUNCTION(fmi3InstantiateCoSimulation) FUNCTION(fmi3EnterInitializationMode) FUNCTION(fmi3ExitInitializationMode)
    FUNCTION(fmi3DoStep) FUNCTION(fmi3GetFloat64) FUNCTION(fmi3GetInt32) FUNCTION(fmi3GetFMUState) FUNCTION(fmi3SetFMUState)
    FUNCTION(fmi3FreeFMUState) FUNCTION(fmi3SerializedFMUStateSize) FUNCTION(fmi3SerializeFMUState)
    FUNCTION(fmi3DeserializeFMUState) FUNCTION(fmi3Terminate) FUNCTION(fmi3FreeInstance)

    fmi3Boolean event, terminate, early;
    fmi3Float64 last, q[2];
    const fmi3ValueReference references[] = {5, 6};
    for (int round = 0; round < 2; round++) {
        fmi3Instance arm = fmi3InstantiateCoSimulation_("arm", argv[2], argv[3], 0, 0, 0, 0, NULL, 0, &refused, log_message, NULL);
        if (!arm || fmi3EnterInitializationMode_(arm, 0, 0.0, 0.0, 0, 0.0) || fmi3ExitInitializationMode_(arm)) return 2;
        fmi3FMUState state = NULL, read = NULL;
        for (int k = 0; k < 200; k++) {
            if (k == 100 && fmi3GetFMUState_(arm, &state)) return 3;
            if (fmi3DoStep_(arm, k * 0.01, 0.01, 0, &event, &terminate, &early, &last)) return 4;
        }
        if (fmi3GetFloat64_(arm, references, 2, q, 2)) return 5;
        printf("%a %a\n", q[0], q[1]);

        size_t size;
        if (fmi3SerializedFMUStateSize_(arm, state, &size)) return 6;
        fmi3Byte *bytes = malloc(size);
        if (fmi3SerializeFMUState_(arm, state, bytes, size) || fmi3DeserializeFMUState_(arm, bytes, size, &read)) return 7;
        free(bytes);
        if (fmi3SetFMUState_(arm, read)) return 8;
        for (int k = 100; k < 200; k++)
            if (fmi3DoStep_(arm, k * 0.01, 0.01, 0, &event, &terminate, &early, &last)) return 9;
        if (fmi3GetFloat64_(arm, references, 2, q, 2)) return 10;
        printf("%a %a\n", q[0], q[1]);

        fmi3FreeFMUState_(arm, &state);
        fmi3FreeFMUState_(arm, &read);
        if (fmi3Terminate_(arm)) return 12;
        fmi3Int32 whole;
        if (fmi3GetInt32_(arm, references, 1, &whole, 1) != fmi3Error) return 11;
        fmi3FreeInstance_(arm);
    }
    if (fmi3InstantiateCoSimulation_("arm", "wrong", argv[3], 0, 0, 0, 0, NULL, 0, &refused, log_message, NULL)) return 13;
    dlclose(library);
    return refused == 3 ? 0 : 14;
}
