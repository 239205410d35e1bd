// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/cycle_laws.h"

#include <array>

namespace ftcs::daemon {

std::span<const std::string> cycle_law_names() {
  static const std::array<std::string, 5> names{"ftcs", "pics", "adaptive", "soem-pi", "none"};
  return names;
}

void set_cycle_law(RunOptions& options, std::string_view name) {
  CycleServoConfig& servo = options.servo;
  options.servo_name = name;
  servo.trigger = TriggerModel::kKnown;
  if (name == "ftcs") servo.law = CycleLaw::kFtcs;
  if (name == "pics") servo.law = CycleLaw::kPics;
  if (name == "adaptive") servo.law = CycleLaw::kAdaptive;
  if (name == "none") servo.law = CycleLaw::kNone;
  if (name != "soem-pi") return;
  servo.law = CycleLaw::kPics;
  servo.cycles_per_sync = 1;
  servo.proportional_gain = 0.01;
  servo.integral_gain = 2e-5;
  servo.trigger = TriggerModel::kIdeal;
}

}  // namespace ftcs::daemon
