// SPDX-License-Identifier: MIT
#include "ftcs/platform/kernel_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "ftcs/clock/affine_map.h"
#include "ftcs/clock/command_check.h"

namespace ftcs::platform {
namespace {

// Two oscillators, or one under a frequency that somebody else has just changed, differ by no more;
// what goes beyond is a step.
constexpr double kLargestDrift = 1000e-6;
// A hardware clock is watched by another oscillator and read over a bus.
constexpr std::int64_t kStepFloorSystemNs = 50'000;
constexpr std::int64_t kStepFloorPhcNs = 1'000'000;
// What two readings may disagree by beyond their brackets.
constexpr std::int64_t kReadingToleranceNs = 1'000;
// A timer cannot be set more finely: a correction that has less than this to go ends now.
constexpr Duration kTimerGrain = Nanoseconds{500};
// A kernel that refuses is not asked again at once.
constexpr Duration kRetryInterval{Nanoseconds{10'000'000}};
// The kernel keeps the frequency in its own units and may return one unit less.
constexpr double kRateUnit = 2.0e-6 / 65536.0;
// A leap is one second; readings around it may be this far from it.
constexpr double kLeapToleranceNs = 100e6;
constexpr std::int64_t kGainIntervalNs = 1'000'000'000;
constexpr double kLargestGain = 200e-6;
// Sixteen seconds of averaging bring the brackets' noise below 10^-8.
constexpr double kGainWeight = 1.0 / 16.0;

SteeringHistory::Map starting_at(FreeRunningTime free, LocalTime local, Rate rate) noexcept {
  return {free, local, rate};
}

// A bracket that an interrupt has made wide says less: only what lies outside of it is believed.
Duration beyond_bracket(Duration deviation, std::int64_t width_ns) noexcept {
  constexpr double kUsualWidthNs = 1'000.0;
  const double slack = std::max(0.0, (static_cast<double>(width_ns) - kUsualWidthNs) / 2.0);
  if (slack == 0.0) return deviation;
  const double ns = deviation.ns();
  return Duration::from_ns(ns - std::clamp(ns, -slack, slack));
}

}  // namespace

KernelClock::KernelClock(ClockDevice device, const RateLimits& limits, bool may_steer)
    : device_(std::move(device)),
      limits_(intersect(intersect(limits, device_.rate_limits()), FixedRate::kLimits)),
      may_steer_(may_steer),
      history_(SteeringHistory::Map{}),
      trusted_since_ns_(std::numeric_limits<std::int64_t>::min()) {
  const auto rate = device_.rate();
  const auto reading = device_.read();
  if (!rate || !reading) {
    failure_ = rate ? reading.error() : rate.error();
    return;
  }
  held_rate_ = tracking_rate_ = *rate;
  const LocalTime local = local_of(reading->clock_ns);
  const FreeRunningTime free = device_.is_system() ? FreeRunningTime::from_ns(reading->raw_ns)
                                                   : FreeRunningTime{local.since_epoch()};
  history_ = SteeringHistory{starting_at(free, local, held_rate_)};
  latest_ = {free, local};
  latest_raw_ns_ = reading->raw_ns;
}

// One reading of the device, made sense of: small deviations from what the commands say are the
// truth (CLOCK_REALTIME) or cannot be seen (a hardware clock); large ones are somebody's step.
std::optional<KernelClock::Faces> KernelClock::look() noexcept {
  if (failure_) return std::nullopt;
  const auto now = device_.read();
  if (!now) {
    failure_ = now.error();
    return std::nullopt;
  }
  const bool system = device_.is_system();
  const std::int64_t elapsed_raw = now->raw_ns - latest_raw_ns_;
  const FreeRunningTime by_raw = system
                                     ? FreeRunningTime::from_ns(now->raw_ns)
                                     : latest_.free_running + Duration::from_whole_ns(elapsed_raw);
  const Duration deviation = local_of(now->clock_ns) - history_.local_at(by_raw);
  const double allowed = kLargestDrift * static_cast<double>(elapsed_raw) +
                         static_cast<double>(now->width_ns) +
                         static_cast<double>(system ? kStepFloorSystemNs : kStepFloorPhcNs);
  if (std::abs(deviation.ns()) > allowed) {
    note_leap_or_step(deviation, *now, by_raw);
  } else if (system) {
    const Duration seen = beyond_bracket(deviation, now->width_ns);
    history_.shift_newest(seen);
    learn_gain(seen, elapsed_raw);
  }
  const LocalTime local = local_of(now->clock_ns);
  latest_ = system ? ClockReading{by_raw, history_.local_at(by_raw)}
                   : ClockReading{history_.free_running_at(local), local};
  latest_raw_ns_ = now->raw_ns;
  return Faces{latest_, now->raw_ns};
}

void KernelClock::note_leap_or_step(Duration deviation, const ClockDevice::Reading& now,
                                    FreeRunningTime instant) noexcept {
  constexpr double kSecondNs = 1e9;
  if (expected_leap_ != 0 &&
      std::abs(deviation.ns() + expected_leap_ * kSecondNs) < kLeapToleranceNs) {
    timescale_offset_ += Duration::from_ns(expected_leap_ * kSecondNs);
    foreign_.leap = std::exchange(expected_leap_, 0);
    trusted_since_ns_ = std::numeric_limits<std::int64_t>::min();
    return;
  }
  history_.steer(instant, history_.rate_at(instant), deviation);
  ++foreign_steps_;
  foreign_.step = foreign_.step.value_or(Duration{}) + deviation;
  trusted_since_ns_ = now.clock_ns;
  gain_deviation_ = {};
  gain_elapsed_ns_ = 0;
}

void KernelClock::learn_gain(Duration deviation, std::int64_t elapsed_raw_ns) noexcept {
  if (!has_steered_) return;
  gain_deviation_ += deviation;
  gain_elapsed_ns_ += elapsed_raw_ns;
  if (gain_elapsed_ns_ < kGainIntervalNs) return;
  const double surplus = gain_deviation_.ns() / static_cast<double>(gain_elapsed_ns_);
  gain_ = std::clamp(gain_ + kGainWeight * surplus, 1.0 - kLargestGain, 1.0 + kLargestGain);
  gain_deviation_ = {};
  gain_elapsed_ns_ = 0;
}

ClockReading KernelClock::read() noexcept {
  const auto seen = look();
  if (!seen) return latest_;
  if (end_ && *end_ - seen->reading.free_running <= kTimerGrain) end_correction();
  return latest_;
}

std::optional<FreeRunningTime> KernelClock::from_stamp(std::int64_t clock_ns) noexcept {
  const ClockReading now = read();
  const LocalTime local = local_of(clock_ns);
  if (clock_ns < trusted_since_ns_) return std::nullopt;
  if (local - now.local > Duration::from_whole_ns(kReadingToleranceNs)) return std::nullopt;
  return history_.free_running_at(local);
}

std::optional<std::int64_t> KernelClock::wait_for_expiry_ns() noexcept {
  if (!end_ || failure_) return std::nullopt;
  const double remaining = (*end_ - latest_.free_running).ns();
  return static_cast<std::int64_t>(std::max(remaining * std::min(held_rate_.ratio(), 1.0), 0.0));
}

void KernelClock::check_rate() noexcept {
  if (!has_steered_) return;
  const auto found = device_.rate();
  if (!found) return;  // the command that follows will say why
  if (std::abs(found->ratio() - held_rate_.ratio()) <= kRateUnit) return;
  foreign_.expected_rate = held_rate_;
  foreign_.found_rate = *found;
  held_rate_ = *found;
  history_.steer(latest_.free_running, *found);
}

Result<ClockReading, ClockError> KernelClock::apply(const ServoCommand& command) noexcept {
  if (failure_) return *failure_;
  if (!may_steer_) return ClockError::kNotPermitted;
  if (const auto error = find_error(command, limits_)) return *error;
  const bool corrects = has_correction(command);
  if (!look()) return *failure_;
  check_rate();
  const auto error =
      change_rate(corrects ? command.correction_rate : command.tracking_rate, command.step);
  if (error) return *error;
  tracking_rate_ = command.tracking_rate;
  end_.reset();
  if (corrects) end_ = latest_.free_running + correction_length(command);
  return latest_;
}

// The change lies between a reading before and one after it: in the middle, as far as we know.
std::optional<ClockError> KernelClock::change_rate(Rate rate, Duration step) noexcept {
  const ClockReading before = latest_;
  const std::int64_t raw_before = latest_raw_ns_;
  const bool system = device_.is_system();
  const Rate wanted = system ? limits_.clamp(Rate::from_ratio(rate.ratio() / gain_)) : rate;
  const auto set = device_.set_rate(wanted);
  if (!set) {
    if (set.error() == ClockError::kGone) failure_ = set.error();
    return set.error();
  }
  const Duration whole_step = Duration::from_whole_ns(step.rounded_ns());
  if (whole_step != Duration{}) {
    if (const auto error = device_.step(whole_step)) {
      (void)device_.set_rate(held_rate_);  // on an error nothing has changed
      if (*error == ClockError::kGone) failure_ = *error;
      return error;
    }
  }
  held_rate_ = *set;
  has_steered_ = true;
  const auto after = device_.read();
  if (!after) return failure_ = after.error();
  const Duration elapsed = system ? Duration::from_whole_ns(after->raw_ns - raw_before)
                                  : local_of(after->clock_ns) - before.local - whole_step;
  const FreeRunningTime changed = before.free_running + elapsed.half();
  const Rate effective = system ? Rate::from_ratio(set->ratio() * gain_) : *set;
  history_.steer(changed, effective, whole_step);
  const LocalTime local = local_of(after->clock_ns);
  if (system) {
    const auto free = FreeRunningTime::from_ns(after->raw_ns);
    history_.shift_newest(local - history_.local_at(free));
    latest_ = {free, local};
  } else {
    latest_ = {history_.free_running_at(local), local};
  }
  latest_raw_ns_ = after->raw_ns;
  return std::nullopt;
}

// On an error the correction goes on; the next command, or a reading a little later, tries again.
void KernelClock::end_correction() noexcept {
  end_.reset();
  const auto error = change_rate(tracking_rate_, Duration{});
  if (!error) return;
  if (*error == ClockError::kNotPermitted) failure_ = *error;
  end_ = latest_.free_running + kRetryInterval;
}

void KernelClock::settle() noexcept {
  if (end_ && look()) end_correction();
}

void KernelClock::set_timescale_offset(Duration ahead) noexcept {
  const Duration change = ahead - timescale_offset_;
  if (change == Duration{}) return;
  timescale_offset_ = ahead;
  latest_.local = latest_.local + change;
  history_ = SteeringHistory{
      starting_at(latest_.free_running, latest_.local, history_.rate_at(latest_.free_running))};
}

std::optional<ClockError> KernelClock::leap_now(int leap) noexcept {
  if (failure_) return failure_;
  if (!may_steer_) return ClockError::kNotPermitted;
  const Duration second = Duration::from_ns(leap * 1e9);
  if (const auto error = device_.step(-second)) return error;
  timescale_offset_ += second;
  expected_leap_ = 0;
  return std::nullopt;
}

ForeignSteering KernelClock::take_foreign_steering() noexcept {
  if (look()) check_rate();
  return std::exchange(foreign_, {});
}

}  // namespace ftcs::platform
