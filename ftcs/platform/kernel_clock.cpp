// SPDX-License-Identifier: MIT
#include "ftcs/platform/kernel_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "ftcs/clock/affine_map.h"
#include "ftcs/clock/command_check.h"
#include "ftcs/time/relabel.h"

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
// A driver that is busy answers again some time, one that does not for so long never.
constexpr std::int64_t kLongestUnreadNs = 10'000'000'000;
// A kernel that refuses is not asked again at once.
constexpr Duration kRetryInterval{Nanoseconds{10'000'000}};
// The kernel keeps the frequency in its own units and may return one unit less.
constexpr double kRateUnit = 2.0e-6 / 65536.0;
// A leap is one second; readings around it may be this far from it.
constexpr double kLeapToleranceNs = 100e6;
// A kernel multiplies the cycles of its counter by an integer: CLOCK_REALTIME runs a little slower
// or faster than asked for, by less than this, until the kernel next looks at what it owes.
constexpr double kLargestWander = 250e-9;
constexpr double kWanderFloorNs = 100.0;
// What remains of it on average is believed so slowly: each command leaves some tenths of a
// nanosecond, as the kernel counts whole ticks.
constexpr double kAnchoringTimeNs = 1.5e9;
constexpr double kLargestShare = 0.25;
constexpr std::int64_t kGainIntervalNs = 1'000'000'000;
constexpr double kLargestGain = 200e-6;
// Sixteen seconds of averaging bring the brackets' noise below 10^-8.
constexpr double kGainWeight = 1.0 / 16.0;

SteeringHistory::Map starting_at(FreeRunningTime free, LocalTime local, Rate rate) noexcept {
  return {free, local, rate};
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
  slept_ns_ = device_.slept_ns();
  const LocalTime local = local_of(reading->clock_ns);
  const FreeRunningTime free = device_.is_system() ? FreeRunningTime::from_ns(reading->raw_ns)
                                                   : relabel<FreeRunningTime>(local);
  history_ = SteeringHistory{starting_at(free, local, held_rate_)};
  latest_ = {free, local};
  latest_raw_ns_ = reading->raw_ns;
  latest_width_ns_ = usual_width_ns_ = reading->width_ns;
  anchor_ = {free, reading->raw_ns, reading->width_ns};
}

Result<ClockDevice::Reading, ClockError> KernelClock::read_device() noexcept {
  auto reading = device_.read();
  if (reading) {
    unread_since_ns_.reset();
    learn_width(reading->width_ns);
    return reading;
  }
  const std::int64_t now = device_.read_raw();
  const std::int64_t since = unread_since_ns_.value_or(now);
  unread_since_ns_ = since;
  if (reading.error() != ClockError::kBusy || now - since > kLongestUnreadNs)
    failure_ = reading.error();
  return reading;
}

// A driver that is busy for a moment is no reason to stop: until it answers again the clock shows
// what its last good reading and the commands since then say.
bool KernelClock::go_on_unread() noexcept {
  if (failure_) return false;
  const std::int64_t raw_ns = device_.read_raw();
  const FreeRunningTime instant = free_at_raw(raw_ns);
  latest_ = {instant, history_.local_at(instant)};
  latest_raw_ns_ = raw_ns;
  latest_width_ns_ = static_cast<std::int64_t>(anchor_doubt_ns(raw_ns));
  return true;
}

FreeRunningTime KernelClock::free_at_raw(std::int64_t raw_ns) const noexcept {
  return anchor_.free + Duration::from_whole_ns(raw_ns - anchor_.raw_ns);
}

double KernelClock::anchor_doubt_ns(std::int64_t raw_ns) const noexcept {
  return kLargestDrift * static_cast<double>(raw_ns - anchor_.raw_ns) +
         static_cast<double>(anchor_.width_ns);
}

KernelClock::Deviation KernelClock::deviation_of(const ClockDevice::Reading& now) const noexcept {
  const FreeRunningTime instant = free_at_raw(now.raw_ns);
  const double floor_ns =
      static_cast<double>(device_.is_system() ? kStepFloorSystemNs : kStepFloorPhcNs);
  const double allowed = anchor_doubt_ns(now.raw_ns) + static_cast<double>(now.width_ns) + floor_ns;
  const Duration by = local_of(now.clock_ns) - history_.local_at(instant);
  return {instant, by, std::abs(by.ns()) > allowed};
}

// What looks like a step is looked at again: whatever a single reading says, history is not changed
// by it. Of two readings that agree the narrower one says how far it went.
std::optional<ClockError> KernelClock::confirm_step(ClockDevice::Reading& now) noexcept {
  constexpr int kAttempts = 3;
  for (int i = 0; i < kAttempts; ++i) {
    const auto again = read_device();
    if (!again) return again.error();
    if (!deviation_of(*again).is_step) {
      now = *again;
      return std::nullopt;
    }
    if (again->width_ns <= now.width_ns) now = *again;
    if (!is_wide(now.width_ns)) return std::nullopt;
  }
  return std::nullopt;
}

