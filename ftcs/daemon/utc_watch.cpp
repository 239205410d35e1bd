// SPDX-License-Identifier: MIT
#include "ftcs/daemon/utc_watch.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "ftcs/time/duration.h"

namespace ftcs::daemon {
namespace {

node::UtcRules rules(const UtcConfig& config) {
  node::UtcRules rules{config.utc_offset, config.epoch};
  // No reading can be older than the list that is at hand.
  if (config.leap_seconds && config.leap_seconds->updated()) {
    auto& earliest = rules.epoch.earliest_utc_s;
    earliest = std::max(earliest, *config.leap_seconds->updated());
  }
  return rules;
}

std::string date_text(std::int64_t utc_s) {
  const auto seconds = static_cast<std::time_t>(utc_s);
  std::tm parts{};
  char text[sizeof "1970-01-01 00:00:00 "] = {};
  if (gmtime_r(&seconds, &parts) == nullptr) return fmt::format("{} s since 1970", utc_s);
  if (std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts) == 0) {
    return fmt::format("{} s since 1970", utc_s);
  }
  return text;
}

const char* leap_word(int leap) { return leap > 0 ? "inserted" : "left out"; }

}  // namespace

UtcWatch::UtcWatch(platform::Kernel& kernel, Log& log, std::string name, UtcConfig config,
                   bool shows_utc)
    : kernel_(kernel),
      log_(log),
      name_(std::move(name)),
      config_(std::move(config)),
      uses_utc_(shows_utc || config_.reference_is_utc),
      follower_(rules(config_)) {}

// CLOCK_BOOTTIME goes on while the machine is suspended, CLOCK_MONOTONIC does not, and nor does the
// oscillator that is read here.
Duration UtcWatch::slept() const {
  return Duration::from_whole_ns(kernel_.clock_ns(CLOCK_BOOTTIME)) -
         Duration::from_whole_ns(kernel_.clock_ns(CLOCK_MONOTONIC));
}

node::UtcMoment UtcWatch::moment(std::int64_t utc_s) const {
  node::UtcMoment now;
  now.machine = FreeRunningTime::from_ns(kernel_.clock_ns(CLOCK_MONOTONIC_RAW)) + slept();
  now.utc_s = utc_s;
  if (!config_.leap_seconds) return now;
  const LeapSeconds& list = *config_.leap_seconds;
  // The clock that is asked may be the one to be set: it may show anything. Before the list was
  // made it cannot be, and a leap second of such a day is over: its offset holds already.
  const std::int64_t earliest = list.updated().value_or(utc_s);
  const auto state = list.at(std::max(utc_s, earliest));
  if (!state) return now;
  const bool can_be = utc_s >= earliest;
  now.listed = node::ListedUtc{state->utc_offset, can_be ? state->leap : 0,
                               can_be && list.expires().value_or(utc_s) > utc_s};
  return now;
}

void UtcWatch::on_announced(const ReferenceScale& scale, std::int64_t utc_s) {
  follower_.on_announced(scale, moment(utc_s));
  say_notes();
}

void UtcWatch::on_time(std::int64_t utc_s) {
  follower_.on_time(moment(utc_s));
  say_notes();
}

bool UtcWatch::admits(ReferenceTime reference, FreeRunningTime event, std::int64_t utc_ns) {
  const bool admitted =
      follower_.admits(reference, config_.reference_is_utc, {utc_ns, event + slept()},
                       moment(utc_ns / kNsPerSecond).machine);
  say_notes();
  return admitted;
}

std::optional<std::string> UtcWatch::refusal() const {
  const auto refusal = follower_.refusal();
  if (!refusal) return std::nullopt;
  return fmt::format("{}: not touched: {}", name_, reason(*refusal));
}

std::optional<std::string> UtcWatch::gave_up() const {
  return follower_.is_hopeless() ? refusal() : std::nullopt;
}

void UtcWatch::say_notes() {
  while (const auto note = follower_.next_note()) say(*note);
}

