// SPDX-License-Identifier: MIT
#include "ftcs/measurement/outlier_gate.h"

#include <algorithm>
#include <cmath>

#include "ftcs/measurement/order_statistic.h"

namespace ftcs {
GateDecision OutlierGate::decide(Duration innovation) noexcept {
  const double innovation_ns = innovation.ns();
  const bool was_warm = warm();
  const double centre = median_of(innovations_);
  const bool usual = std::abs(innovation_ns - centre) <= config_.width * spread_about(centre);
  learn(innovation_ns);
  if (!was_warm || usual) {
    rejected_in_a_row_ = 0;
    ++counters_.accepted;
    return GateDecision::kAccept;
  }
  ++rejected_in_a_row_;
  if (rejected_in_a_row_ < config_.rejections_to_exit) {
    ++counters_.rejected;
    return GateDecision::kReject;
  }
  rejected_in_a_row_ = 0;
  ++counters_.exits;
  return GateDecision::kExit;
}

double OutlierGate::spread_ns() const noexcept { return spread_about(median_of(innovations_)); }

void OutlierGate::learn(double innovation_ns) noexcept {
  innovations_[next_] = innovation_ns;
  next_ = (next_ + 1) % kMemory;
  size_ = std::min(size_ + 1, kMemory);
}

// The upper one of two middle values; zero if there is none.
double OutlierGate::median_of(Values values) const noexcept {
  const auto size = static_cast<std::ptrdiff_t>(size_);
  return order_statistic(values, size, size / 2);
}

double OutlierGate::spread_about(double centre) const noexcept {
  Values deviations{};
  std::transform(innovations_.begin(), innovations_.end(), deviations.begin(),
                 [centre](double value) { return std::abs(value - centre); });
  const auto resolution_ns = static_cast<double>(config_.resolution.count());
  return std::max(kMadToSigma * median_of(deviations), resolution_ns);
}

void OutlierGate::reset() noexcept {
  const GateCounters counters = counters_;
  *this = OutlierGate{config_};
  counters_ = counters;
}

}  // namespace ftcs
