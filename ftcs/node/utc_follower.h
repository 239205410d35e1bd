// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/node/epoch_gate.h"

namespace ftcs::node {

/// What a reference says about its timescale: Announce, or timePropertiesDS (IEEE 1588, 8.2.4).
struct ReferenceScale {
  bool tai = true;                  ///< ptpTimescale; false: an arbitrary epoch (7.2.1)
  std::optional<int> utc_offset{};  ///< TAI - UTC in seconds, if it vouches for it
  int leap = 0;                     ///< at the end of this UTC day: +1, -1, 0 none
};

/// What a list of leap seconds says of a moment.
struct ListedUtc {
  int utc_offset = 0;    ///< TAI - UTC in seconds
  int leap = 0;          ///< at the end of that UTC day
  bool current = false;  ///< it has not expired: a leap second that it does not hold will not come
};

/// When something is told, and what the machine knows of it.
struct UtcMoment {
  FreeRunningTime machine{};  ///< nobody steers it, and it goes on while the machine sleeps
  std::int64_t utc_s = 0;     ///< the system clock, seconds since 1970
  std::optional<ListedUtc> listed{};
};

/// What holds where nobody tells.
struct UtcRules {
  int utc_offset = 37;  ///< TAI - UTC since 2017: where neither reference nor list tells
  EpochRules epoch{};
};

/// Why nothing has been followed yet.
enum class UtcRefusal : std::uint8_t {
  kNothingKnown,        ///< no word about the timescale yet
  kArbitraryTimescale,  ///< its epoch is nobody's
  kOffsetUnconfirmed,   ///< a UTC offset that is a second from the expected one, not yet confirmed
  kTooEarly,            ///< EpochVerdict
  kFarFromSystem,       ///< EpochVerdict
};

/// What an operator may want to know; the fields that belong to a kind are named with it.
enum class UtcNoteKind : std::uint8_t {
  kRefused,            ///< refusal; told once for each
  kTimescaleDoubted,   ///< an arbitrary timescale is announced: the old one is kept
  kOffsetDoubted,      ///< announced, which cannot be true; utc_offset is kept
  kOffsetUnconfirmed,  ///< announced, which may be true if it lasts; utc_offset is kept until then
  kOffsetNotVouchedFor,  ///< utc_offset is used
  kOffsetFound,          ///< utc_offset, the first that is believed, or expected all along
  kOffsetChanged,        ///< utc_offset: announced persistently, or listed
  kLeapDoubted,          ///< announced, but a current list does not hold it
  kLeapExpected,         ///< leap
  kJumped,               ///< by seconds: not followed
  kWandered,             ///< by seconds since the start: not followed
  kFollowedAgain,        ///< readings are plausible again
};

/// Fields that a kind does not name are zero.
struct UtcNote {
  UtcNoteKind kind{};
  UtcRefusal refusal = UtcRefusal::kNothingKnown;
  int utc_offset = 0;
  int announced = 0;
  int leap = 0;
  double seconds = 0.0;
};

/// Decides what is believed of a reference's date, UTC offset, timescale flag and leap seconds
/// before a real clock, or who feeds one, acts on it.
///
/// The rule: one message alone changes nothing that has been believed. An offset must lie in
/// 10..60 s and within a second of what is expected (by the list, else by UtcRules) or was
/// believed; that, a timescale and a leap second are believed once kAnnouncements messages in a row
/// have said so over kPersistence. Only an offset that is just the expected one is believed at
/// once. Dates: EpochGate. Where nothing can be followed for kPatience from the start,
/// is_hopeless().
///
/// Without I/O. After each input the notes are to be taken with next_note(); of one kind there is
/// at most one in kQuiet.
///
///     UtcFollower utc({.epoch = {.earliest_utc_s = built_at}});
///     utc.on_announced({.tai = true, .utc_offset = 37}, moment);       // each Announce
///     if (utc.admits(reference, false, witnesses, now)) steer();       // each message
///
/// Sources: IEEE 1588-2019, 7.2 and 8.2.4 (timescale, currentUtcOffset, leap59, leap61); ITU-R
/// TF.460 (when leap seconds happen). Instants are of UtcMoment::machine throughout, which must not
/// run backward.
class UtcFollower {
 public:
  static constexpr int kAnnouncements = 4;
  static constexpr Duration kPersistence{std::chrono::seconds{10}};
  static constexpr Duration kPatience{std::chrono::seconds{10}};
  static constexpr Duration kQuiet{std::chrono::seconds{60}};
  static constexpr int kSmallestOffset = 10;  ///< TAI - UTC in 1972
  static constexpr int kLargestOffset = 60;

  explicit UtcFollower(const UtcRules& rules) noexcept : rules_(rules), gate_(rules.epoch) {}

