// SPDX-License-Identifier: MIT
#include "ftcs/node/utc_follower.h"

#include <chrono>
#include <cstdlib>
#include <utility>

#include "ftcs/time/duration.h"

namespace ftcs::node {
namespace {

constexpr std::int64_t kSecondsPerDay = 86'400;
/// A leap that has not come so long after its time does not come any more.
constexpr std::int64_t kPatienceS = 10;
/// So long after a leap a reference, or who tells us of it, may still speak of the time before.
constexpr std::int64_t kLaggardS = 90;

std::int64_t day_of(std::int64_t utc_s) noexcept {
  return (utc_s - ((utc_s % kSecondsPerDay) + kSecondsPerDay) % kSecondsPerDay) / kSecondsPerDay;
}

}  // namespace

bool is_last_day_of_month(std::int64_t utc_s) noexcept {
  const std::chrono::sys_days today{std::chrono::days{day_of(utc_s)}};
  return std::chrono::year_month_day{today + std::chrono::days{1}}.day() == std::chrono::day{1};
}

template <class Value>
bool UtcFollower::Candidate<Value>::confirm(const Value& said, FreeRunningTime now) noexcept {
  if (value != said) {
    value = said;
    count = 0;
    since = now;
  }
  ++count;
  return count >= kAnnouncements && now - since >= kPersistence;
}

void UtcFollower::set_fixed(int utc_offset) noexcept {
  fixed_ = true;
  believed_ = Belief{true, utc_offset};
}

void UtcFollower::on_announced(const ReferenceScale& scale, const UtcMoment& moment) noexcept {
  const std::optional<ReferenceScale> before = std::exchange(scale_, scale);
  if (fixed_) return;
  follow_offset(moment, true);
  follow_leap_flag(moment);
  if (!scale.tai || scale.utc_offset || !believed_) return;
  if (before && !before->utc_offset) return;  // nothing new
  tell({.kind = UtcNoteKind::kOffsetNotVouchedFor, .utc_offset = believed_->offset},
       moment.machine);
}

void UtcFollower::on_time(const UtcMoment& moment) noexcept {
  if (fixed_ || !scale_) return;
  follow_leap(moment);
  follow_offset(moment, false);
}

int UtcFollower::expected_offset(const UtcMoment& moment) const noexcept {
  return moment.listed ? moment.listed->utc_offset : rules_.utc_offset;
}

bool UtcFollower::is_plausible(int offset, const UtcMoment& moment) const noexcept {
  if (offset < kSmallestOffset || offset > kLargestOffset) return false;
  const bool near_belief = is_tai() && std::abs(offset - believed_->offset) <= 1;
  return near_belief || std::abs(offset - expected_offset(moment)) <= 1;
}

UtcFollower::Belief UtcFollower::wanted(const UtcMoment& moment) noexcept {
  if (!scale_->tai) return {false, 0};
  if (!scale_->utc_offset) return {true, expected_offset(moment)};
  if (is_plausible(*scale_->utc_offset, moment)) return {true, *scale_->utc_offset};
  const int kept = is_tai() ? believed_->offset : expected_offset(moment);
  tell({.kind = UtcNoteKind::kOffsetDoubted, .utc_offset = kept, .announced = *scale_->utc_offset},
       moment.machine);
  return {true, kept};
}

void UtcFollower::follow_offset(const UtcMoment& moment, bool announced) noexcept {
  if (!believed_ && !announced) return;  // it waits for an announcement
  if (!scale_->tai && !rules_.epoch.any_epoch) {
    candidate_ = {};
    if (!believed_) return refuse(UtcRefusal::kArbitraryTimescale, moment.machine);
    return tell({.kind = UtcNoteKind::kTimescaleDoubted, .utc_offset = believed_->offset},
                moment.machine);
  }
  const Belief belief = wanted(moment);
  if (believed_ == belief) {
    candidate_ = {};
    return;
  }
  if (believed_ && leap_explains(belief, moment.utc_s)) return;
  const bool listed = scale_->tai && !scale_->utc_offset && is_tai();
  const bool expected = !believed_ && (!belief.tai || belief.offset == expected_offset(moment));
  if (!listed && !expected) {
    if (announced && candidate_.confirm(belief, moment.machine)) {
      return begin_offset(belief, moment);
    }
    if (!believed_) return refuse(UtcRefusal::kOffsetUnconfirmed, moment.machine);
    if (!announced) return;
    return tell({.kind = UtcNoteKind::kOffsetUnconfirmed,
                 .utc_offset = believed_->offset,
                 .announced = belief.offset},
                moment.machine);
  }
  begin_offset(belief, moment);
}

void UtcFollower::begin_offset(const Belief& belief, const UtcMoment& moment) noexcept {
  const bool first = !std::exchange(believed_, belief);
  candidate_ = {};
  if (first) refusal_.reset();
  tell({.kind = first ? UtcNoteKind::kOffsetFound : UtcNoteKind::kOffsetChanged,
        .utc_offset = belief.offset},
       moment.machine);
}

/// The leap itself will bring this offset, or it is still that from before the last one.
bool UtcFollower::leap_explains(const Belief& belief, std::int64_t utc_s) const noexcept {
  if (belief.tai != believed_->tai) return false;
  if (armed_leap_ != 0 && belief.offset == believed_->offset + armed_leap_) return true;
  return utc_s < no_leap_before_s_ && belief.offset == believed_->offset - last_leap_;
}

void UtcFollower::follow_leap_flag(const UtcMoment& moment) noexcept {
  if (scale_->leap == leap_flag_) {
    leap_candidate_ = {};
    return;
  }
  if (scale_->leap != 0 && moment.listed && moment.listed->current &&
      moment.listed->leap != scale_->leap && is_last_day_of_month(moment.utc_s)) {
    return tell({.kind = UtcNoteKind::kLeapDoubted, .leap = scale_->leap}, moment.machine);
  }
  if (leap_candidate_.confirm(scale_->leap, moment.machine)) leap_flag_ = scale_->leap;
}

// Announce is believed, and else the list; either on days alone on which leap seconds happen.
int UtcFollower::due_leap(const UtcMoment& moment) const noexcept {
  if (!is_tai() || moment.utc_s < no_leap_before_s_ || !is_last_day_of_month(moment.utc_s))
    return 0;
  if (leap_flag_ != 0) return leap_flag_;
  // A reference that is a little ahead has leapt already, and tells only the new offset.
  if (armed_leap_ != 0 && scale_->utc_offset == believed_->offset + armed_leap_) return armed_leap_;
  return moment.listed ? moment.listed->leap : 0;
}

void UtcFollower::follow_leap(const UtcMoment& moment) noexcept {
  const int leap = due_leap(moment);
  if (leap == armed_leap_) return;
  // In the last second the kernel is already about to leap: too late to think again.
  const bool is_happening =
      moment.utc_s >= midnight_s_ - 1 && moment.utc_s < midnight_s_ + kPatienceS;
  if (armed_leap_ != 0 && leap == 0 && is_happening) return;
  armed_leap_ = leap;
  midnight_s_ = (day_of(moment.utc_s) + 1) * kSecondsPerDay;
  if (leap != 0) tell({.kind = UtcNoteKind::kLeapExpected, .leap = leap}, moment.machine);
}

// An inserted second is the day's last one again, and Announce may go on announcing it for a while.
void UtcFollower::on_leap_done(int leap) noexcept {
  armed_leap_ = 0;
  leap_flag_ = 0;
  last_leap_ = leap;
  no_leap_before_s_ = midnight_s_ + kLaggardS;
  rules_.utc_offset += leap;
  if (is_tai()) believed_->offset += leap;
}

bool UtcFollower::admits(ReferenceTime reference, bool is_utc, const Witnesses& witnesses,
                         FreeRunningTime now) noexcept {
  if (!believed_) {
    refuse(refusal_.value_or(UtcRefusal::kNothingKnown), now);
    return false;
  }
  const Duration ahead =
      is_utc ? Duration{} : Duration::from_whole_ns(believed_->offset * kNsPerSecond);
  const double seconds_before = gate_.excess().seconds();
  const EpochVerdict verdict = gate_.judge(reference, ahead, witnesses);
  const double seconds = gate_.excess().seconds();
  switch (verdict) {
    case EpochVerdict::kPlausible:
      refusal_.reset();
      if (std::exchange(in_doubt_, false)) {
        tell({.kind = UtcNoteKind::kFollowedAgain, .seconds = seconds_before}, now);
      }
      return true;
    case EpochVerdict::kTooEarly:
      refuse(UtcRefusal::kTooEarly, now);
      break;
    case EpochVerdict::kFarFromSystem:
      refuse(UtcRefusal::kFarFromSystem, now);
      break;
    case EpochVerdict::kJumped:
    case EpochVerdict::kWandered:
      in_doubt_ = true;
      const bool jumped = verdict == EpochVerdict::kJumped;
      tell({.kind = jumped ? UtcNoteKind::kJumped : UtcNoteKind::kWandered, .seconds = seconds},
           now);
      break;
  }
  return false;
}

void UtcFollower::refuse(UtcRefusal reason, FreeRunningTime now) noexcept {
  if (!refusal_) refused_since_ = now;
  if (refusal_ != reason && reason != UtcRefusal::kNothingKnown) {
    tell({.kind = UtcNoteKind::kRefused, .refusal = reason, .seconds = gate_.excess().seconds()},
         now);
  }
  refusal_ = reason;
  refused_until_ = now;
}

std::optional<UtcRefusal> UtcFollower::refusal() const noexcept {
  return refusal_ == UtcRefusal::kNothingKnown ? std::nullopt : refusal_;
}

void UtcFollower::tell(UtcNote note, FreeRunningTime now) noexcept {
  auto& told = told_[static_cast<std::size_t>(note.kind)];
  if (told && now - *told < kQuiet) return;
  told = now;
  if (notes_end_ < kMostNotes) notes_[notes_end_++] = note;
}

std::optional<UtcNote> UtcFollower::next_note() noexcept {
  if (first_note_ == notes_end_) {
    first_note_ = notes_end_ = 0;
    return std::nullopt;
  }
  return notes_[first_note_++];
}

}  // namespace ftcs::node