// What a bracket is wider by than usual lies on one side of the clock or on the other: only what
// goes beyond that is believed. An interrupt makes it wide; a second that has just passed makes
// each reading after it a little longer, and its middle wrong by the same each time.
Duration KernelClock::beyond_bracket(Duration deviation,
                                     const ClockDevice::Reading& reading) const noexcept {
  const auto surplus = static_cast<double>(reading.width_ns - usual_width_ns_);
  const double half = std::max(surplus, 0.0) / 2.0;
  return deviation - Duration::from_ns(std::clamp(deviation.ns(), -half, half));
}

// The median of the last ones, in steps of a nanosecond.
void KernelClock::learn_width(std::int64_t width_ns) noexcept {
  usual_width_ns_ += width_ns > usual_width_ns_ ? 1 : width_ns < usual_width_ns_ ? -1 : 0;
}

// The part of a deviation of CLOCK_REALTIME that what was commanded has to follow. The rest is the
// kernel's to make good: a servo that did so too would do it twice.
Duration KernelClock::not_made_good(Duration deviation,
                                    std::int64_t elapsed_raw_ns) const noexcept {
  const auto elapsed = static_cast<double>(elapsed_raw_ns);
  const double bound = kWanderFloorNs + kLargestWander * elapsed;
  const double wander = std::clamp(deviation.ns(), -bound, bound);
  const double share = std::min(elapsed / kAnchoringTimeNs, kLargestShare);
  return deviation - Duration::from_ns(wander * (1.0 - share));
}

// One reading of the device, made sense of: small deviations from what the commands say are the
// kernel's (CLOCK_REALTIME) or cannot be seen (a hardware clock); large ones are somebody's step.
bool KernelClock::look() noexcept {
  if (failure_) return false;
  auto now = read_device();
  if (!now) return go_on_unread();
  if (deviation_of(*now).is_step && confirm_step(*now)) return go_on_unread();
  const Deviation deviation = deviation_of(*now);
  if (const std::int64_t slept = newly_slept_ns(); slept > 0 && !device_.is_system()) {
    // The adapter's clock went on, or stood still with the machine: either way by itself.
    const auto length = Duration::from_whole_ns(slept);
    if (deviation.by > length.half()) ran_asleep_ += length;
    rate_steps_.restart();
  } else if (deviation.is_step) {
    note_leap_or_step(deviation, *now);
  } else if (device_.is_system()) {
    const Duration seen = wander_ + beyond_bracket(deviation.by - wander_, *now);
    const Duration shift = not_made_good(seen, now->raw_ns - latest_raw_ns_);
    history_.shift_newest(shift);
    wander_ = seen - shift;
    learn_gain(shift, *now);
  }
  take(*now, deviation.instant);
  return true;
}

void KernelClock::take(const ClockDevice::Reading& now, FreeRunningTime instant) noexcept {
  const LocalTime local = local_of(now.clock_ns);
  latest_ = device_.is_system() ? ClockReading{instant, history_.local_at(instant)}
                                : ClockReading{history_.free_running_at(local), local};
  latest_raw_ns_ = now.raw_ns;
  latest_width_ns_ = now.width_ns;
  if (!device_.is_system() && !is_wide(now.width_ns))
    rate_steps_.on_reading(held_rate_.deviation(), now.raw_ns, now.clock_ns);
  if (static_cast<double>(now.width_ns) <= anchor_doubt_ns(now.raw_ns)) {
    anchor_ = {latest_.free_running, now.raw_ns, now.width_ns};
  }
}

void KernelClock::note_leap_or_step(const Deviation& deviation,
                                    const ClockDevice::Reading& now) noexcept {
  constexpr double kSecondNs = 1e9;
  if (expected_leap_ != 0 &&
      std::abs(deviation.by.ns() + expected_leap_ * kSecondNs) < kLeapToleranceNs) {
    timescale_offset_ += Duration::from_ns(expected_leap_ * kSecondNs);
    foreign_.leap = std::exchange(expected_leap_, 0);
    trusted_since_ns_ = std::numeric_limits<std::int64_t>::min();
    return;
  }
  history_.steer(deviation.instant, history_.rate_at(deviation.instant), deviation.by);
  ++foreign_steps_;
  foreign_.step = foreign_.step.value_or(Duration{}) + deviation.by;
  trusted_since_ns_ = now.clock_ns;
  wander_ = {};
  rate_steps_.restart();
  forget_gain_interval();
}

void KernelClock::forget_gain_interval() noexcept {
  gain_deviation_ = {};
  gain_elapsed_ns_ = 0;
}

void KernelClock::learn_gain(Duration deviation, const ClockDevice::Reading& now) noexcept {
  if (!has_steered_) return;
  if (is_wide(now.width_ns) || is_wide(latest_width_ns_)) return forget_gain_interval();
  gain_deviation_ += deviation;
  gain_elapsed_ns_ += now.raw_ns - latest_raw_ns_;
  if (gain_elapsed_ns_ < kGainIntervalNs) return;
  const double surplus = gain_deviation_.ns() / static_cast<double>(gain_elapsed_ns_);
  gain_ = std::clamp(gain_ + kGainWeight * surplus, 1.0 - kLargestGain, 1.0 + kLargestGain);
  forget_gain_interval();
}

