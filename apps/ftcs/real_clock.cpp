// SPDX-License-Identifier: MIT
#include "apps/ftcs/real_clock.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace ftcs::app {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kSecondsPerDay = 86'400;
/// A leap that has not come so long after its time does not come any more.
constexpr std::int64_t kPatienceS = 10;
/// So long after a leap a reference, or who tells us of it, may still speak of the time before.
constexpr std::int64_t kLaggardS = 90;

}  // namespace

std::string describe(const std::string& clock, ClockError error) {
  switch (error) {
    case ClockError::kNotPermitted:
      return clock + ": not permitted to steer it";
    case ClockError::kBusy:
      return clock + ": busy, the kernel refuses to steer it now";
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
      utc_(std::move(utc)),
      good_rate_(clock_.tracking_rate()) {}

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

void RealClock::set_reference_scale(const ReferenceScale& scale) {
  const bool first = !std::exchange(scale_known_, true);
  const ReferenceScale old = std::exchange(scale_, scale);
  if (!is_system()) return;
  if (scale.tai && !scale.utc_offset && (first || old.utc_offset)) {
    log_(LogLevel::kNotice, "{}: the reference does not vouch for its UTC offset; using {} s{}",
         name(), utc_offset_at(kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond),
         utc_.leap_seconds ? " of the leap second list" : "");
  }
  follow_scale();
}

int RealClock::utc_offset_at(std::int64_t utc_s) const {
  if (!utc_.leap_seconds) return utc_.utc_offset;
  // The clock that is asked is the one to be set: it may show anything.
  const auto listed =
      utc_.leap_seconds->at(std::max(utc_s, utc_.leap_seconds->updated().value_or(utc_s)));
  return listed ? listed->utc_offset : utc_.utc_offset;
}

void RealClock::follow_scale() {
  if (!scale_known_) return;
  const std::int64_t utc_s = kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond;
  const int offset = !scale_.tai ? 0 : scale_.utc_offset.value_or(utc_offset_at(utc_s));
  const int now = static_cast<int>(clock_.timescale_offset().rounded_ns() / kNsPerSecond);
  const bool first = !std::exchange(scale_followed_, true);
  if (offset == now) return;
  if (armed_leap_ != 0 && offset == now + armed_leap_) return;  // the leap itself will bring it
  if (utc_s < no_leap_before_s_ && offset == now - last_leap_) return;  // not yet told of the leap
  log_(first ? LogLevel::kInfo : LogLevel::kWarning, "{}: UTC is {} s behind the reference", name(),
       offset);
  scale_changed_ = !first;
  clock_.set_timescale_offset(Duration::from_whole_ns(offset * kNsPerSecond));
}

std::optional<std::string> RealClock::attend(bool steering, bool locked,
                                             const ServoSnapshot& servo) {
  if (const auto error = clock_.failure()) return describe(name(), *error);
  if (locked) good_rate_ = clock_.tracking_rate();
  const std::int64_t raw_s = kernel_.clock_ns(CLOCK_MONOTONIC_RAW) / kNsPerSecond;
  if (raw_s == attended_raw_s_) return std::nullopt;
  attended_raw_s_ = raw_s;
  report_foreign();
  if (is_system()) {
    follow_leap(steering);
    follow_scale();
    if (steering) publish(locked, servo);
    if (locked) warn_of_expired_list();  // before, the clock may show anything
  }
  return std::nullopt;
}

void RealClock::warn_of_expired_list() {
  if (expiry_said_ || !utc_.leap_seconds || !utc_.leap_seconds->expires()) return;
  if (kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond <= *utc_.leap_seconds->expires()) return;
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
    leap_is_done(foreign.leap);
    log_(LogLevel::kNotice, "{}: leap second {}; TAI - UTC is {:.0f} s", name(),
         foreign.leap > 0 ? "inserted" : "left out", clock_.timescale_offset().seconds());
  }
}

// Announce is believed, and else the list; either on days alone on which leap seconds happen.
int RealClock::armed_leap(std::int64_t utc_s) const {
  if (!scale_.tai || utc_s < no_leap_before_s_ || !is_last_day_of_month(utc_s)) return 0;
  if (scale_.leap != 0) return scale_.leap;
  // A reference that is a little ahead has leapt already, and tells only the new offset.
  const auto now = static_cast<int>(clock_.timescale_offset().rounded_ns() / kNsPerSecond);
  if (armed_leap_ != 0 && scale_.utc_offset == now + armed_leap_) return armed_leap_;
  if (!utc_.leap_seconds) return 0;
  const auto listed = utc_.leap_seconds->at(utc_s);
  return listed ? listed->leap : 0;
}

// An inserted second is the day's last one again, and Announce may go on announcing it for a while.
void RealClock::leap_is_done(int leap) {
  armed_leap_ = 0;
  last_leap_ = leap;
  no_leap_before_s_ = armed_midnight_s_ + kLaggardS;
  utc_.utc_offset += leap;
}

void RealClock::follow_leap(bool steering) {
  const std::int64_t utc_s = kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond;
  // One that we make ourselves is late by a turn of the loop at most.
  const bool ours_is_due = !utc_.kernel_leap && armed_leap_ != 0 && steering &&
                           utc_s >= armed_midnight_s_ - (armed_leap_ < 0 ? 1 : 0);
  if (ours_is_due) {
    const int leap = armed_leap_;
    leap_is_done(leap);
    if (const auto error = clock_.leap_now(leap)) {
      log_(LogLevel::kError, "leap second: {}", describe(name(), *error));
    } else {
      log_(LogLevel::kNotice, "{}: leap second {}; TAI - UTC is {:.0f} s", name(),
           leap > 0 ? "inserted" : "left out", clock_.timescale_offset().seconds());
    }
    return;
  }
  const int leap = armed_leap(utc_s);
  if (leap == armed_leap_) return;
  // In the last second the kernel is already about to leap: too late to think again.
  const bool is_happening =
      utc_s >= armed_midnight_s_ - 1 && utc_s < armed_midnight_s_ + kPatienceS;
  if (armed_leap_ != 0 && leap == 0 && is_happening) return;
  armed_leap_ = leap;
  armed_midnight_s_ = (utc_s / kSecondsPerDay + 1) * kSecondsPerDay;
  clock_.expect_leap(utc_.kernel_leap ? leap : 0);
  if (leap != 0) {
    log_(LogLevel::kNotice, "{}: a leap second will be {} at the end of this UTC day", name(),
         leap > 0 ? "inserted" : "left out");
  }
}

void RealClock::publish(bool locked, const ServoSnapshot& servo) {
  platform::TimeStatus status;
  status.synchronised = locked;
  status.leap = utc_.kernel_leap ? armed_leap_ : 0;
  // In the second of the leap the kernel changes TAI - UTC itself.
  const bool leaping =
      armed_leap_ != 0 && kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond >= armed_midnight_s_ - 1;
  if (scale_.tai && scale_known_ && !leaping) {
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
  if (clock_.is_steered() && clock_.tracking_rate() != good_rate_) {
    log_(LogLevel::kNotice, "{}: not locked: leaving a rate of {:+.3f} ppb, the last good one",
         name(), good_rate_.ppb());
  }
  clock_.settle_at(good_rate_);
  if (clock_.expiry() && !clock_.failure()) {
    log_(LogLevel::kError, "{}: the kernel refuses to end a correction; its rate is off", name());
  }
}

}  // namespace ftcs::app
