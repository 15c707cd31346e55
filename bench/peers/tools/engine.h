// What the engines in C and C++ share: the tables, and `main`. An engine says how it is set up, its two kernels and its run.
#pragma once
#include "peer.h"

enum { LONG_STEPS = 80000, LONG_SAMPLES = LONG_STEPS / RECORD + 1 };
static double *states, *starts, table[2 * (LONG_STEPS + 1)], record[3 * LONG_SAMPLES], out[3 * STATES];

static void set_up(void);
// Forward or inverse dynamics of all states, into `out`.
static void kernels(int forward);
// The run of 20 s from the first start with the handle's path from the table; angles at 50 Hz into `record`.
static void run(void);
// The same by a method that the engine knows (otherwise false), `substeps` steps from one sample to the next; the path from a table of half steps.
static int run_by(const char *method, long substeps, const double *halves);

static int accurate(int check, const char *task) {
    char method[64];
    long substeps;
    if (sscanf(task, "accurate:%63[^:]:%ld", method, &substeps) != 2) return 0;
    double seconds, *halves = half_table(substeps, LONG);
    const int known = run_by(method, substeps, halves);
    if (known && check) print_values(record, 3 * LONG_SAMPLES);
    if (known && !check) {
        SECONDS_OF(seconds, run_by(method, substeps, halves));
        printf("{\"seconds\": %.9g}", seconds);
    }
    free(halves);
    return known;
}

int main(void) {
    states = read_doubles("states.f64", 9 * STATES);
    starts = read_doubles("starts.f64", 3 * (1 + RUNS));
    for (int i = 0; i <= LONG_STEPS; ++i) handle_at(i * STEP, LONG, table + 2 * i);
    set_up();
    char word[64];
    double seconds;
    while (scanf("%63s", word) == 1) {
        const int check = !strncmp(word, "check:", 6);
        const char *task = check ? word + 6 : word;
        const int forward = !strcmp(task, "forward_dynamics");
        if (forward || !strcmp(task, "inverse_dynamics")) {
            if (check) {
                kernels(forward);
                print_values(out, 3 * STATES);
            } else {
                SECONDS_OF(seconds, kernels(forward));
                printf("{\"seconds\": %.9g}", seconds / STATES);
            }
        } else if (!strcmp(task, "run")) {
            if (check) {
                run();
                print_values(record, 3 * LONG_SAMPLES);
            } else {
                SECONDS_OF(seconds, run());
                printf("{\"seconds\": %.9g}", seconds);
            }
        } else if (!told_exactly(word) && !accurate(check, task)) {
            printf("null");
        }
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
