// What carries an arm that armrs export-c wrote: its model with self-test, and a limited share of the torque.
#ifndef ARMRS_SUPPORT_HPP
#define ARMRS_SUPPORT_HPP

#include <algorithm>

#include "armrs.hpp"
#include "armrs_model.h"

namespace armrs_support {

class Support {
 public:
  // Makes the arm and computes its test vectors.
  [[nodiscard]] armrs_status init(armrs::real share, armrs::real limit) noexcept {
    share_ = share;
    limit_ = limit;
    armrs_problem problem{};
    if (const auto status = armrs_model_arm(arm_.get(), &problem); status != ARMRS_OK) return status;
    if (const auto status = armrs_model_self_test(arm_.get()); status != ARMRS_OK) return status;
    return armrs_model_compensation(&compensation_, arm_.get(), &problem);
  }

  // The torques at rest; zeros beside any status but ARMRS_OK.
  [[nodiscard]] armrs::result<armrs::joints> torque(const armrs::joints &q) const noexcept {
    armrs_motion motion{};
    std::copy(q.begin(), q.end(), motion.q);
    armrs::result<armrs::joints> found;
    armrs::joints sd{};
    found.status = armrs_compensation_carry(&compensation_, &motion, found.value.data(), sd.data());
    if (!found) found.value = {};
    for (auto &torque : found.value) torque = std::clamp(share_ * torque, -limit_, limit_);
    return found;
  }

 private:
  armrs::arm arm_;
  armrs_compensation compensation_{};
  armrs::real share_ = 0, limit_ = 0;
};

}  // namespace armrs_support

#endif
