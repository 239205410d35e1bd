// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "ftcs/ptp/counters.h"
#include "ftcs/ptp/wire/message.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// Joins each two-step Sync with its Follow_Up, whichever comes first (9.5.5, 9.5.10), and emits
/// forward pairs in the order of their sequence ids: reference = t1 + both corrections,
/// free_running = t2.
///
/// The world it is built for: messages are lost, duplicated and reordered, Follow_Ups lag behind by
/// several intervals (software stamps at 128 Hz), the transmitter restarts and begins with another
/// sequence id. In none of these may stamps of two different Syncs meet in a pair.
class SyncMatcher {
 public:
  /// A part whose counterpart has not come after this time is forgotten. Long against any queue,
  /// short against the time in which 16-bit sequence ids at 128 Hz come round (512 s).
  static constexpr Nanoseconds kMatchTimeout{1'000'000'000};
  /// No network delivers a copy so late, and no program is started again so soon.
  static constexpr Nanoseconds kLatestCopy{100'000'000};
  /// Sequence ids up to so far ahead are the next ones, after loss.
  static constexpr int kReorderWindow = 16;
  /// Any other id is a transmitter that has been started again once so many successive ones have
  /// come, each new and none later than four gaps of the Syncs before. One alone is a stray or a
  /// replay. Ids a little behind may also be disorder: those need more, and are then a transmitter
  /// whose ids somebody else pushes ahead.
  static constexpr int kRestartSyncs = 3;
  static constexpr int kOvertakenSyncs = 8;

  /// `received` is t2; `now`, when we handle the message. A one-step Sync is a pair by itself.
  std::optional<EventPair> on_sync(const Header& header, const Sync& sync, FreeRunningTime received,
                                   FreeRunningTime now, Counters& counters) noexcept;
  /// A pair, if the Sync was there already and no newer pair has been emitted. Whatever is left out
  /// is counted.
  std::optional<EventPair> on_follow_up(const Header& header, const FollowUp& follow_up,
                                        FreeRunningTime now, Counters& counters) noexcept;
  void reset() noexcept { *this = SyncMatcher{}; }

 private:
  enum class SlotState : std::uint8_t { kFree, kSyncWaits, kFollowUpWaits, kDone };
  struct Slot {
    SlotState state = SlotState::kFree;
    std::uint16_t sequence_id = 0;
    FreeRunningTime since{};
    FreeRunningTime received{};
    ReferenceTime origin{};
    Duration correction{};
    bool follow_up_first = false;  ///< and its time, follow_up
    ReferenceTime follow_up{};
    bool overtaken = false;  ///< admitted although a newer id had come, or after such a one
  };
  static constexpr std::size_t kRemembered = 256;  // at 128 Hz two seconds
  /// Follow_Ups that come before their Sync are usual where the two are read from two sockets. Once
  /// a second one for the same Sync tells another time, somebody forges them: then only those count
  /// that come after the Sync, until none has been contradicted for so long.
  static constexpr Nanoseconds kForgeryMemory{60'000'000'000};
  /// Four Syncs may be under way at once.
  static constexpr std::size_t kSlots = 4;

  [[nodiscard]] bool admit_sync(std::uint16_t sequence_id, FreeRunningTime now,
                                Counters& counters) noexcept;
  int follow_run(std::uint16_t sequence_id, bool next, FreeRunningTime now) noexcept;
  [[nodiscard]] bool was_admitted(std::uint16_t sequence_id) const noexcept;
  [[nodiscard]] Slot* find(std::uint16_t sequence_id) noexcept;
  [[nodiscard]] Slot& take_slot(std::uint16_t sequence_id, FreeRunningTime now,
                                Counters& counters) noexcept;
  std::optional<EventPair> complete(Slot& slot, Counters& counters) noexcept;
  void expire(FreeRunningTime now, Counters& counters) noexcept;
  static void release(Slot& slot, Counters& counters) noexcept;
  void look_for_forgery(const Slot& slot, const Header& header, const FollowUp& follow_up,
                        FreeRunningTime now, Counters& counters) noexcept;

  std::array<Slot, kSlots> slots_{};
  bool has_newest_ = false;
  std::uint16_t newest_id_ = 0;  ///< of the Syncs admitted
  FreeRunningTime newest_at_{};
  Duration gap_{};  ///< between the last two admitted
  /// The latest ids admitted, each at its place modulo their number.
  std::array<std::optional<std::uint16_t>, kRemembered> admitted_{};
  int run_ = 0;  ///< successive ones that began with an unexpected id, up to run_id_
  std::uint16_t run_id_ = 0;
  FreeRunningTime run_at_{};
  bool has_emitted_ = false;
  std::uint16_t emitted_id_ = 0;
  ReferenceTime emitted_{};
  bool overtaken_ = false;  ///< the newest
  std::optional<FreeRunningTime> forged_at_{};
};

}  // namespace ftcs::ptp
