// SPDX-License-Identifier: MIT
#include "ftcs/daemon/real_clock.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "ftcs/time/duration.h"

namespace ftcs::daemon {
RateLimits steering_limits(const platform::ClockDevice& device, const RateLimits& chosen) {
  constexpr double kUsualPpb = 500e3;
  constexpr RateLimits kNone{};
  const bool none_chosen = chosen.slowest == kNone.slowest && chosen.fastest == kNone.fastest;
  return device.is_system() && none_chosen ? RateLimits::symmetric_ppb(kUsualPpb) : chosen;
}

std::string describe(const std::string& clock, ClockError error) {
  switch (error) {
    case ClockError::kNotPermitted:
      return clock + ": not permitted to steer it";
    case ClockError::kBusy:
      return clock + ": busy, its driver does not answer or refuses to steer it now";
    case ClockError::kGone:
      return clock + ": the device is gone";
    case ClockError::kRateOutOfLimits:
      return clock + ": refuses the rate or step as out of its range";
    case ClockError::kNotFinite:
      break;
  }
  return clock + ": was asked for a rate that is no number";
}

RealClock::RealClock(platform::Kernel& kernel, Log& log, platform::KernelClock clock, UtcConfig utc)
    : kernel_(kernel),
      log_(log),
      clock_(std::move(clock)),
      timer_(kernel),
      utc_(kernel, log, clock_.device().name(), std::move(utc), clock_.device().is_system()),
      kept_rate_(clock_.tracking_rate()) {}

void RealClock::before_wait(std::optional<std::int64_t> at_most_ns) {
  (void)clock_.read();  // what is left of a correction counts from now
  std::optional<std::int64_t> wait = clock_.wait_for_expiry_ns();
  if (at_most_ns) wait = std::min(wait.value_or(*at_most_ns), *at_most_ns);
  if (wait) timer_.set(*wait);
}

void RealClock::on_wake() {
  timer_.acknowledge();
  (void)clock_.read();  // ends what is due
}

std::int64_t RealClock::utc_s() const { return kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond; }

void RealClock::set_reference_scale(const ReferenceScale& scale) {
  utc_.on_announced(scale, utc_s());
  follow_offset();
}

void RealClock::set_fixed_scale(int reference_ahead_of_utc_s, int clock_ahead_of_reference_s) {
  utc_.follower().set_fixed(reference_ahead_of_utc_s);
  clock_.set_timescale_offset(Duration::from_whole_ns(-clock_ahead_of_reference_s * kNsPerSecond));
}

bool RealClock::admits(ReferenceTime reference, FreeRunningTime event) noexcept {
  // What the oscillator did not sleep through it has counted.
  return utc_.admits(reference, event - clock_.ran_asleep(), kernel_.clock_ns(CLOCK_REALTIME));
}

bool RealClock::admits_change(Duration change) const noexcept {
  const node::EpochRules& rules = utc_.config().epoch;
  return rules.largest_change == Nanoseconds{0} || abs(change) <= Duration{rules.largest_change};
}

// The system clock shows UTC. An adapter's shows what its reference does, or TAI by the system
// clock.
void RealClock::follow_offset() {
  const node::UtcFollower& utc = utc_.follower();
  const bool from_utc = utc_.config().reference_is_utc;
  if (!utc.known() || (!is_system() && !from_utc)) return;
  const bool first = !std::exchange(scale_known_, true);
  const std::int64_t offset_s = from_utc ? -utc.utc_offset() : utc.utc_offset();
  const Duration ahead = Duration::from_whole_ns(offset_s * kNsPerSecond);
  if (ahead == clock_.timescale_offset()) return;
  scale_changed_ = !first;
  clock_.set_timescale_offset(ahead);
}

std::optional<std::string> RealClock::attend(bool steering, bool locked,
                                             const ServoSnapshot& servo) {
  if (const auto error = clock_.failure()) return describe(name(), *error);
  const std::int64_t raw_ns = kernel_.clock_ns(CLOCK_MONOTONIC_RAW);
  if (locked) kept_rate_.note(clock_.tracking_rate(), raw_ns);
  was_locked_ = locked;
  const std::int64_t raw_s = raw_ns / kNsPerSecond;
  if (raw_s == attended_raw_s_) return std::nullopt;
  attended_raw_s_ = raw_s;
  report_foreign();
  make_leap_if_due(steering);
  if (scale_known_) {
    utc_.on_time(utc_s());
    const int leap = utc_.follower().expected_leap();
    if (is_system()) clock_.expect_leap(utc_.config().kernel_leap ? leap : 0);
    follow_offset();
  }
  if (is_system() && steering) publish(locked, servo);
  if (is_system() && locked) warn_of_expired_list();  // before, the clock may show anything
  return utc_.gave_up();
}

void RealClock::warn_of_expired_list() {
  const std::optional<LeapSeconds>& list = utc_.config().leap_seconds;
  if (expiry_said_ || !list || !list->expires() || utc_s() <= *list->expires()) return;
  expiry_said_ = true;
  log_(LogLevel::kWarning,
       "{}: the leap second list has expired: a leap second or an offset that only the list would "
       "tell may be missed; install a newer one",
       name());
}

void RealClock::report_foreign() {
  const platform::ForeignSteering foreign = clock_.take_foreign_steering();
  if (foreign.found_rate) {
    log_(LogLevel::kWarning,
         "{}: another program changed the frequency: expected {:+.3f} ppb, found {:+.3f} ppb",
         name(), foreign.expected_rate->ppb(), foreign.found_rate->ppb());
  }
  if (foreign.step) {
    log_(LogLevel::kWarning, "{}: another program stepped the clock by {:+.9f} s", name(),
         foreign.step->seconds());
  }
  if (foreign.leap != 0) {
    utc_.follower().on_leap_done(foreign.leap);
    say_leap(foreign.leap);
  }
}

void RealClock::say_leap(int leap) {
  log_(LogLevel::kNotice, "{}: leap second {}; TAI - UTC is {:.0f} s", name(),
       leap > 0 ? "inserted" : "left out", clock_.timescale_offset().seconds());
}

// One that we make ourselves is late by a turn of the loop at most.
void RealClock::make_leap_if_due(bool steering) {
  const int leap = utc_.follower().expected_leap();
  if (!is_system() || utc_.config().kernel_leap || leap == 0 || !steering) return;
  if (utc_s() < utc_.follower().leap_due_s() - (leap < 0 ? 1 : 0)) return;
  utc_.follower().on_leap_done(leap);
  if (const auto error = clock_.leap_now(leap)) {
    log_(LogLevel::kError, "leap second: {}", describe(name(), *error));
  } else {
    say_leap(leap);
  }
}

void RealClock::publish(bool locked, const ServoSnapshot& servo) {
  platform::TimeStatus status;
  status.synchronised = locked;
  const node::UtcFollower& utc = utc_.follower();
  const int leap = utc.expected_leap();
  status.leap = utc_.config().kernel_leap ? leap : 0;
  // In the second of the leap the kernel changes TAI - UTC itself.
  const bool leaping = leap != 0 && utc_s() >= utc.leap_due_s() - 1;
  if (utc.is_tai() && scale_known_ && !leaping) {
    status.tai_offset = static_cast<int>(clock_.timescale_offset().rounded_ns() / kNsPerSecond);
  }
  const double sigma_ns = std::isfinite(servo.offset_sigma_ns) ? servo.offset_sigma_ns : 0.0;
  const double offset_ns = std::abs(servo.offset.ns());
  constexpr double kNsPerUs = 1e3;
  constexpr double kSigmas = 3.0;
  status.estimated_error_us = std::llround(std::ceil((offset_ns + sigma_ns) / kNsPerUs));
  // Half the way there and back bounds what an asymmetry can hide.
  status.largest_error_us = std::llround(
      std::ceil((offset_ns + kSigmas * sigma_ns + std::abs(servo.path_delay.ns())) / kNsPerUs));
  const int result = platform::publish(kernel_, status);
  if (result < 0 && !publish_failed_) {
    log_(LogLevel::kWarning, "{}: cannot tell the kernel that it is synchronised: {}", name(),
         std::strerror(-result));
  }
  publish_failed_ = result < 0;
}

void RealClock::stop() {
  const Rate kept = kept_rate_.rate();
  if (clock_.is_steered() && !std::exchange(was_locked_, true)) {
    log_(LogLevel::kNotice, "{}: not locked: leaving a rate of {:+.3f} ppb, the last good one",
         name(), kept.ppb());
  }
  clock_.settle_at(kept);
  if (clock_.expiry() && !clock_.failure()) {
    log_(LogLevel::kError, "{}: the kernel refuses to end a correction; its rate is off", name());
  }
}

}  // namespace ftcs::daemon
