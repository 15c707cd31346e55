/* The closed loop of a device that leads an arm, at 1 kHz: the trajectory and the robot's joints for it, the sensors, the safety
   monitor, the estimator, and the torque that carries the arm. The sensors are a recorded stream.

   It prints raw bits: a digest over everything computed, torques now and then, and the estimates; then what it cost. */
#include <string.h>

#include "armrs.h"
#include "port.h"

#define PERIOD_US 1000u
#define PERIOD ((armrs_real)0.001)
#define DEGREE ((armrs_real)0.017453292519943295)
#define TURN ((armrs_real)6.283185307179586)
#define WAYPOINTS 7

static armrs_path path;
static armrs_robot robot;
static armrs_arm arm;
static armrs_estimator estimator;
static armrs_monitor monitor;

/* ---- printing */
static void print_hex(const void *value, size_t bytes) {
  char text[2 * sizeof(uint64_t) + 1];
  uint64_t bits = 0;
  memcpy(&bits, value, bytes); /* little-endian machines */
  for (size_t i = 0; i < 2 * bytes; i++) {
    text[2 * bytes - 1 - i] = "0123456789abcdef"[bits >> (4 * i) & 15];
  }
  text[2 * bytes] = 0;
  print(text);
}

static void print_count(const char *name, uint32_t value) {
  char text[11], *digit = text + 10;
  *digit = 0;
  do {
    *--digit = (char)('0' + value % 10);
    value /= 10;
  } while (value);
  print(name);
  print(" ");
  print(digit);
  print("\n");
}

static void print_values(const char *name, const armrs_real *values, size_t count) {
  print(name);
  for (size_t i = 0; i < count; i++) {
    print(" ");
    print_hex(&values[i], sizeof *values);
  }
  print("\n");
}

/* ---- the digest: FNV-1a over the bits of every value */
static uint64_t digest = 0xcbf29ce484222325u;

static void digest_values(const armrs_real *values, size_t count) {
  for (size_t i = 0; i < count; i++) {
    unsigned char bytes[sizeof(armrs_real)];
    memcpy(bytes, &values[i], sizeof bytes);
    for (size_t b = 0; b < sizeof bytes; b++) digest = (digest ^ bytes[b]) * 0x100000001b3u;
  }
}

/* ---- the model: a tenth heavier than the arm that was recorded, and its friction not known */
static int effect(armrs_effect *to, const char *name, uint32_t joint, armrs_real first, armrs_real second) {
  if (armrs_effect_named(name, joint, to) != ARMRS_OK) return 1;
  to->parameters[0] = first;
  to->parameters[1] = second;
  return 0;
}

