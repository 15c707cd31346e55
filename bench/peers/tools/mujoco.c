// MuJoCo from C. The shared library of the Python package is used as it is; no profiling clock is installed here.
//
// The spring is an actuator on the site at the tip: force = SPRING (ctrl - position), which MuJoCo knows without a callback.
#include <mujoco/mujoco.h>

#include "engine.h"

static mjModel *free_arm, *led;
static mjData *free_data, *led_data;

static void kernels(int forward) {
    mjData *data = free_data;
    for (int i = 0; i < STATES; ++i) {
        memcpy(data->qpos, states + 3 * i, 3 * sizeof(double));
        memcpy(data->qvel, states + 3 * (STATES + i), 3 * sizeof(double));
        if (forward) {
            memcpy(data->qfrc_applied, states + 3 * (2 * STATES + i), 3 * sizeof(double));
            mj_forward(free_arm, data);
            memcpy(out + 3 * i, data->qacc, 3 * sizeof(double));
        } else {
            memcpy(data->qacc, states + 3 * (2 * STATES + i), 3 * sizeof(double));
            mj_inverse(free_arm, data);
            memcpy(out + 3 * i, data->qfrc_inverse, 3 * sizeof(double));
        }
    }
}

static void run(void) {
    mjData *data = led_data;
    mj_resetData(led, data);
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
        mj_step(led, data);
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

static void set_up(void) {
    free_arm = load("free.xml"), led = load("led.xml");
    free_data = mj_makeData(free_arm), led_data = mj_makeData(led);
}
