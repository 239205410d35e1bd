// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/measurement/link_delay.h"
#include "ftcs/measurement/shared_timescale.h"
#include "ftcs/node/follower_event.h"
#include "ftcs/node/path_limit.h"
#include "ftcs/node/reference_gate.h"
#include "ftcs/ptp/actions.h"

namespace ftcs::node {

/// What the follower adds to the discipline. peer_to_peer fixes the servo's path delay at zero.
struct ClockFollowerConfig {
  DisciplineConfig discipline{};
  /// The delay of the link is measured beside the pairs (on_link_delay()) and taken off before the
  /// servo sees one; the servo's own path delay is then what the link's differs by.
  bool peer_to_peer = false;
  /// Of the link delay, by discipline.servo.two_way.path_delay.filter, even for the adaptive servo.
  /// Without it that servo has a steady mean, and hears the neighbour's stamps too (decision 0015).
  bool filter_is_chosen = false;
  /// A message whose path delay is beyond this steers nothing (PathLimit). Zero: no limit.
  Nanoseconds largest_path_delay{0};
};

/// What stands between a source of timestamps and the discipline of a clock: which stamps steer, in
/// which order, what delay is taken off them, and when all begins anew.
///
///     event:  local - (reference ± link delay) = offset ± (path delay - link delay)
///
/// Without I/O. After each input the events are to be taken with next() until there is none.
///
/// A pair passes: the gate (else it is dropped without a word), end to end the bound on its path
/// delay (else kPathDelayRefused), peer to peer the wait for a first link delay; then the
/// discipline. For stamps of any source: ReceiverNode feeds it those of a PTP port, a replay those
/// of a file.
///
///     ClockFollower follower(config, clock);
///     follower.on_pair({Direction::kForward, t1, t2}, Duration{1s});
///     while (const auto event = follower.next()) record(*event);
class ClockFollower {
 public:
  /// Clock and gate must outlive the follower; without a gate everything may steer. Valid:
  /// validate(config.discipline.servo) finds nothing.
  ClockFollower(const ClockFollowerConfig& config, AdjustableClock& clock,
                ReferenceGate* gate = nullptr) noexcept;

  /// Before the first message: a rate that is known already.
  [[nodiscard]] std::optional<ClockError> start_at(Rate rate) noexcept {
    return discipline_.start_at(rate);
  }
  /// `sync_interval`: of the source, where it is known; it decides from when on silence is one.
  void on_pair(const EventPair& pair, std::optional<Duration> sync_interval) noexcept;
  /// Peer to peer: one exchange beside the pairs, first of all the delay of the link. Until there
  /// is one, nothing is steered: the newest pair waits. With stamps, the neighbour is the
  /// transmitter: while they show the time of its Syncs the adaptive servo hears them too and
  /// estimates the path delay itself (decision 0015).
  void on_link_delay(const ptp::EmitPeerDelay& measured,
                     std::optional<Duration> sync_interval) noexcept;
  /// Another link: its delay is not known yet.
  void on_new_link() noexcept;
  /// Nothing may have come for a while; as often as liked.
  void on_silence() noexcept;
  /// Another reference: what was learnt about the old one is void.
  void on_new_reference() noexcept;
  /// The same reference, at another time: told, with what will happen
  /// (ClockDiscipline::on_reference_jump()).
  void on_reference_jump(Duration jump) noexcept;
  /// The clock was put onto another timescale: begins anew, the bound of the first offset included.
  void on_new_timescale() noexcept;

  /// What the inputs brought about, oldest first; none: all is told.
  [[nodiscard]] std::optional<FollowerEvent> next() noexcept;

  [[nodiscard]] bool locked() const noexcept { return discipline_.locked(); }
  [[nodiscard]] const ClockDiscipline& discipline() const noexcept { return discipline_; }

 private:
  /// One exchange that another link, a waiting pair, a response and a request come of at once, each
  /// with all its notes, makes eleven.
  static constexpr std::size_t kMostEvents = 12;

  [[nodiscard]] bool admits(const EventPair& pair) noexcept;
  void follow(const EventPair& pair, std::optional<Duration> sync_interval) noexcept;
  [[nodiscard]] Steered steer(EventPair pair, bool paces) noexcept;
  void note_refusals(const Telemetry& telemetry) noexcept;
  void note_saturation(const Telemetry& telemetry, bool at_limit) noexcept;
  [[nodiscard]] bool path_is_short(const EventPair& pair) noexcept;
  void refuse_path(Duration delay) noexcept;
  void hear_stamps(const ptp::PeerStamps& stamps) noexcept;
  void hear_response(FreeRunningTime before) noexcept;
  void follow_timescale(const EventPair& sync) noexcept;
  void follow_verdict(SharedTimescale::Verdict before) noexcept;
  void begin_anew(const Note& note) noexcept;
  void forget_stamps() noexcept;
  [[nodiscard]] bool is_another_link(Duration mean_link_delay) const noexcept;
  [[nodiscard]] bool hears_stamps() const noexcept;
  [[nodiscard]] bool shares_timescale() const noexcept {
    return timescale_.verdict() == SharedTimescale::Verdict::kShared;
  }
  [[nodiscard]] Duration delay_taken_off() const noexcept {
    return shares_timescale() ? start_delay_ : link_delay_.value();
  }
  void tell(const FollowerEvent& event) noexcept;

  ClockFollowerConfig config_;
  AdjustableClock& clock_;
  ReferenceGate* gate_;
  ClockDiscipline discipline_;
  LinkDelay link_delay_;
  SharedTimescale timescale_;  ///< of the neighbour's stamps
  /// Heard with the next Sync: of the two the one whose event came first.
  std::optional<EventPair> response_{};
  int unstamped_exchanges_ = 0;  ///< since the last Sync
  int syncs_without_stamps_ = 0;
  Duration start_delay_{};  ///< the link's when the servo began to estimate what it differs by
  std::optional<EventPair> waiting_{};  ///< for the first link delay
  bool in_holdover_ = false;
  std::uint32_t refused_syncs_ = 0;  ///< in a row
  bool clock_refuses_ = false;
  PathLimit path_limit_;
  std::uint32_t refused_offsets_ = 0;  ///< in a row, as the next two
  std::uint32_t refused_paths_ = 0;
  std::uint32_t saturated_ = 0;
  std::array<FollowerEvent, kMostEvents> events_{};
  std::size_t told_ = 0;
  std::size_t taken_ = 0;
};

}  // namespace ftcs::node
