/* The arm that armrs export-c wrote, on the device: its self-test, and the torques of its test vectors as raw bits. */
#include <string.h>

#include "armrs_model.h"
#include "port.h"

static armrs_arm arm;
static armrs_compensation compensation;

static void print_values(const char *name, const armrs_real *values, size_t count) {
  print(name);
  for (size_t i = 0; i < count; i++) {
    char text[2 * sizeof(uint64_t) + 2];
    uint64_t bits = 0;
    memcpy(&bits, &values[i], sizeof *values); /* little-endian machines */
    size_t digits = 2 * sizeof *values;
    text[0] = ' ';
    for (size_t k = 0; k < digits; k++) text[digits - k] = "0123456789abcdef"[bits >> (4 * k) & 15];
    text[digits + 1] = 0;
    print(text);
  }
  print("\n");
}

int application(void) {
  armrs_problem problem;
  problem.what[0] = 0;
  if (armrs_model_arm(&arm, &problem) != ARMRS_OK || armrs_model_compensation(&compensation, &arm, &problem) != ARMRS_OK) {
    print("refused: ");
    print(problem.what);
    print("\n");
    return 1;
  }
  if (armrs_model_self_test(&arm) != ARMRS_OK) {
    print("the self-test failed\n");
    return 1;
  }
  for (size_t i = 0; i < ARMRS_MODEL_VECTORS; i++) {
    armrs_motion motion;
    armrs_load load;
    armrs_real expected[ARMRS_JOINTS], torque[ARMRS_JOINTS], sd[ARMRS_JOINTS];
    armrs_model_vector(i, &motion, &load, expected);
    if (armrs_inverse_dynamics(&arm, &motion, &load, torque) != ARMRS_OK) return 1;
    print_values("torque", torque, ARMRS_JOINTS);
    if (armrs_compensation_carry(&compensation, &motion, torque, sd) != ARMRS_OK) return 1;
    print_values("sd", sd, ARMRS_JOINTS);
    armrs_model_calibrate(motion.q, load.force_on_arm, &load.moment_on_arm);
    print_values("calibrated", motion.q, ARMRS_JOINTS);
  }
  print("self-test passed\n");
  return 0;
}
