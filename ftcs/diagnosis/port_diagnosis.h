// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/diagnosis/finding.h"
#include "ftcs/diagnosis/talkers.h"
#include "ftcs/discipline/telemetry.h"
#include "ftcs/ptp/counters.h"
#include "ftcs/time/duration.h"

namespace ftcs::diagnosis {

/// What the interface lets a port do.
enum class Link : std::uint8_t {
  kUp,
  kNoCarrier,
  kDown,       ///< administratively
  kGone,       ///< unplugged, removed
  kNoAddress,  ///< none of the IP version that is spoken
  kClosed,     ///< the sockets cannot be opened, for another reason
};

/// What a PTP time receiver was told to listen to.
struct PortSettings {
  std::string interface;
  Way way = Way::kUdpIpv4;
  std::array<std::uint8_t, 6> group{};  ///< kEthernet: where Announce and Sync go
  std::uint8_t domain = 0;
  std::uint8_t major_sdo_id = 0;
  bool peer_to_peer = false;
  bool capability_needed = false;  ///< IEEE 802.1AS
  Nanoseconds lowest_peer_delay{};
  Nanoseconds highest_peer_delay{};
  bool unicast = false;              ///< one configured peer instead of the group
  bool steers = true;                ///< else it measures alone
  double announce_interval_s = 2.0;  ///< as far as the port knows
};

/// What came of it, lately: counters are those of the last `seconds`, so that a sentence is of now.
struct PortSeen {
  PortSettings settings{};
  double seconds = 0.0;
  Link link = Link::kUp;
  std::string closed{};          ///< Link::kClosed: the reason
  bool has_transmitter = false;  ///< one is selected
  ptp::Counters counters{};
  Talkers at_port{};                 ///< by our own sockets
  std::optional<Talkers> on_wire{};  ///< by a listener to all frames; none: nobody listened
  std::uint64_t receive_stamps_missing = 0;
  std::uint64_t unicast_dropped = 0;
  std::uint64_t foreign_changes = 0;  ///< of the steered clock, by other programs
  std::string clock{};                ///< its name; empty: a virtual one, which nobody else can set
  std::optional<Duration> peer_delay{};
  // The clock.
  bool locked = false;
  bool path_delay_known = false;
  ServoSnapshot servo{};
  Rate rate{};
  DisciplineCounters samples{};    ///< lately
  bool steers_real_clock = false;  ///< one would be, were this not a trial
  /// Of the real clock that would be steered from the reference, where no step is allowed.
  std::optional<Duration> first_offset{};
  std::optional<std::int64_t> utc_s{};  ///< by the system clock, where it is to be compared
  std::string refusal{};                ///< why the reference's time is not believed; empty: it is
};

/// What is wrong with the link, for receivers and transmitters alike; none: it is up.
[[nodiscard]] std::optional<Finding> link_trouble(const PortSeen& seen);
/// The first thing that stands between the port and its lock, in the order in which things must be
/// there: link, messages, measurement, belief, servo. kLocked: nothing does.
[[nodiscard]] Finding diagnose(const PortSeen& seen);
/// All of them, the decisive one first; and remarks that keep nobody from locking come last.
[[nodiscard]] std::vector<Finding> diagnose_all(const PortSeen& seen);

}  // namespace ftcs::diagnosis
