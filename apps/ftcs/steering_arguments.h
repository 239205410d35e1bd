// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "ftcs/discipline/steering_rules.h"
#include "ftcs/servo/any_servo.h"

namespace CLI {
class App;  // the whole of it is for the files that add flags: it costs seconds in each
}

namespace ftcs::app {

/// What `ftcs ptp` and `ftcs phc` both take about the servo and the clock it steers, as given.
struct SteeringArguments {
  std::string servo;
  std::string max_frequency;
  std::string max_frequency_change;
  std::string frequency_granularity;
  std::string timer_granularity;
  std::string steering_latency;
  bool never_step = false;
};

/// `arguments` must outlive `command`.
void add_steering_flags(CLI::App& command, SteeringArguments& arguments);

// Each returns what is wrong, if anything.

/// --servo alone: other arguments may depend on the kind.
[[nodiscard]] std::optional<std::string> choose_servo(const SteeringArguments& arguments,
                                                      ServoConfig& servo);
[[nodiscard]] std::optional<std::string> apply_steering(const SteeringArguments& arguments,
                                                        ServoConfig& servo, SteeringRules& rules);
/// Once everything is known: can this servo keep to what was asked for?
[[nodiscard]] std::optional<std::string> check_steering(const ServoConfig& servo,
                                                        const SteeringRules& rules);

// The same as settings of a configuration file, without units: ppb and ns.

[[nodiscard]] std::optional<std::string> set_max_frequency(double ppb, ServoConfig& servo);
[[nodiscard]] std::optional<std::string> set_max_frequency_change(double ppb, SteeringRules& rules);
[[nodiscard]] std::optional<std::string> set_frequency_granularity(double ppb, ServoConfig& servo);
[[nodiscard]] std::optional<std::string> set_timer_granularity(double ns, ServoConfig& servo);
[[nodiscard]] std::optional<std::string> set_steering_latency(double ns, ServoConfig& servo);

/// "adaptive, ftcs, pics ..."
[[nodiscard]] std::string servo_names();

}  // namespace ftcs::app