ClockReading KernelClock::read() noexcept {
  if (!look()) return latest_;
  if (end_ && *end_ - latest_.free_running <= kTimerGrain) end_correction();
  return latest_;
}

std::optional<FreeRunningTime> KernelClock::from_stamp(std::int64_t clock_ns) noexcept {
  const ClockReading now = read();
  const LocalTime local = local_of(clock_ns) - wander_;
  if (clock_ns < trusted_since_ns_) return std::nullopt;
  const std::int64_t doubt_ns = latest_width_ns_ + kReadingToleranceNs;
  if (local - now.local > Duration::from_whole_ns(doubt_ns)) return std::nullopt;
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
  ++foreign_rates_;
  rate_steps_.restart();
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
  if (std::exchange(end_, std::nullopt)) note_lateness({});
  if (corrects) end_ = latest_.free_running + correction_length(command);
  return latest_;
}

// What the clock makes of it is the rate that was meant: of the system clock on average, of a
// hardware clock as far as its steps allow.
Rate KernelClock::settable(Rate rate) const noexcept {
  if (device_.is_system()) return Rate::from_ratio(rate.ratio() / gain_);
  return Rate::from_ratio(1.0 + rate_steps_.steps().nearest(rate.deviation()));
}

Result<Rate, ClockError> KernelClock::command(Rate rate, Duration step) noexcept {
  const auto failed = [this](ClockError error) {
    if (error == ClockError::kGone) failure_ = error;
    return error;
  };
  const auto set = device_.set_rate(limits_.clamp(settable(rate)));
  if (!set) return failed(set.error());
  if (step == Duration{}) return *set;
  if (const auto error = device_.step(step)) {
    (void)device_.set_rate(held_rate_);  // on an error nothing has changed
    return failed(*error);
  }
  return *set;
}

// The change lies between two readings of CLOCK_MONOTONIC_RAW: in the middle, as far as we know,
// and after what has been read of the clock before.
std::optional<ClockError> KernelClock::change_rate(Rate rate, Duration step) noexcept {
  const Duration whole_step = Duration::from_whole_ns(step.rounded_ns());
  const double old_ratio = history_.rate_at(latest_.free_running).ratio();
  const std::int64_t before = device_.read_raw();
  const auto set = command(rate, whole_step);
  if (!set) return set.error();
  const std::int64_t half_ns = (device_.read_raw() - before) / 2;
  const Rate effective = device_.is_system() ? Rate::from_ratio(set->ratio() * gain_) : *set;
  const double doubt_ns = std::abs(effective.ratio() - old_ratio) * static_cast<double>(half_ns);
  rate_steps_.on_change(held_rate_.deviation(), before + half_ns, doubt_ns);
  if (whole_step != Duration{}) rate_steps_.restart();
  held_rate_ = *set;
  has_steered_ = true;
  history_.steer(std::max(free_at_raw(before + half_ns), latest_.free_running), effective,
                 whole_step);
  const auto after = read_device();
  if (after) {
    place_change(*after, doubt_ns);
  } else if (!go_on_unread()) {
    return failure_;
  }
  return std::nullopt;
}

// The reading after a change says where in between it lay: always of CLOCK_REALTIME, which is read
// together with its own oscillator; of a hardware clock if the command was held up for longer than
// readings are wide.
void KernelClock::place_change(const ClockDevice::Reading& after, double doubt_ns) noexcept {
  const FreeRunningTime instant = free_at_raw(after.raw_ns);
  const Duration seen = local_of(after.clock_ns) - wander_ - history_.local_at(instant);
  const double resolution =
      device_.is_system() ? 0.0
                          : anchor_doubt_ns(after.raw_ns) + static_cast<double>(after.width_ns);
  if (doubt_ns > resolution) {
    const double believed = device_.is_system() ? beyond_bracket(seen, after).ns() : seen.ns();
    history_.shift_newest(Duration::from_ns(std::clamp(believed, -doubt_ns, doubt_ns)));
  }
  take(after, instant);
}

// On an error the correction goes on; the next command, or a reading a little later, tries again.
// Before our rate replaces another one, whoever set that is noticed.
void KernelClock::end_correction() noexcept {
  note_lateness(latest_.free_running - *std::exchange(end_, std::nullopt));
  check_rate();
  const auto error = change_rate(tracking_rate_, Duration{});
  if (!error) return;
  if (*error == ClockError::kNotPermitted) failure_ = *error;
  end_ = latest_.free_running + kRetryInterval;
}

void KernelClock::settle() noexcept {
  constexpr int kAttempts = 5;
  for (int i = 0; end_ && i < kAttempts && look(); ++i) end_correction();
}

void KernelClock::settle_at(Rate rate) noexcept {
  if (!has_steered_ || rate == tracking_rate_) return settle();
  tracking_rate_ = limits_.clamp(rate);
  end_ = latest_.free_running;
  settle();
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
