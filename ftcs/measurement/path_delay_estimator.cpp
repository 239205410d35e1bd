// SPDX-License-Identifier: MIT
#include "ftcs/measurement/path_delay_estimator.h"

#include <algorithm>

namespace ftcs {
namespace {

/// Farther from its forward partner than the longest usual Sync interval, a backward message says
/// nothing: a rate known to 1e-8 moves by 160 ns.
constexpr Duration kLongestTurnaround = Nanoseconds{16'000'000'000};

/// After so long a silence the rate known before says nothing. (It also bounds what rate_ratio()
/// divides by.)
constexpr Duration kLongestSilence = Nanoseconds{3'600'000'000'000};

/// Two forward messages whose intervals on the two clocks differ by more than this factor are not
/// of one reference: no oscillator is off by half, a jump of the time transmitter is.
constexpr RateLimits kPlausibleRatio{Rate::from_ratio(0.5), Rate::from_ratio(2.0)};

}  // namespace

void PathDelayEstimator::on_forward(ReferenceTime origin, FreeRunningTime received) noexcept {
  const Forward next{origin, received};
  if (forward_count_ > 0) {
    if (received == newest_forward().received) return;
    if (!continues(next)) restart();
  }
  forwards_[forward_next_] = next;
  forward_next_ = (forward_next_ + 1) % kForwards;
  forward_count_ = std::min(forward_count_ + 1, kForwards);
  rate_ratio_ = measure_rate();
  if (has_deferred_ && rate_known()) {
    has_deferred_ = false;
    complete(deferred_);
  }
}

PathDelayUpdate PathDelayEstimator::on_backward(FreeRunningTime sent,
                                                ReferenceTime received) noexcept {
  const Backward backward{sent, received};
  if (forward_count_ == 0 || abs(sent - nearest_forward(sent).received) > kLongestTurnaround) {
    ++counters_.without_partner;
    return {PathDelayVerdict::kNoPartner, {}};
  }
  if (config_.rate_compensated && !rate_known()) {
    deferred_ = backward;
    has_deferred_ = true;
    return {PathDelayVerdict::kDeferred, {}};
  }
  return complete(backward);
}

PathDelayUpdate PathDelayEstimator::complete(const Backward& backward) noexcept {
  const Forward& partner = nearest_forward(backward.sent);
  const Rate ratio = config_.rate_compensated ? rate_ratio() : Rate{};
  const Duration raw = ftcs::mean_path_delay(
      FreeRunningTwoWayExchange{partner.origin, partner.received, backward.sent, backward.received},
      ratio);
  if (raw < config_.lowest) {
    ++counters_.negative;
    return {PathDelayVerdict::kNegative, raw};
  }
  if (raw > config_.highest) {
    ++counters_.absurd;
    return {PathDelayVerdict::kAbsurd, raw};
  }
  filter_.add(raw);
  latest_ = raw;
  ++counters_.used;
  return {PathDelayVerdict::kUsed, raw};
}

Rate PathDelayEstimator::measure_rate() const noexcept {
  std::array<double, kForwards*(kForwards - 1) / 2> deviations{};
  std::size_t count = 0;
  for (std::size_t i = 1; i < forward_count_; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Duration reference = forwards_[i].origin - forwards_[j].origin;
      const Duration local = forwards_[i].received - forwards_[j].received;
      deviations[count] = (reference - local).ns() / local.ns();
      ++count;
    }
  }
  if (count == 0) return Rate{};
  const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(deviations.begin(), middle,
                   deviations.begin() + static_cast<std::ptrdiff_t>(count));
  return Rate::from_ratio(1.0 + *middle);
}

bool PathDelayEstimator::continues(const Forward& next) const noexcept {
  const Duration local = next.received - newest_forward().received;
  const Duration reference = next.origin - newest_forward().origin;
  return local > Duration{} && local <= kLongestSilence &&
         kPlausibleRatio.contains(Rate::from_ratio(reference.ns() / local.ns()));
}

const PathDelayEstimator::Forward& PathDelayEstimator::nearest_forward(
    FreeRunningTime sent) const noexcept {
  const auto distance = [sent](const Forward& forward) { return abs(sent - forward.received); };
  return *std::min_element(
      forwards_.begin(), forwards_.begin() + static_cast<std::ptrdiff_t>(forward_count_),
      [&distance](const Forward& a, const Forward& b) { return distance(a) < distance(b); });
}

void PathDelayEstimator::restart() noexcept {
  forward_next_ = forward_count_ = 0;
  has_deferred_ = false;
  rate_ratio_ = Rate{};
  ++counters_.restarts;
}

void PathDelayEstimator::reset() noexcept {
  const PathDelayCounters counters = counters_;
  *this = PathDelayEstimator{config_};
  counters_ = counters;
}

}  // namespace ftcs
