// The C interface of armrs for C++17: values in, std::array out, no exceptions, no allocation. Every call returns a status beside
// its result, which is zero where the status is not ARMRS_OK.
#ifndef ARMRS_HPP
#define ARMRS_HPP

#include <array>
#include <cstddef>
#include <utility>

#include "armrs.h"

namespace armrs {

using real = armrs_real;
using joints = std::array<real, ARMRS_JOINTS>;
using plane = std::array<real, 2>;

// A result and its status.
template <class T>
struct [[nodiscard]] result {
  T value{};
  armrs_status status = ARMRS_OK;
  explicit operator bool() const noexcept { return status == ARMRS_OK; }
};

// An arm with its effects.
class arm {
 public:
  // See armrs_arm_init.
  template <std::size_t N = 0>
  [[nodiscard]] armrs_status init(const std::array<armrs_segment, ARMRS_JOINTS> &segments, const plane &base, const plane &gravity,
                                  const std::array<armrs_effect, N> &effects = {}, armrs_problem *problem = nullptr) noexcept {
    return armrs_arm_init(&arm_, segments.data(), base.data(), gravity.data(), effects.data(), N, problem);
  }
  result<joints> gravity(const joints &q) const noexcept {
    result<joints> found;
    found.status = armrs_gravity(&arm_, q.data(), found.value.data());
    return found;
  }
  result<joints> inverse_dynamics(const armrs_motion &motion, const armrs_load &load = {}) const noexcept {
    result<joints> found;
    found.status = armrs_inverse_dynamics(&arm_, &motion, &load, found.value.data());
    return found;
  }
  result<joints> forward_dynamics(const armrs_motion &motion, const armrs_load &load) const noexcept {
    result<joints> found;
    found.status = armrs_forward_dynamics(&arm_, &motion, &load, found.value.data());
    return found;
  }
  result<plane> tip(const joints &q) const noexcept {
    result<plane> found;
    found.status = armrs_kinematics(&arm_, q.data(), found.value.data(), nullptr);
    return found;
  }
  [[nodiscard]] const armrs_arm *get() const noexcept { return &arm_; }
  [[nodiscard]] armrs_arm *get() noexcept { return &arm_; }

 private:
  armrs_arm arm_{};
};

// Torques that carry an arm, and their standard deviations [N m].
struct support {
  joints torque{}, sd{};
};

// Identification while the arm moves.
class estimator {
 public:
  [[nodiscard]] armrs_status init(const arm &of, real uncertainty, const armrs_settings &settings, armrs_problem *problem = nullptr) noexcept {
    return armrs_estimator_init(&estimator_, of.get(), uncertainty, &settings, problem);
  }
  // A sample, or null where one is missing.
  result<armrs_sample_status> update(const armrs_sample *sample) noexcept {
    result<armrs_sample_status> found;
    found.status = armrs_estimator_update(&estimator_, sample, &found.value);
    return found;
  }
  result<support> carry(const armrs_motion &motion) const noexcept {
    result<support> found;
    found.status = armrs_estimator_carry(&estimator_, &motion, found.value.torque.data(), found.value.sd.data());
    return found;
  }
  result<armrs_health> health() const noexcept {
    result<armrs_health> found;
    found.status = armrs_estimator_health(&estimator_, &found.value);
    return found;
  }
  [[nodiscard]] const armrs_estimator *get() const noexcept { return &estimator_; }

 private:
  armrs_estimator estimator_{};
};

// The settings of an estimator for an arm, every guard on.
inline result<armrs_settings> settings(const arm &of, real period) noexcept {
  result<armrs_settings> found;
  found.status = armrs_estimator_settings(&found.value, of.get(), period);
  return found;
}

}  // namespace armrs

#endif
