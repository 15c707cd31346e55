// MuJoCo from C. The shared library of the Python package is used as it is; no profiling clock is installed here.
//
// The spring is an actuator on the site at the tip: force = SPRING (ctrl - position), which MuJoCo knows without a callback.
#include <mujoco/mujoco.h>

#include "peer.h"

enum { LONG_STEPS = 80000, LONG_SAMPLES = LONG_STEPS / RECORD + 1 };
static double *states, *starts, table[2 * (LONG_STEPS + 1)], record[3 * LONG_SAMPLES], out[3 * STATES];

static void kernels(const mjModel *model, mjData *data, int forward) {
    for (int i = 0; i < STATES; ++i) {
        memcpy(data->qpos, states + 3 * i, 3 * sizeof(double));
        memcpy(data->qvel, states + 3 * (STATES + i), 3 * sizeof(double));
        if (forward) {
            memcpy(data->qfrc_applied, states + 3 * (2 * STATES + i), 3 * sizeof(double));
            mj_forward(model, data);
            memcpy(out + 3 * i, data->qacc, 3 * sizeof(double));
        } else {
            memcpy(data->qacc, states + 3 * (2 * STATES + i), 3 * sizeof(double));
            mj_inverse(model, data);
            memcpy(out + 3 * i, data->qfrc_inverse, 3 * sizeof(double));
        }
    }
}

static void run(const mjModel *model, mjData *data) {
    mj_resetData(model, data);
    memcpy(data->qpos, starts, 3 * sizeof(double));
    double *to = record;
    for (int i = 0;; ++i) {
        if (i % RECORD == 0) {
            memcpy(to, data->qpos, 3 * sizeof(double));
            to += 3;
        }
        if (i == LONG_STEPS) return;
        data->ctrl[0] = table[2 * i];
        data->ctrl[1] = table[2 * i + 1];
        mj_step(model, data);
    }
}

static mjModel *load(const char *name) {
    char path[4096], error[1000];
    snprintf(path, sizeof path, "%s/%s", FOLDER, name);
    mjModel *model = mj_loadXML(path, NULL, error, sizeof error);
    if (!model) {
        fprintf(stderr, "%s: %s\n", path, error);
        exit(2);
    }
    return model;
}

int main(void) {
    states = read_doubles("states.f64", 9 * STATES);
    starts = read_doubles("starts.f64", 3 * (1 + RUNS));
    for (int i = 0; i <= LONG_STEPS; ++i) handle_at(i * STEP, LONG, table + 2 * i);
    mjModel *free_arm = load("free.xml"), *led = load("led.xml");
    mjData *free_data = mj_makeData(free_arm), *led_data = mj_makeData(led);
    char word[64];
    double seconds;
    while (scanf("%63s", word) == 1) {
        const int check = !strncmp(word, "check:", 6);
        const char *task = check ? word + 6 : word;
        const int forward = !strcmp(task, "forward_dynamics");
        if (forward || !strcmp(task, "inverse_dynamics")) {
            if (check) {
                kernels(free_arm, free_data, forward);
                print_values(out, 3 * STATES);
            } else {
                SECONDS_OF(seconds, kernels(free_arm, free_data, forward));
                printf("{\"seconds\": %.9g}", seconds / STATES);
            }
        } else if (!strcmp(task, "run")) {
            if (check) {
                run(led, led_data);
                print_values(record, 3 * LONG_SAMPLES);
            } else {
                SECONDS_OF(seconds, run(led, led_data));
                printf("{\"seconds\": %.9g}", seconds);
            }
        } else {
            printf("null");
        }
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
