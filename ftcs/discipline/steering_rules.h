// SPDX-License-Identifier: MIT
#pragma once

namespace ftcs {

/// What may be asked of the clock beyond the limits that every servo has of its own.
struct SteeringRules {
  double largest_rate_change = 0.0;  ///< at a time, dimensionless; 0: any
  bool never_step = false;           ///< whatever else permits a step
};

}  // namespace ftcs
