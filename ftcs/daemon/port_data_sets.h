// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "ftcs/daemon/follower_record.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/ptp/management_responder.h"
#include "ftcs/ptp/monitor_source.h"
#include "ftcs/ptp/time_receiver.h"
#include "ftcs/ptp/time_transmitter.h"

namespace ftcs::daemon {

/// What is the same for every port of ours.
struct PortFacts {
  ptp::PortIdentity identity{};
  std::array<std::uint8_t, 6> address{};  ///< of the interface; zero on loopback
  bool hardware_stamps = false;
};

/// Data sets of a port that receives time.
[[nodiscard]] ptp::ManagedPort data_sets(const PtpOptions& options, const PortFacts& facts,
                                         const ptp::TimeReceiver& core,
                                         const FollowerRecord& record, FreeRunningTime now);
/// Data sets of a port that follows the reports of another time receiver, which say no more about
/// the transmitter than who it is.
[[nodiscard]] ptp::ManagedPort data_sets(const PtpOptions& options, const PortFacts& facts,
                                         ptp::PortState state,
                                         const std::optional<ptp::PortIdentity>& transmitter,
                                         const FollowerRecord& record, FreeRunningTime now);
/// Data sets of a port that is the grandmaster.
[[nodiscard]] ptp::ManagedPort data_sets(const PtpOptions& options, const PortFacts& facts,
                                         const ptp::TimeTransmitter& core);

}  // namespace ftcs::daemon
