// What the programs in C and C++ share: the clock, the files, and the conversation. A line comes in, a line of JSON goes out.
#pragma once
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "problem.h"

static inline double cpu_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// Reads doubles that `problem.py` has written. The caller keeps them for as long as the program runs.
static inline double *read_doubles(const char *name, size_t count) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", FOLDER, name);
    FILE *file = fopen(path, "rb");
    double *values = (double *)aligned_alloc(64, (count * sizeof(double) + 63) / 64 * 64);
    if (!file || !values || fread(values, sizeof(double), count, file) != count) {
        fprintf(stderr, "%s: not %zu numbers\n", path, count);
        exit(2);
    }
    fclose(file);
    return values;
}

static inline void print_values(const double *values, size_t count) {
    printf("[");
    for (size_t i = 0; i < count; ++i) printf("%s%.17g", i ? "," : "", values[i]);
    printf("]");
}

// s(t): from 0 to 1 and back with trapezoidal speed, ramps of a tenth of each half.
static inline double fraction(double time, double duration) {
    const double half = 0.5 * duration, ramp = 0.1 * half, peak = 1.0 / (half - ramp);
    const double inside = time < duration - time ? time : duration - time;
    const double near = inside < half - inside ? inside : half - inside;
    const double part = peak * (near < ramp ? 0.5 * near * near / ramp : near - 0.5 * ramp);
    return inside <= 0.5 * half ? part : 1.0 - part;
}

// The point that the spring pulls towards, with the platform's sine.
static inline void handle_at(double time, double duration, double out[2]) {
    const double s = fraction(time, duration);
    double angle = 0.0;
    out[0] = out[1] = 0.0;
    for (int j = 0; j < 3; ++j) {
        angle += FROM_[j] + s * (TO_[j] - FROM_[j]);
        out[0] += LENGTH_[j] * cos(angle);
        out[1] += LENGTH_[j] * sin(angle);
    }
}

// The handle's path at half of each of `substeps` steps from one recorded sample to the next. The caller frees it.
static inline double *half_table(long substeps, double duration) {
    const long count = 2 * substeps * lround(duration / (RECORD * STEP));
    double *table = (double *)malloc(2 * (size_t)(count + 1) * sizeof(double));
    for (long i = 0; i <= count; ++i) handle_at(0.5 * RECORD * STEP / (double)substeps * (double)i, duration, table + 2 * i);
    return table;
}

// How often a call is made where its instructions are counted instead of its time; below zero where it is timed.
static long exactly_ = -1;
static inline int told_exactly(const char *word) {
    if (sscanf(word, "exactly:%ld", &exactly_) != 1) return 0;
    printf("true");
    return 1;
}

// Repeats `call` for about a tenth of a second of processor time and gives the time of one, after one that does not count. A look at the clock costs
// as much as some kernels: one for many calls where they are short.
#define SECONDS_OF(result, call)                                 \
    do {                                                         \
        if (exactly_ >= 0) {                                     \
            for (long i_ = 0; i_ < exactly_; ++i_) call;         \
            (result) = 0.0;                                      \
            break;                                               \
        }                                                        \
        call;                                                    \
        long calls_ = 0, between_ = 1;                           \
        const double start_ = cpu_seconds();                     \
        double passed_;                                          \
        do {                                                     \
            for (long i_ = 0; i_ < between_; ++i_) call;         \
            calls_ += between_;                                  \
            passed_ = cpu_seconds() - start_;                    \
            if (passed_ < 0.01) between_ *= 2;                   \
        } while (passed_ < 0.1);                                 \
        (result) = passed_ / (double)calls_;                     \
    } while (0)
