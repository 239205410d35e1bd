// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/experiment/scenario.h"
#include "ftcs/experiment/toml_table.h"

namespace ftcs::experiment {

/// step = "never", "first" or "always", and step_threshold.
[[nodiscard]] StepPolicy read_step_policy(TomlTable& clock);

/// The servos of a scenario: the names in `servos` (default: every servo), each [[servo]], and at
/// the end the known-noise Kalman bound with the noise of [bound] or, where that is silent, of
/// [clock] and [path].
void read_servos(TomlTable& root, Scenario& scenario);

}  // namespace ftcs::experiment
