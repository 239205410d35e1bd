// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/sim/two_way.h"

namespace ftcs::sim {

/// What the PTP ports of a run counted.
struct PtpRunCounters {
  std::uint64_t messages = 0;  ///< octet strings handed to a port
  std::uint64_t pairs = 0;     ///< that the time receivers emitted
};

/// The world of run_two_way, but the messages are real: a time transmitter (IEEE 1588) for each
/// link, the shipped TimeReceiver at each node, octets through the links, two-step Sync, Announce,
/// Delay_Req at the receiver's own instants. The first transmitter is the grandmaster; each node's
/// transmitter stamps with its steered clock.
///
/// Valid: spec.interval is 2^n seconds, -7 <= n <= 7. interval_spread and two_way do not apply.
PtpRunCounters run_ptp_network(const TwoWaySpec& spec, std::uint64_t seed,
                               TwoWayObserver& observer);

}  // namespace ftcs::sim
