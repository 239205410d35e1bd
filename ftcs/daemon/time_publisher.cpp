// SPDX-License-Identifier: MIT
#include "ftcs/daemon/time_publisher.h"

namespace ftcs::daemon {
namespace {

constexpr std::int64_t kShortestNs = 1'000'000'000;
constexpr std::int64_t kLongestNs = 16'000'000'000;

std::int64_t middle(const RawReading& reading) {
  return reading.before_ns + (reading.after_ns - reading.before_ns) / 2;
}
double slack(const RawReading& reading) {
  return static_cast<double>(reading.after_ns - reading.before_ns) / 2.0;
}

ftcs_time_state state_of(TimeBound::State state) {
  switch (state) {
    case TimeBound::State::kUnknown:
      break;
    case TimeBound::State::kUnlocked:
      return FTCS_UNLOCKED;
    case TimeBound::State::kLocked:
      return FTCS_LOCKED;
    case TimeBound::State::kHoldover:
      return FTCS_HOLDOVER;
  }
  return FTCS_UNKNOWN;
}

}  // namespace

void TimePublisher::publish(const TimeBound& bound, const RawReading& reading) {
  if (!anchor_) anchor_ = next_ = reading;
  if (middle(reading) - middle(*next_) > kLongestNs) anchor_ = std::exchange(next_, reading);
  const std::int64_t passed = middle(reading) - middle(*anchor_);
  if (passed < kShortestNs || bound.state == TimeBound::State::kUnknown) return page_.write({});
  const auto passed_ns = static_cast<double>(passed);
  // Near one: the difference keeps its digits.
  const double slope =
      1.0 + ((reading.free_running - anchor_->free_running).ns() - passed_ns) / passed_ns;
  platform::TimePage::Content content;
  content.state = state_of(bound.state);
  content.raw_ns = middle(reading);
  content.time_ns = bound.time_at(reading.free_running).since_epoch().floor_ns();
  content.rate = slope * bound.rate.ratio();
  content.bound_ns = bound.half_width_ns(reading.free_running) + slack(reading) + 1.0;
  content.growth = bound.growth + (slack(reading) + slack(*anchor_)) / passed_ns;
  page_.write(content);
}

}  // namespace ftcs::daemon
