/* A small FMU of FMI 3.0 that does what its description promises, unless a macro breaks one promise. It integrates its input.
   Variables: 0 time, 1 x (input), 2 k (tunable parameter), 3 s (output, state), 4 z = k x (output), 5 n (Int32), 6 b (Boolean),
   7 label (String), 8 der(s), 9 size (UInt64, structural parameter), 10 blob (Binary); clocks: 11 tick (constant), 12 go (triggered), 13 later (countdown), 14 rang (output). The functions that it does not have are added as stubs by the test. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef uint32_t VR;
typedef void (*Update)(void *, double, bool, bool, bool, bool, bool *, double *);
typedef struct { double t, x, k, s; int32_t n; bool b, stepping, early, inside; int instances; double first; Update update;
    void (*news)(void *), (*lock)(void), (*unlock)(void); } Model;
static int alive;
#ifdef SHARED
static Model shared;
#endif

static void start(Model *m) {
    m->t = 0; m->x = 0; m->k = 2; m->n = 3; m->b = true; m->stepping = false; m->first = 0;
#ifndef RESET_KEEPS
    m->s = 1;
#endif
#ifdef INT_START
    m->n = 4;
#endif
#ifdef BOOLEAN_START
    m->b = false;
#endif
#ifdef FLOAT_START
    m->k = 2.5;
#endif
}

const char *fmi3GetVersion(void) {
#ifdef VERSION
    return "2.0";
#endif
    return "3.0";
}

static Model *make(void) {
#ifdef CRASH_AT_START
    abort();
#endif
#ifdef SECOND_REFUSED
    if (alive) return NULL;
#endif
#ifdef ONLY_ONCE
    static int made;
    if (made++) return NULL;
#endif
    alive++;
#ifdef SHARED
    Model *m = &shared;
#else
    Model *m = calloc(1, sizeof *m);
#endif
    m->s = 1;
    start(m);
    return m;
}

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path, bool visible, bool logging, bool events,
                                  bool early, const VR *required, size_t n, void *environment, void *log, Update update) {
#ifdef EVENT_MODE_REFUSED
    if (events) return NULL;
#endif
#ifdef EVENT_MODE_ASKED
    if (!events) return NULL;
#endif
#ifdef UPDATE_REFUSED
    if (update) return NULL;
#endif
#ifdef EARLY_REFUSED
    if (early) return NULL;
#endif
#ifdef TOKEN_REFUSED
    return NULL;
#endif
    Model *m = make();
    if (m) { m->update = update; m->early = early; }
    return m;
}
void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *path, bool visible, bool logging, void *e, void *log) {
#ifdef EXCHANGE_REFUSED
    return NULL;
#endif
    return make();
}
void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *path, bool visible, bool logging, void *e,
                                        void *log, void (*news)(void *), void (*lock)(void), void (*unlock)(void)) {
#ifdef SCHEDULED_REFUSED
    return NULL;
#endif
    Model *m = make();
    if (m) { m->news = news; m->lock = lock; m->unlock = unlock; }
    return m;
}
int fmi3ActivateModelPartition(void *v, VR clock, double t) {
    Model *m = v;
#ifdef PARTITION_REFUSED
    if (clock == 12) return 3;
#endif
#ifdef PARTITION_ABORTS
    abort();
#endif
    m->lock();
    m->s += 1;
#ifdef PREEMPTION_LOCKED
    if (clock != 11)
#endif
    m->unlock();
    if (clock == 11) { m->inside = true; m->news(NULL); m->inside = false; }
    return clock >= 11 && clock <= 13 ? 0 : 3;
}
int fmi3GetIntervalDecimal(void *v, const VR *r, size_t n, double *out, int *qualifiers) {
    bool news = ((Model *)v)->inside;
    if (n != 1 || r[0] != 13) return 3;
#ifdef INTERVAL_REFUSED
    return 3;
#endif
#ifdef CLOCK_UPDATE_FAILS
    if (news) return 3;
#endif
    out[0] = 0.005;
    qualifiers[0] = news ? 2 : 0;
#ifdef INTERVAL_NEGATIVE
    out[0] = -1; qualifiers[0] = 2;
#endif
#ifdef QUALIFIER_STRANGE
    qualifiers[0] = 7;
#endif
    return 0;
}
int fmi3SetClock(void *v, const VR *r, size_t n, const bool *in) {
#ifdef CLOCK_REFUSED
    return 3;
#endif
    return r[0] == 11 || r[0] == 12 ? 0 : 3;
}
int fmi3GetClock(void *v, const VR *r, size_t n, bool *out) {
#ifdef CLOCK_UNREADABLE
    return 3;
#endif
    out[0] = true;
    return r[0] == 14 ? 0 : 3;
}
void fmi3FreeInstance(void *v) {
    alive--;
#ifdef CRASH_AT_END
    *(volatile int *)0 = 1;
#endif
#ifndef SHARED
    free(v);
#endif
}
int fmi3EnterInitializationMode(void *v, bool d, double tol, double t, bool sd, double stop) {
#ifdef INITIALIZATION_FAILS
    return 3;
#endif
    ((Model *)v)->t = t; return 0;
}
int fmi3ExitInitializationMode(void *v) { ((Model *)v)->stepping = true; return 0; }
int fmi3Terminate(void *v) {
#ifdef TERMINATE_FAILS
    return 3;
#endif
    return 0;
}
int fmi3Reset(void *v) {
#ifdef RESET_FAILS
    return 3;
#endif
    start(v); return 0;
}
int fmi3GetFloat64(void *v, const VR *r, size_t n, double *out, size_t m) {
    Model *a = v;
    for (size_t i = 0; i < n; i++) {
        double z = a->k * a->x, all[] = {a->t, a->x, a->k, a->s, z, 0, 0, 0, a->x};
#ifdef UPDATE_UNREADABLE
        if (a->inside) return 3;
#endif
#ifdef UNREADABLE
        if (r[i] == 4) return 3;
#endif
        out[i] = r[i] < 9 ? all[r[i]] : 0;
#ifdef NOT_FINITE
        if (r[i] == 3 && a->t > 0) out[i] = NAN;
#endif
    }
    return 0;
}
int fmi3SetFloat64(void *v, const VR *r, size_t n, const double *in, size_t m) {
    Model *a = v;
    for (size_t i = 0; i < n; i++) {
        if (r[i] == 1) {
#ifdef UPDATE_UNSETTABLE
            if (a->inside) return 3;
#endif
#ifdef INPUT_REFUSED
            if (a->stepping) return 3;
#endif
            a->x = in[i];
        } else if (r[i] == 2) {
#ifdef TUNABLE_REFUSED
            if (a->stepping) return 3;
#endif
#ifdef PARAMETER_REFUSED
            return 3;
#endif
            a->k = in[i];
        } else return 3;
    }
    return 0;
}
int fmi3GetInt32(void *v, const VR *r, size_t n, int32_t *out, size_t m) { for (size_t i = 0; i < n; i++) out[i] = ((Model *)v)->n; return 0; }
int fmi3SetInt32(void *v, const VR *r, size_t n, const int32_t *in, size_t m) {
#ifdef INT_REFUSED
    return 3;
#endif
    if (n) ((Model *)v)->n = in[0];
    return 0;
}
int fmi3GetBoolean(void *v, const VR *r, size_t n, bool *out, size_t m) { for (size_t i = 0; i < n; i++) out[i] = ((Model *)v)->b; return 0; }
int fmi3SetBoolean(void *v, const VR *r, size_t n, const bool *in, size_t m) {
#ifdef BOOLEAN_REFUSED
    return 3;
#endif
    if (n) ((Model *)v)->b = in[0];
    return 0;
}
int fmi3GetString(void *v, const VR *r, size_t n, const char **out, size_t m) {
    for (size_t i = 0; i < n; i++)
#ifdef STRING_START
        out[i] = "other";
#else
        out[i] = "text";
#endif
    return 0;
}
int fmi3SetString(void *v, const VR *r, size_t n, const char *const *in, size_t m) {
#ifdef STRING_REFUSED
    return 3;
#endif
    return 0;
}
/* Two intermediate updates; true when the importer ends the step in the middle. */
static bool updated(Model *m, double t, double h) {
    bool asked = false, may_return = m->early;
    double at = 0, middle = t + h / 2, end = t + h;
#ifdef UPDATE_BEYOND
    end = t + 2 * h;
#endif
#ifdef UPDATE_BACK
    end = t + h / 4;
#endif
#ifdef EARLY_OFFERED
    may_return = true;
#endif
    m->inside = true;
    m->update(NULL, middle, true, true, true, may_return, &asked, &at);
    if (!asked) m->update(NULL, end, false, true, true, false, &asked, &at);
    m->inside = false;
#ifdef EARLY_IGNORED
    asked = false;
#endif
    if (asked) { m->s += h / 2 * (m->x + 1); m->t = middle; }
#ifdef EARLY_AT_START
    if (asked) m->t = t;
#endif
    return asked;
}
int fmi3DoStep(void *v, double t, double h, bool prior, bool *event, bool *end, bool *early, double *last) {
    Model *m = v;
    *event = *end = *early = false;
    *last = t + h;
#ifdef ABORTS
    abort();
#endif
#ifdef EXITS
    exit(0);
#endif
#ifdef FORGES
    printf("probe:{\"step\": \"end\"}\n{\"step\": \"end\"}\n");
    fflush(stdout);
    _exit(0);
#endif
#ifdef HANGS
    for (;;) sleep(1);
#endif
#ifdef FLOODS
    for (;;) puts("a line that is printed again and again");
#endif
#ifdef EATS
    /* What is limited is the address space; writing to four gigabytes takes half a minute. */
    for (;;) if (!malloc(64 << 20)) abort();
#endif
#ifdef STEP_FAILS
    return 3;
#endif
#ifdef STEP_DISCARDED
    return 2;
#endif
#ifdef STRANGE_STATUS
    return 17;
#endif
#ifdef ONE_STEP_SIZE
    if (m->first == 0) m->first = h;
    if (fabs(h - m->first) > 1e-12) return 3;
#endif
#ifdef WRONG_LAST_TIME
    *last = t;
#endif
#ifdef EARLY
    *early = true;
#endif
#ifdef EVENT
    *event = true;
#endif
    if (m->update && updated(m, t, h)) { *early = true; *last = m->t; return 0; }
    m->s += h * m->x + h;
#ifdef UPDATE_CHANGES
    if (m->update) m->s += 1;
#endif
#ifdef RANDOM
    static int calls;
    m->s += 1e-3 * ++calls;
#endif
    m->t = t + h;
    return 0;
}
int fmi3GetFMUState(void *v, void **state) {
#ifdef STATE_REFUSED
    return 3;
#endif
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, v, sizeof(Model));
    return 0;
}
int fmi3SetFMUState(void *v, void *state) {
    Model *m = v, old = *m;
    memcpy(v, state, sizeof(Model));
#ifdef STATE_IGNORED
    *m = old;
#endif
#ifdef STATE_WITHOUT_S
    m->s = old.s;
#endif
#ifdef STATE_WITHOUT_INPUT
    m->x = old.x;
#endif
    (void)old;
    return 0;
}
int fmi3FreeFMUState(void *v, void **state) { free(*state); *state = NULL; return 0; }
int fmi3SerializedFMUStateSize(void *v, void *state, size_t *n) {
    *n = sizeof(Model);
#ifdef NO_BYTES
    *n = 0;
#endif
    return 0;
}
int fmi3SerializeFMUState(void *v, void *state, unsigned char *bytes, size_t n) {
#ifdef SERIALIZE_FAILS
    return 3;
#endif
    memcpy(bytes, state, n); return 0;
}
int fmi3DeserializeFMUState(void *v, const unsigned char *bytes, size_t n, void **state) {
    *state = calloc(1, sizeof(Model));
    memcpy(*state, bytes, n);
#ifdef BYTES_WRONG
    ((Model *)*state)->s = 5;
#endif
    return 0;
}
int fmi3GetAdjointDerivative(void *v, const VR *u, size_t nu, const VR *k, size_t nk, const double *seed, size_t ns, double *out, size_t no) {
#ifdef ADJOINT_REFUSED
    return 3;
#endif
    for (size_t j = 0; j < nk; j++) {
        out[j] = 0;
        for (size_t i = 0; i < nu; i++)
            if (u[i] == 4 && k[j] == 1) out[j] += ((Model *)v)->k * seed[i];
#ifdef ADJOINT_WRONG
        out[j] += 1;
#endif
    }
    return 0;
}
int fmi3GetDirectionalDerivative(void *v, const VR *u, size_t nu, const VR *k, size_t nk, const double *seed, size_t ns, double *out, size_t no) {
#ifdef DERIVATIVE_REFUSED
    return 3;
#endif
    for (size_t i = 0; i < nu; i++) {
        out[i] = 0;
        for (size_t j = 0; j < nk; j++)
            if (u[i] == 4 && k[j] == 1)
#ifdef DERIVATIVE_WRONG
                out[i] -= ((Model *)v)->k * seed[j];
#else
                out[i] += ((Model *)v)->k * seed[j];
#endif
    }
    return 0;
}
int fmi3GetOutputDerivatives(void *v, const VR *r, size_t n, const int *orders, double *out, size_t m) {
#ifdef OUTPUT_DERIVATIVES_REFUSED
    return 3;
#endif
    for (size_t i = 0; i < n; i++) out[i] = r[i] == 3 ? ((Model *)v)->x : 0;
    return 0;
}
int fmi3EnterEventMode(void *v) { return 0; }
int fmi3EnterStepMode(void *v) {
#ifdef STEP_MODE_REFUSED
    return 3;
#endif
    return 0;
}
int fmi3UpdateDiscreteStates(void *v, bool *again, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    *again = *end = *nominals = *values = *defined = false;
    *next = 0;
#ifdef EVENTS_NEVER_END
    *again = true;
#endif
    return 0;
}
int fmi3EnterConfigurationMode(void *v) {
#ifdef CONFIGURATION_REFUSED
    return 3;
#endif
    return 0;
}
int fmi3ExitConfigurationMode(void *v) { return 0; }
int fmi3GetUInt64(void *v, const VR *r, size_t n, uint64_t *out, size_t m) { for (size_t i = 0; i < n; i++) out[i] = 3; return 0; }
int fmi3SetUInt64(void *v, const VR *r, size_t n, const uint64_t *in, size_t m) {
#ifdef STRUCTURE_REFUSED
    return 3;
#endif
    return 0;
}
int fmi3GetBinary(void *v, const VR *r, size_t n, size_t *sizes, const uint8_t **out, size_t m) {
    static const uint8_t blob[] = {0xC0, 0x00, 0xFE};
    *out = blob;
    *sizes = sizeof blob;
#ifdef BINARY_START
    *sizes = 2;
#endif
    return 0;
}
int fmi3SetBinary(void *v, const VR *r, size_t n, const size_t *sizes, const uint8_t *const *in, size_t m) {
#ifdef BINARY_REFUSED
    return 3;
#endif
    return *sizes == 3 && in[0][2] == 0xFE ? 0 : 3;
}
int fmi3EnterContinuousTimeMode(void *v) { return 0; }
int fmi3SetTime(void *v, double t) { ((Model *)v)->t = t; return 0; }
int fmi3GetNumberOfContinuousStates(void *v, size_t *n) {
    *n = 1;
#ifdef STATES_MISCOUNTED
    *n = 2;
#endif
    return 0;
}
int fmi3GetContinuousStates(void *v, double *x, size_t n) { x[0] = ((Model *)v)->s; return 0; }
int fmi3SetContinuousStates(void *v, const double *x, size_t n) { ((Model *)v)->s = x[0]; return 0; }
int fmi3GetContinuousStateDerivatives(void *v, double *x, size_t n) {
#ifdef RATES_REFUSED
    return 3;
#endif
    x[0] = ((Model *)v)->x; return 0;
}
int fmi3GetNominalsOfContinuousStates(void *v, double *x, size_t n) {
    x[0] = 1;
#ifdef NOMINAL_ZERO
    x[0] = 0;
#endif
    return 0;
}
