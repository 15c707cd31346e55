/* A device's program: a log from standard input through estimator, compensation and monitor of the C interface, all results to standard
   output. Numbers are those of the library. In: count of samples, control period, then for each: 1 or 0 for a missing one, angles, torques, force in y
   and z, moment. Out: for each its status, and torque and standard deviation of estimator and of compensation at rest (NaN where there are
   none); then value, standard deviation and decision of each unknown; residuals, excess, age, restarts; then reason, channel, value, limit
   and time of the stop of a monitor of the angles, or -1. */
#include <math.h>
#include <stdio.h>

#include "armrs_model.h"

static armrs_arm arm;
static armrs_estimator estimator;
static armrs_compensation compensation;
static armrs_monitor monitor;

static int take(armrs_real *values, size_t count) { return fread(values, sizeof(armrs_real), count, stdin) == count; }
static void give(const armrs_real *values, size_t count) { fwrite(values, sizeof(armrs_real), count, stdout); }
static void give_carried(armrs_status status, armrs_real *torque, armrs_real *sd) {
  for (size_t j = 0; j < ARMRS_JOINTS; j++)
    if (status != ARMRS_OK) torque[j] = sd[j] = NAN;
  give(torque, ARMRS_JOINTS);
  give(sd, ARMRS_JOINTS);
}

int main(void) {
  armrs_real head[2], row[1 + 2 * ARMRS_JOINTS + 3];
  armrs_problem problem;
  armrs_settings settings;
  armrs_stop stop;
  armrs_real stopped[5] = {-1, 0, 0, 0, 0};
  if (!take(head, 2)) return 1;
  if (armrs_model_arm(&arm, &problem) != ARMRS_OK) return 2;
  if (armrs_estimator_settings(&settings, &arm, head[1]) != ARMRS_OK) return 3;
  if (armrs_estimator_init(&estimator, &arm, ARMRS_MODEL_UNCERTAINTY, &settings, &problem) != ARMRS_OK) return 4;
  if (armrs_model_compensation(&compensation, &arm, &problem) != ARMRS_OK) return 5;
  armrs_channel channels[ARMRS_JOINTS];
  for (size_t j = 0; j < ARMRS_JOINTS; j++) {
    const armrs_channel angle = {ARMRS_ANGLE, -2.0, 2.0, 3.0, 0.5, 200000};
    channels[j] = angle;
  }
  if (armrs_monitor_init(&monitor, channels, ARMRS_JOINTS, 2000, 100000, &problem) != ARMRS_OK) return 6;

  for (size_t i = 0; i < (size_t)head[0]; i++) {
    armrs_sample sample = {{0}, {0}, 0, {{0}, {0}, 0}};
    armrs_motion motion = {0, {0}, {0}, {0}};
    armrs_sample_status sample_status;
    armrs_real status, torque[ARMRS_JOINTS], sd[ARMRS_JOINTS];
    if (!take(row, sizeof row / sizeof *row)) return 7;
    for (size_t j = 0; j < ARMRS_JOINTS; j++) {
      sample.q[j] = motion.q[j] = row[1 + j];
      sample.load.torque[j] = row[1 + ARMRS_JOINTS + j];
    }
    sample.load.force_on_arm[0] = row[1 + 2 * ARMRS_JOINTS];
    sample.load.force_on_arm[1] = row[2 + 2 * ARMRS_JOINTS];
    sample.load.moment_on_arm = row[3 + 2 * ARMRS_JOINTS];
    motion.time = head[1] * (armrs_real)i;
    if (armrs_estimator_update(&estimator, row[0] != 0 ? &sample : NULL, &sample_status) != ARMRS_OK) return 8;
    status = (armrs_real)sample_status;
    give(&status, 1);
    give_carried(armrs_estimator_carry(&estimator, &motion, torque, sd), torque, sd);
    motion.time = 0;
    give_carried(armrs_compensation_carry(&compensation, &motion, torque, sd), torque, sd);
    if (row[0] != 0 && stopped[0] < 0) {
      armrs_observation seen = {1000 * i, 1000 * i, {0}, {0}};
      for (size_t j = 0; j < ARMRS_JOINTS; j++) {
        seen.values[j] = row[1 + j];
        seen.moving[j] = 1;
      }
      if (armrs_monitor_check(&monitor, &seen, &stop) == ARMRS_STOPPED) {
        const armrs_real found[5] = {(armrs_real)stop.reason, (armrs_real)stop.channel, stop.value, stop.limit, (armrs_real)stop.at};
        for (size_t k = 0; k < 5; k++) stopped[k] = found[k];
      }
    }
  }
  armrs_estimate e;
  for (size_t k = 0; armrs_estimator_get(&estimator, k, &e) == ARMRS_OK; k++) {
    const armrs_real told[3] = {e.value, e.sd, (armrs_real)e.decided_by};
    give(told, 3);
  }
  armrs_health health;
  if (armrs_estimator_health(&estimator, &health) != ARMRS_OK) return 9;
  give(health.residual, ARMRS_JOINTS);
  const armrs_real rest[3] = {health.excess, health.age, (armrs_real)health.restarts};
  give(rest, 3);
  give(stopped, 5);
  return 0;
}
