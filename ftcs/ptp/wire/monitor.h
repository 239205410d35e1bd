// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "ftcs/ptp/wire/codec.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// One timestamped message that another time receiver on this machine saw, as it reports it.
struct MonitorSample {
  Direction direction = Direction::kForward;
  PortIdentity transmitter{};  ///< sourcePortIdentity
  std::uint16_t sequence_id = 0;
  ReferenceTime reference{};  ///< forward: t1 + corrections; backward: t4 - corrections
  std::int64_t local_ns = 0;  ///< t2 or t3 on the clock that took the stamps, since its epoch
  friend constexpr bool operator==(const MonitorSample&, const MonitorSample&) noexcept = default;
};

/// What one Signaling message reported.
struct MonitorReport {
  static constexpr std::size_t kCapacity = 16;  ///< ptp4l sends one at a time
  PortIdentity receiver{};                      ///< the port that saw them
  std::array<MonitorSample, kCapacity> samples{};
  std::uint8_t size = 0;
  std::uint8_t unknown_tlvs = 0;  ///< of other types: passed over (14.1.1)
  [[nodiscard]] constexpr std::span<const MonitorSample> view() const noexcept {
    return {samples.data(), size};
  }
};

/// Slave event monitoring, IEEE 1588-2019, 16.11: Signaling messages with
/// SLAVE_RX_SYNC_TIMING_DATA (tlvType 0x8004, 16.11.4.1) and linuxptp's own
/// SLAVE_DELAY_TIMING_DATA_NP (0x7F00), which has t3 and t4 in the same manner. ptp4l's
/// slave_event_monitor sends them.
///
/// Errors: as decode(); kUnknownType for another message than Signaling; kMalformedTlv where a
/// value is no port identity and a whole number of elements; kOversized for more samples than a
/// report holds.
[[nodiscard]] Result<MonitorReport, DecodeError> decode_monitor(
    std::span<const std::uint8_t> bytes) noexcept;

}  // namespace ftcs::ptp
