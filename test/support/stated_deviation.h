// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

#include "ftcs/estimation/load_aware_estimator.h"

namespace ftcs::test {

/// An estimator that hears two messages a cycle, one of each direction, and how often its error
/// lies within 1, 2 and 3 of the deviations that it states.
class StatedDeviation {
 public:
  /// A new estimator; what was counted stays.
  void begin() { estimator_ = Estimator(); }
  /// The clock is at `x` when message `i` arrives `delay` after it was sent, ns.
  void hear(int i, double x, double delay) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    (void)estimator_.update({.sign = sign, .elapsed = 0.5, .z = x + sign * delay});
  }
  void count(double x) {
    const double error = std::abs(estimator_.estimate().x - x) / sigma();
    for (std::size_t k = 0; k < 3; ++k) inside_[k] += error < static_cast<double>(k + 1) ? 1 : 0;
    ++counted_;
  }
  [[nodiscard]] double sigma() const { return estimator_.offset_sigma_ns(0.0); }
  [[nodiscard]] double within(std::size_t sigma) const { return inside_[sigma - 1] / counted_; }
  void print(const char* world) const {
    std::printf("%s: %.1f %.1f %.2f %%\n", world, 100.0 * within(1), 100.0 * within(2),
                100.0 * within(3));
  }

 private:
  using Estimator = estimation::LoadAwareEstimator<estimation::FullGrid>;

  Estimator estimator_;
  std::array<double, 3> inside_{};
  double counted_ = 0.0;
};

}  // namespace ftcs::test
