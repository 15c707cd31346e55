// A controller of ros2_control: positions in, the efforts that carry the arm out. Written for ROS 2 Jazzy; see README.md.
#include <string>
#include <vector>

#include "controller_interface/controller_interface.hpp"
#include "hardware_interface/types/hardware_interface_type_values.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "support.hpp"

namespace armrs_support {

using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::return_type;

class SupportController : public controller_interface::ControllerInterface {
 public:
  CallbackReturn on_init() override {
    auto_declare<std::vector<std::string>>("joints", {});
    auto_declare<double>("share", 1.0);
    auto_declare<double>("limit", 0.0);
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_configure(const rclcpp_lifecycle::State &) override {
    joints_ = get_node()->get_parameter("joints").as_string_array();
    const auto share = get_node()->get_parameter("share").as_double(), limit = get_node()->get_parameter("limit").as_double();
    if (joints_.size() != ARMRS_JOINTS) {
      RCLCPP_ERROR(get_node()->get_logger(), "joints: found %zu, allowed %d", joints_.size(), ARMRS_JOINTS);
      return CallbackReturn::ERROR;
    }
    if (const auto status = support_.init(share, limit); status != ARMRS_OK) {
      RCLCPP_ERROR(get_node()->get_logger(), "the model cannot be used: armrs_status %d", static_cast<int>(status));
      return CallbackReturn::ERROR;
    }
    return CallbackReturn::SUCCESS;
  }

  InterfaceConfiguration command_interface_configuration() const override { return each(hardware_interface::HW_IF_EFFORT); }
  InterfaceConfiguration state_interface_configuration() const override { return each(hardware_interface::HW_IF_POSITION); }

  return_type update(const rclcpp::Time &, const rclcpp::Duration &) override {
    armrs::joints q;
    for (std::size_t k = 0; k < q.size(); k++) q[k] = static_cast<armrs::real>(state_interfaces_[k].get_value());
    const auto found = support_.torque(q);
    for (std::size_t k = 0; k < q.size(); k++) (void)command_interfaces_[k].set_value(static_cast<double>(found.value[k]));
    return return_type::OK;
  }

  CallbackReturn on_deactivate(const rclcpp_lifecycle::State &) override {
    for (auto &command : command_interfaces_) (void)command.set_value(0.0);
    return CallbackReturn::SUCCESS;
  }

 private:
  InterfaceConfiguration each(const std::string &interface) const {
    InterfaceConfiguration configuration{controller_interface::interface_configuration_type::INDIVIDUAL, {}};
    for (const auto &joint : joints_) configuration.names.push_back(joint + "/" + interface);
    return configuration;
  }

  std::vector<std::string> joints_;
  Support support_;
};

}  // namespace armrs_support

PLUGINLIB_EXPORT_CLASS(armrs_support::SupportController, controller_interface::ControllerInterface)