void UtcWatch::say(const node::UtcNote& note) {
  using Kind = node::UtcNoteKind;
  switch (note.kind) {
    case Kind::kRefused:
      log_(LogLevel::kNotice, "{}: waiting: {}", name_, reason(note.refusal));
      break;
    case Kind::kTimescaleDoubted:
      log_(LogLevel::kWarning,
           "{}: the reference announces an arbitrary timescale now: not believed", name_);
      break;
    case Kind::kJumped:
      log_(LogLevel::kWarning,
           "{}: the reference jumped by {:+.3f} s: not followed (--max-change allows more)", name_,
           note.seconds);
      break;
    case Kind::kWandered:
      log_(LogLevel::kWarning,
           "{}: the reference has moved by {:+.3f} s since the start: not followed "
           "(--max-total-change allows more)",
           name_, note.seconds);
      break;
    case Kind::kFollowedAgain:
      log_(LogLevel::kNotice, "{}: the reference is back where it was expected: followed again",
           name_);
      break;
    default:
      if (uses_utc_) say_offset(note);
  }
}

void UtcWatch::say_offset(const node::UtcNote& note) {
  using Kind = node::UtcNoteKind;
  switch (note.kind) {
    case Kind::kOffsetDoubted:
      log_(LogLevel::kWarning,
           "{}: the reference announces a UTC offset of {} s: not believed; using {} s", name_,
           note.announced, note.utc_offset);
      break;
    case Kind::kOffsetUnconfirmed:
      log_(
          LogLevel::kNotice,
          "{}: the reference announces a UTC offset of {} s; keeping {} s until it has said so for "
          "{:.0f} s",
          name_, note.announced, note.utc_offset, node::UtcFollower::kPersistence.seconds());
      break;
    case Kind::kOffsetNotVouchedFor:
      log_(LogLevel::kNotice, "{}: the reference does not vouch for its UTC offset; using {} s{}",
           name_, note.utc_offset, config_.leap_seconds ? " of the leap second list" : "");
      break;
    case Kind::kOffsetFound:
    case Kind::kOffsetChanged: {
      const bool first = note.kind == Kind::kOffsetFound;
      log_(first ? LogLevel::kInfo : LogLevel::kWarning, "{}: UTC is {} s behind {}", name_,
           note.utc_offset, config_.reference_is_utc ? "TAI" : "the reference");
      break;
    }
    case Kind::kLeapDoubted:
      log_(LogLevel::kWarning,
           "{}: a leap second that the list does not hold is announced: not believed", name_);
      break;
    case Kind::kLeapExpected:
      log_(LogLevel::kNotice, "{}: a leap second will be {} at the end of this UTC day", name_,
           leap_word(note.leap));
      break;
    default:
      break;
  }
}

std::string UtcWatch::reason(node::UtcRefusal refusal) const {
  const std::int64_t system_s = kernel_.clock_ns(CLOCK_REALTIME) / kNsPerSecond;
  const std::int64_t excess_s = follower_.excess().floor_ns() / kNsPerSecond;
  switch (refusal) {
    case node::UtcRefusal::kNothingKnown:
      break;
    case node::UtcRefusal::kArbitraryTimescale:
      return "the reference keeps an arbitrary timescale, not PTP's (--allow-epoch follows it)";
    case node::UtcRefusal::kOffsetUnconfirmed:
      return "the reference announces an unusual UTC offset, not yet often enough to be believed";
    case node::UtcRefusal::kTooEarly:
      return fmt::format(
          "the reference shows {} UTC, before this program was built or its leap second list made "
          "(--allow-epoch follows it)",
          date_text(system_s + excess_s));
    case node::UtcRefusal::kFarFromSystem:
      return fmt::format(
          "the reference shows {} UTC, {:+} s from the system clock (--max-first-change allows "
          "more)",
          date_text(system_s + excess_s), excess_s);
  }
  return "nothing is known of the reference's timescale";
}

}  // namespace ftcs::daemon