static int set_up(void) {
  static const armrs_segment segments[ARMRS_JOINTS] = {
      {(armrs_real)0.322, (armrs_real)2.325, {(armrs_real)0.186, 0}, (armrs_real)0.0173},
      {(armrs_real)0.264, (armrs_real)1.390, {(armrs_real)0.121, 0}, (armrs_real)0.0067},
      {(armrs_real)0.093, (armrs_real)0.828, {(armrs_real)0.081, 0}, (armrs_real)0.0018},
  };
  static const armrs_real base[2] = {0, 0}, gravity[2] = {0, (armrs_real)-9.81};
  static const armrs_real rest[ARMRS_JOINTS] = {(armrs_real)-0.8, (armrs_real)1.1, (armrs_real)0.05};
  armrs_effect effects[11];
  int bad = 0;
  for (uint32_t j = 0; j < ARMRS_JOINTS; j++) {
    /* The second parameter is what the torque is not linear in: smoothing, rest angle. */
    bad |= effect(&effects[3 * j], "viscous", j, 0, 0);
    bad |= effect(&effects[3 * j + 1], "coulomb", j, 0, (armrs_real)0.01);
    bad |= effect(&effects[3 * j + 2], "elastic", j, 0, rest[j]);
  }
  bad |= effect(&effects[9], "end_range", 1, 0, 0);
  effects[9].parameters[2] = (armrs_real)8;
  effects[9].parameters[3] = (armrs_real)1.7;
  effects[9].parameters[4] = (armrs_real)0.5;
  bad |= effect(&effects[10], "biarticular", 2, 0, 0);
  if (bad || armrs_arm_init(&arm, segments, base, gravity, effects, 11, 0) != ARMRS_OK) return 1;

  static const armrs_real degrees[WAYPOINTS][ARMRS_JOINTS] = {
      {-68, 40, 0}, {-40, 60, 5}, {-60, 95, 0}, {-25, 55, 5}, {-70, 70, 0}, {-35, 90, 5}, {-68, 40, 0},
  };
  armrs_real waypoints[WAYPOINTS][ARMRS_JOINTS];
  armrs_limits limits[ARMRS_JOINTS];
  for (size_t j = 0; j < ARMRS_JOINTS; j++) {
    limits[j].speed = (armrs_real)0.6;
    limits[j].acceleration = (armrs_real)4;
    for (size_t w = 0; w < WAYPOINTS; w++) waypoints[w][j] = degrees[w][j] * DEGREE;
  }
  if (armrs_path_init(&path, waypoints[0], WAYPOINTS, limits, (armrs_real)0.1, 1, 0) != ARMRS_OK) return 1;

  static const armrs_real lengths[2] = {(armrs_real)0.45, (armrs_real)0.45};
  static const armrs_real robot_base[2] = {(armrs_real)1.05, (armrs_real)-0.10};
  if (armrs_robot_init(&robot, lengths, robot_base, 1, 0) != ARMRS_OK) return 1;

  armrs_settings settings;
  if (armrs_estimator_settings(&settings, &arm, PERIOD) != ARMRS_OK) return 1;
  if (armrs_estimator_init(&estimator, &arm, (armrs_real)0.1, &settings, 0) != ARMRS_OK) return 1;

  /* Angles, speeds, forces, power into the arm. */
  armrs_channel channels[9];
  for (size_t j = 0; j < ARMRS_JOINTS; j++) {
    channels[j] = (armrs_channel){ARMRS_ANGLE, (armrs_real)-2, (armrs_real)2, (armrs_real)10, (armrs_real)0.02, 50000};
    channels[3 + j] = (armrs_channel){ARMRS_SPEED, (armrs_real)-3, (armrs_real)3, 0, 0, 0};
  }
  channels[6] = (armrs_channel){ARMRS_FORCE, (armrs_real)-100, (armrs_real)100, 0, (armrs_real)10, 0};
  channels[7] = channels[6];
  channels[8] = (armrs_channel){ARMRS_POWER, (armrs_real)-60, (armrs_real)60, 0, 0, 0};
  return armrs_monitor_init(&monitor, channels, 9, 2 * PERIOD_US, 2 * PERIOD_US, 0) != ARMRS_OK;
}

/* ---- one control period */
static struct {
  uint32_t most[7], sum[7];
} cost;

static void count(size_t part, uint32_t *since) {
  uint32_t now = instructions(), spent = now - *since;
  if (spent > cost.most[part]) cost.most[part] = spent;
  cost.sum[part] += spent / 40; /* in steps of the counter, so that twelve seconds fit */
  *since = instructions();
}

static armrs_real last_q[ARMRS_JOINTS];

