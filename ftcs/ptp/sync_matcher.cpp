// SPDX-License-Identifier: MIT
#include "ftcs/ptp/sync_matcher.h"

#include <algorithm>

#include "ftcs/ptp/sequence.h"

namespace ftcs::ptp {

std::optional<EventPair> SyncMatcher::on_sync(const Header& header, const Sync& sync,
                                              FreeRunningTime received, FreeRunningTime now,
                                              Counters& counters) noexcept {
  expire(now, counters);
  Slot* slot = find(header.sequence_id);
  if (slot != nullptr && slot->state != SlotState::kFollowUpWaits) {
    counters.add(Counter::kDuplicateSync);
    // A copy, or the Sync of a transmitter that has been started again: which of the two the
    // Follow_Up will belong to, nobody can tell.
    if (slot->state == SlotState::kSyncWaits &&
        abs(received - slot->received) > Duration{kLatestCopy}) {
      slot->state = SlotState::kDone;
    }
    return std::nullopt;
  }
  if (!admit_sync(header.sequence_id, now, counters)) return std::nullopt;
  slot = find(header.sequence_id);  // a restart has forgotten it
  const bool follow_up_waits = slot != nullptr;
  if (!follow_up_waits) slot = &take_slot(header.sequence_id, now, counters);
  slot->received = received;
  slot->overtaken = overtaken_;
  slot->correction += header.correction;
  if (!header.has(flag::kTwoStep)) {
    slot->origin = sync.origin;
    slot->correction = header.correction;
    return complete(*slot, counters);
  }
  if (follow_up_waits) return complete(*slot, counters);
  slot->state = SlotState::kSyncWaits;
  return std::nullopt;
}

std::optional<EventPair> SyncMatcher::on_follow_up(const Header& header, const FollowUp& follow_up,
                                                   FreeRunningTime now,
                                                   Counters& counters) noexcept {
  expire(now, counters);
  Slot* slot = find(header.sequence_id);
  if (slot != nullptr && slot->state != SlotState::kSyncWaits) {
    counters.add(Counter::kDuplicateFollowUp);
    look_for_forgery(*slot, header, follow_up, now, counters);
    return std::nullopt;
  }
  const bool sync_waits = slot != nullptr;
  if (!sync_waits && forged_at_ && now - *forged_at_ < Duration{kForgeryMemory}) {
    counters.add(Counter::kEarlyFollowUp);
    return std::nullopt;
  }
  if (!sync_waits) {
    const int distance = sequence_distance(header.sequence_id, newest_id_);
    if (has_newest_ && distance <= 0 && distance > -kReorderWindow) {
      counters.add(Counter::kStaleFollowUp);
      return std::nullopt;
    }
    slot = &take_slot(header.sequence_id, now, counters);
    slot->state = SlotState::kFollowUpWaits;
    slot->follow_up_first = true;
    slot->follow_up = follow_up.precise_origin + header.correction;
  }
  slot->origin = follow_up.precise_origin;
  slot->correction += header.correction;
  if (sync_waits) return complete(*slot, counters);
  return std::nullopt;
}

void SyncMatcher::look_for_forgery(const Slot& slot, const Header& header,
                                   const FollowUp& follow_up, FreeRunningTime now,
                                   Counters& counters) noexcept {
  const bool copy = slot.follow_up == follow_up.precise_origin + header.correction;
  const bool forged = slot.follow_up_first && !copy;
  // The path of a copy may have another correction; its time is the same.
  if (forged || slot.origin != follow_up.precise_origin) {
    counters.add(Counter::kContradictingFollowUp);
  }
  if (forged) forged_at_ = now;
}

bool SyncMatcher::admit_sync(std::uint16_t sequence_id, FreeRunningTime now,
                             Counters& counters) noexcept {
  const int distance = sequence_distance(sequence_id, newest_id_);
  const bool quiet = now - newest_at_ > Duration{kMatchTimeout};
  const bool next = distance > 0 && distance <= kReorderWindow;
  const bool behind = distance <= 0 && distance > -kReorderWindow;
  const int run = follow_run(sequence_id, next, now);
  const bool goes_on = run >= (behind ? kOvertakenSyncs : kRestartSyncs);
  if (has_newest_ && !next && !quiet && !goes_on) {
    counters.add(Counter::kStaleSync);
    return false;
  }
  if (has_newest_ && !next) {
    counters.add(Counter::kSequenceRestarts);
    for (Slot& slot : slots_) release(slot, counters);
    has_emitted_ = false;
  } else if (has_newest_) {
    counters.add(Counter::kMissedSync, static_cast<std::uint64_t>(distance - 1));
  }
  if (quiet) admitted_ = {};
  overtaken_ = has_newest_ && !quiet && (behind || (next && overtaken_));
  gap_ = has_newest_ && !quiet ? now - newest_at_ : Duration{};
  has_newest_ = true;
  newest_id_ = sequence_id;
  newest_at_ = now;
  admitted_[sequence_id % kRemembered] = sequence_id;
  return true;
}

bool SyncMatcher::was_admitted(std::uint16_t sequence_id) const noexcept {
  return admitted_[sequence_id % kRemembered] == sequence_id;
}

/// How many successive Syncs this one ends, if they began with an unexpected id. An id that has
/// come before is a copy, unless it is the next one of a long run: then somebody else has used it.
int SyncMatcher::follow_run(std::uint16_t sequence_id, bool next, FreeRunningTime now) noexcept {
  constexpr int kLargestGap = 4;
  const Duration longest = gap_ + gap_ + gap_ + gap_;
  const bool paced = longest <= Duration{} || now - run_at_ <= longest;
  const int ahead = sequence_distance(sequence_id, run_id_);
  const bool goes_on = run_ > 0 && paced && ahead > 0 && ahead <= kLargestGap;
  const bool copy = was_admitted(sequence_id) && !(goes_on && run_ == kOvertakenSyncs);
  if (copy || (next && !goes_on)) return 0;
  run_ = goes_on ? std::min(run_ + 1, kOvertakenSyncs) : 1;
  run_id_ = sequence_id;
  run_at_ = now;
  return run_;
}

std::optional<EventPair> SyncMatcher::complete(Slot& slot, Counters& counters) noexcept {
  slot.state = SlotState::kDone;
  const ReferenceTime reference = slot.origin + slot.correction;
  // What disorder has overtaken is told by its time, whatever the ids say.
  const bool disorder =
      slot.overtaken && reference <= emitted_ && emitted_ - reference < Duration{kMatchTimeout};
  if (disorder || (has_emitted_ && sequence_distance(slot.sequence_id, emitted_id_) <= 0)) {
    counters.add(Counter::kStaleFollowUp);
    return std::nullopt;
  }
  has_emitted_ = true;
  emitted_id_ = slot.sequence_id;
  emitted_ = reference;
  return EventPair{Direction::kForward, reference, slot.received};
}

SyncMatcher::Slot* SyncMatcher::find(std::uint16_t sequence_id) noexcept {
  auto* const found = std::ranges::find_if(slots_, [&](const Slot& slot) {
    return slot.state != SlotState::kFree && slot.sequence_id == sequence_id;
  });
  return found == slots_.end() ? nullptr : found;
}

SyncMatcher::Slot& SyncMatcher::take_slot(std::uint16_t sequence_id, FreeRunningTime now,
                                          Counters& counters) noexcept {
  auto* const slot = std::ranges::min_element(slots_, [](const Slot& a, const Slot& b) {
    if ((a.state == SlotState::kFree) != (b.state == SlotState::kFree)) {
      return a.state == SlotState::kFree;
    }
    return a.since < b.since;
  });
  release(*slot, counters);
  slot->sequence_id = sequence_id;
  slot->since = now;
  return *slot;
}

void SyncMatcher::expire(FreeRunningTime now, Counters& counters) noexcept {
  for (Slot& slot : slots_) {
    if (now - slot.since > Duration{kMatchTimeout}) release(slot, counters);
  }
}

void SyncMatcher::release(Slot& slot, Counters& counters) noexcept {
  if (slot.state == SlotState::kSyncWaits) counters.add(Counter::kLostFollowUp);
  if (slot.state == SlotState::kFollowUpWaits) counters.add(Counter::kLostSync);
  slot = Slot{};
}

}  // namespace ftcs::ptp
