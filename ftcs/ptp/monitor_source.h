// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ptp/wire/monitor.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// Since construction.
struct MonitorCounters {
  std::uint64_t syncs = 0;                ///< samples handed on
  std::uint64_t delays = 0;               ///< samples handed on
  std::uint64_t malformed = 0;            ///< datagrams dropped
  std::uint64_t unknown_tlvs = 0;         ///< passed over
  std::uint64_t missed_syncs = 0;         ///< gaps in the sequence
  std::uint64_t repeated = 0;             ///< the same message again: dropped
  std::uint64_t restarts = 0;             ///< the sequence leapt: transmitter or reporter anew
  std::uint64_t transmitter_changes = 0;  ///< reports of another transmitter
  std::uint64_t reference_jumps = 0;      ///< the reference leapt against the local stamps
};

/// What the reports of another time receiver come to: samples in order, gaps and repetitions
/// counted, a change of the reference noticed.
///
/// Sans-I/O: datagrams go in, samples come out. Their local stamps are readings of whichever clock
/// the reporter uses, and that clock may be steered and stepped: whoever knows it puts them onto
/// its free-running timescale in between. No heap, bounded time.
class MonitorSource {
 public:
  /// The samples as they were reported; none of a datagram that cannot be read.
  [[nodiscard]] MonitorReport on_datagram(std::span<const std::uint8_t> bytes) noexcept;

  /// One sample for a servo.
  struct Event {
    EventPair pair{};
    /// What was learnt before this sample belongs to another reference.
    bool new_reference = false;
  };
  /// `local`: the sample's local stamp on a timescale that nobody steers; only there can a jump of
  /// the reference be told from a step of the clock. No value: the same message as before.
  [[nodiscard]] std::optional<Event> on_sample(const MonitorSample& sample,
                                               FreeRunningTime local) noexcept;

  [[nodiscard]] const MonitorCounters& counters() const noexcept { return counters_; }
  /// The port that the last sample came from.
  [[nodiscard]] const std::optional<PortIdentity>& transmitter() const noexcept {
    return transmitter_;
  }
  /// Between the last two Syncs, by the reference's own stamps; none before the second.
  [[nodiscard]] std::optional<Duration> sync_interval() const noexcept { return interval_; }

 private:
  /// The last sample of one direction.
  struct Last {
    bool known = false;
    std::uint16_t sequence_id = 0;
    std::int64_t local_ns = 0;  ///< as reported
    EventPair pair{};
  };

  /// False: the same message as before.
  [[nodiscard]] bool in_order(const MonitorSample& sample) noexcept;
  [[nodiscard]] bool is_new_reference(const EventPair& pair) noexcept;
  void forget() noexcept;
  [[nodiscard]] Last& last_of(Direction direction) noexcept {
    return direction == Direction::kForward ? last_sync_ : last_delay_;
  }

  std::optional<PortIdentity> transmitter_{};
  std::optional<Duration> interval_{};
  Last last_sync_{};
  Last last_delay_{};
  MonitorCounters counters_{};
};

}  // namespace ftcs::ptp
