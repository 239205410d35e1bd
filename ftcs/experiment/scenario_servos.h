// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "ftcs/experiment/scenario.h"
#include "ftcs/experiment/toml_table.h"

namespace ftcs::experiment {

/// step = "never", "first" or "always", and step_threshold.
[[nodiscard]] StepPolicy read_step_policy(TomlTable& clock);

/// The servos of a scenario: the names in `servos` (default: every servo), each [[servo]], and at
/// the end the known-noise Kalman bound with the noise of [bound] or, where that is silent, of
/// [clock] and [path].
void read_servos(TomlTable& root, Scenario& scenario);

/// The servo of a library in this scenario, set as any other servo of it.
[[nodiscard]] ScenarioServo external_servo(std::shared_ptr<const ServoLibrary> library,
                                           const Scenario& scenario);

}  // namespace ftcs::experiment
