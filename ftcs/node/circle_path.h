// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace ftcs::node {

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
  /// `turn_s` above zero. `start_s`: the radius begins to grow at this instant of the path's time,
  /// so that axes of different segments on one time start together.
  constexpr CirclePath(double radius, double turn_s, double start_s = 0.0) noexcept
      : radius_(radius), turn_s_(turn_s), start_s_(start_s) {}

  /// Once in a cycle, for the instant that it is about.
  void advance(bool all_enabled, double time_s) noexcept {
    const double step = all_enabled ? (time_s < start_s_ ? 0.0 : 1.0) : -1.0;
    gain_ = std::clamp(gain_ + step / kRampCycles, 0.0, 1.0);
    const double angle = 2.0 * std::numbers::pi * std::fmod(time_s, turn_s_) / turn_s_;
    const double radius = gain_ * radius_;
    even_ = static_cast<std::int32_t>(std::lround(radius * std::cos(angle)));
    odd_ = static_cast<std::int32_t>(std::lround(radius * std::sin(angle)));
  }
  /// An axis may be enabled while all stand on their origins.
  [[nodiscard]] bool at_rest() const noexcept { return gain_ == 0.0; }
  [[nodiscard]] bool at_full() const noexcept { return gain_ == 1.0; }
  [[nodiscard]] std::int32_t displacement(std::size_t axis) const noexcept {
    return axis % 2 == 0 ? even_ : odd_;
  }

 private:
  double radius_;
  double turn_s_;
  double start_s_;
  double gain_ = 0.0;
  std::int32_t even_ = 0;
  std::int32_t odd_ = 0;
};

}  // namespace ftcs::node
