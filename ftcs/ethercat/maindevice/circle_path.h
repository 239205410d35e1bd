// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace ftcs::ethercat {

/// Axes that draw circles, two by two, all from one time:
///
///   even axes  r(t) cos(2 pi t / turn),  odd axes  r(t) sin(2 pi t / turn),  in counts.
///
/// r grows from zero to the radius in kRampCycles cycles while all axes are enabled, and shrinks as
/// smoothly when one falls out: nobody jumps, and the one that comes back finds the others where it
/// starts itself.
class CirclePath {
 public:
  static constexpr double kRampCycles = 1000.0;
  /// `turn_s` above zero.
  constexpr CirclePath(double radius, double turn_s) noexcept : radius_(radius), turn_s_(turn_s) {}

  /// Once in a cycle.
  void advance(bool all_enabled) noexcept {
    gain_ = std::clamp(gain_ + (all_enabled ? 1.0 : -1.0) / kRampCycles, 0.0, 1.0);
  }
  /// An axis may be enabled while all stand on their origins.
  [[nodiscard]] bool at_rest() const noexcept { return gain_ == 0.0; }
  [[nodiscard]] std::int32_t displacement(std::size_t axis, double time_s) const noexcept {
    const double angle = 2.0 * std::numbers::pi * std::fmod(time_s, turn_s_) / turn_s_;
    const double part = axis % 2 == 0 ? std::cos(angle) : std::sin(angle);
    return static_cast<std::int32_t>(std::lround(gain_ * radius_ * part));
  }

 private:
  double radius_;
  double turn_s_;
  double gain_ = 0.0;
};

}  // namespace ftcs::ethercat
