// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/sim/two_way.h"

namespace ftcs::sim {

/// What the PTP ports of a run counted.
struct PtpRunCounters {
  std::uint64_t messages = 0;  ///< octet strings handed to a port
  std::uint64_t pairs = 0;     ///< that steered, or were heard
};

/// The world of run_two_way, but what is simulated is what ships: a time transmitter (IEEE 1588)
/// for each link, at each clock the ReceiverNode that `ftcs ptp` runs, octets through the links,
/// two-step Sync, Announce, Delay_Req at the receiver's own instants or, peer to peer, Pdelay_Req
/// of both ports. The first transmitter is the grandmaster; each node's transmitter stamps with its
/// steered clock.
///
/// Valid: spec.interval is 2^n seconds, -7 <= n <= 7. interval_spread and two_way do not apply.
PtpRunCounters run_ptp_network(const TwoWaySpec& spec, std::uint64_t seed,
                               TwoWayObserver& observer);

}  // namespace ftcs::sim
