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

// MuJoCo asks for the spring's point in every stage of a step.
static const double *halves_;
static void control(const mjModel *model, mjData *data) {
    memcpy(data->ctrl, halves_ + 2 * lround(2.0 * data->time / model->opt.timestep), 2 * sizeof(double));
}

static int run_by(const char *method, long substeps, const double *halves) {
    if (!strcmp(method, "rk4"))
        led->opt.integrator = mjINT_RK4;
    else if (!strcmp(method, "implicitfast"))
        led->opt.integrator = mjINT_IMPLICITFAST;
    else
        return 0;
    led->opt.timestep = RECORD * STEP / (double)substeps;
    halves_ = halves;
    mjcb_control = control;
    mj_resetData(led, led_data);
    memcpy(led_data->qpos, starts, 3 * sizeof(double));
    for (int k = 0; k < LONG_SAMPLES; ++k) {
        if (k)
            for (long i = 0; i < substeps; ++i) mj_step(led, led_data);
        memcpy(record + 3 * k, led_data->qpos, 3 * sizeof(double));
    }
    mjcb_control = NULL;
    led->opt.timestep = STEP;
    led->opt.integrator = mjINT_EULER;
    return 1;
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