  /// The user said what the reference is ahead of UTC by; no announcement counts then.
  void set_fixed(int utc_offset) noexcept;
  /// Each announcement once.
  void on_announced(const ReferenceScale& scale, const UtcMoment& moment) noexcept;
  /// Once a second: lists speak, and leap seconds draw near. Without it no leap second is expected.
  void on_time(const UtcMoment& moment) noexcept;
  /// The clock has leapt; local time, if it is TAI, went on.
  void on_leap_done(int leap) noexcept;
  /// Whether a reading of the reference may steer. `is_utc`: the reference shows UTC itself. `now`:
  /// as UtcMoment::machine.
  [[nodiscard]] bool admits(ReferenceTime reference, bool is_utc, const Witnesses& witnesses,
                            FreeRunningTime now) noexcept;

  /// The timescale is known; until then the two that follow say nothing.
  [[nodiscard]] bool known() const noexcept { return believed_.has_value(); }
  /// What the reference is ahead of UTC by, in seconds; arbitrary timescales: 0.
  [[nodiscard]] int utc_offset() const noexcept { return believed_ ? believed_->offset : 0; }
  [[nodiscard]] bool is_tai() const noexcept { return believed_ && believed_->tai; }
  /// +1, -1: a leap second is due at leap_due_s(); 0: none.
  [[nodiscard]] int expected_leap() const noexcept { return armed_leap_; }
  [[nodiscard]] std::int64_t leap_due_s() const noexcept { return midnight_s_; }

  /// Why nothing has been followed so far; no value: something has, or nothing was there to follow.
  [[nodiscard]] std::optional<UtcRefusal> refusal() const noexcept;
  /// How far the reading that was refused is from the system clock; positive: later.
  [[nodiscard]] Duration excess() const noexcept { return gate_.excess(); }
  /// All that came for kPatience was refused.
  [[nodiscard]] bool is_hopeless() const noexcept {
    return refusal() && refused_until_ - refused_since_ >= kPatience;
  }

  /// Oldest first; none: all is told. Beyond eight that are not taken, the newest are lost.
  [[nodiscard]] std::optional<UtcNote> next_note() noexcept;

 private:
  struct Belief {
    bool tai = true;
    int offset = 0;
    friend bool operator==(const Belief&, const Belief&) = default;
  };
  /// How often in a row, and since when, the same was announced.
  template <class Value>
  struct Candidate {
    std::optional<Value> value{};
    int count = 0;
    FreeRunningTime since{};
    /// True once it has been said often and long enough.
    bool confirm(const Value& said, FreeRunningTime now) noexcept;
  };
  static constexpr std::size_t kKinds = static_cast<std::size_t>(UtcNoteKind::kFollowedAgain) + 1;
  static constexpr std::size_t kMostNotes = 8;

  [[nodiscard]] int expected_offset(const UtcMoment& moment) const noexcept;
  [[nodiscard]] bool is_plausible(int offset, const UtcMoment& moment) const noexcept;
  [[nodiscard]] Belief wanted(const UtcMoment& moment) noexcept;
  void follow_offset(const UtcMoment& moment, bool announced) noexcept;
  void begin_offset(const Belief& belief, const UtcMoment& moment) noexcept;
  [[nodiscard]] bool leap_explains(const Belief& belief, std::int64_t utc_s) const noexcept;
  void follow_leap_flag(const UtcMoment& moment) noexcept;
  [[nodiscard]] int due_leap(const UtcMoment& moment) const noexcept;
  void follow_leap(const UtcMoment& moment) noexcept;
  void refuse(UtcRefusal reason, FreeRunningTime now) noexcept;
  void tell(UtcNote note, FreeRunningTime now) noexcept;

  UtcRules rules_;
  EpochGate gate_;
  bool fixed_ = false;
  std::optional<ReferenceScale> scale_{};  ///< as last announced
  std::optional<Belief> believed_{};
  Candidate<Belief> candidate_{};
  int leap_flag_ = 0;  ///< believed
  Candidate<int> leap_candidate_{};
  int armed_leap_ = 0;
  std::int64_t midnight_s_ = 0;        ///< UTC: when it is due
  std::int64_t no_leap_before_s_ = 0;  ///< UTC
  int last_leap_ = 0;                  ///< the one that no_leap_before_s_ belongs to
  std::optional<UtcRefusal> refusal_{};
  FreeRunningTime refused_since_{};
  FreeRunningTime refused_until_{};
  bool in_doubt_ = false;  ///< the last reading jumped or wandered
  std::array<std::optional<FreeRunningTime>, kKinds> told_{};
  std::array<UtcNote, kMostNotes> notes_{};
  std::size_t first_note_ = 0;
  std::size_t notes_end_ = 0;
};

/// Does a UTC month end with this day? Leap seconds happen at no other time (ITU-R TF.460).
[[nodiscard]] bool is_last_day_of_month(std::int64_t utc_s) noexcept;

}  // namespace ftcs::node