static armrs_status period(uint32_t k, const reading *sensor, armrs_real torque[ARMRS_JOINTS],
                           armrs_real sd[ARMRS_JOINTS], armrs_real needed[ARMRS_JOINTS]) {
  uint32_t begin = instructions(), since = begin;

  /* Where the arm should be, and the robot's joints for that. */
  armrs_motion wanted;
  armrs_real handle[2], robot_q[2], rows[2][ARMRS_JOINTS];
  armrs_status status = armrs_path_at(&path, (armrs_real)k * PERIOD, &wanted);
  if (status == ARMRS_OK)
    status = armrs_kinematics(&arm, wanted.q, handle, rows);
  if (status == ARMRS_OK) status = armrs_robot_angles(&robot, handle, robot_q);
  if (status != ARMRS_OK) return status;
  count(0, &since);

  /* What that should take, all effects included. */
  armrs_load load;
  for (size_t j = 0; j < ARMRS_JOINTS; j++) load.torque[j] = 0;
  load.moment_on_arm = 0;
  for (size_t c = 0; c < 2; c++) load.force_on_arm[c] = (armrs_real)sensor->force[c] * ((armrs_real)220 / 4096);
  status = armrs_inverse_dynamics(&arm, &wanted, &load, needed);
  if (status != ARMRS_OK) return status;
  count(1, &since);

  /* Is it safe? */
  static armrs_observation seen; /* Of the channels that are not used it holds zeros. */
  armrs_sample sample;
  armrs_stop stop;
  seen.now = (uint64_t)k * PERIOD_US;
  seen.stamp = seen.now;
  armrs_real power = 0;
  for (size_t j = 0; j < ARMRS_JOINTS; j++) {
    sample.q[j] = (armrs_real)sensor->encoder[j] * (TURN / 1048576);
    seen.values[j] = sample.q[j];
    seen.values[3 + j] = k ? (sample.q[j] - last_q[j]) * (armrs_real)1000 : 0;
    seen.moving[j] = wanted.qd[j] > (armrs_real)0.05 || wanted.qd[j] < (armrs_real)-0.05;
    last_q[j] = sample.q[j];
    for (size_t c = 0; c < 2; c++) power += rows[c][j] * wanted.qd[j] * load.force_on_arm[c];
  }
  seen.values[6] = load.force_on_arm[0];
  seen.values[7] = load.force_on_arm[1];
  seen.values[8] = power;
  sample.load = load;
  sample.led = 0;
  status = armrs_monitor_check(&monitor, &seen, &stop);
  if (status != ARMRS_OK) {
    print_count("stopped, reason", (uint32_t)stop.reason);
    print_count("channel", stop.channel);
    return status;
  }
  count(2, &since);

  /* What is the arm made of? */
  status = armrs_estimator_update(&estimator, &sample, 0);
  if (status != ARMRS_OK) return status;
  count(3, &since);

  uint32_t asked = begin;
  count(5, &asked);

  /* What carries it there, at rest? */
  for (size_t j = 0; j < ARMRS_JOINTS; j++) wanted.qd[j] = 0;
  status = armrs_estimator_carry(&estimator, &wanted, torque, sd);
  count(4, &since);
  count(6, &begin);
  digest_values(robot_q, 2);
  return status;
}

int application(void) {
  if (set_up()) {
    print("the model was refused\n");
    return 1;
  }
  print_count("stack of the set-up", stack_used());
  size_t samples;
  const reading *sensors = stream(&samples);
  print_count("samples", (uint32_t)samples);
  for (uint32_t k = 0; k < samples; k++) {
    armrs_real torque[ARMRS_JOINTS], sd[ARMRS_JOINTS], needed[ARMRS_JOINTS];
    if (period(k, &sensors[k], torque, sd, needed) != ARMRS_OK) {
      print_count("stopped in period", k);
      return 1;
    }
    digest_values(torque, ARMRS_JOINTS);
    digest_values(sd, ARMRS_JOINTS);
    digest_values(needed, ARMRS_JOINTS);
    if (k % 100 == 99) {
      print_values("needed", needed, ARMRS_JOINTS);
      print_values("carry", torque, ARMRS_JOINTS);
    }
  }
  for (size_t i = 0; i < ARMRS_UNKNOWNS; i++) {
    armrs_estimate found;
    if (armrs_estimator_get(&estimator, i, &found) != ARMRS_OK) break;
    armrs_real both[2] = {found.value, found.sd};
    print_values("estimate", both, 2);
    digest_values(both, 2);
  }
  print("digest ");
  print_hex(&digest, sizeof digest);
  print("\n");
  static const char *const names[7] = {
      "trajectory", "dynamics", "monitor", "estimator", "compensation", "period before compensation", "period"};
  for (size_t part = 0; part < 7; part++) {
    print(names[part]);
    print_count(" most", cost.most[part]);
    print(names[part]);
    print_count(" mean", cost.sum[part] / (uint32_t)samples * 40 + cost.sum[part] % (uint32_t)samples * 40 / (uint32_t)samples);
  }
  print_count("stack", stack_used());
  return 0;
}
