// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/daemon/ptp_options.h"
#include "ftcs/ptp/wire/identity.h"

namespace ftcs::daemon {

/// What a port of either role takes from the options alike: ptp::TimeReceiverConfig and
/// ptp::TimeTransmitterConfig have these members in common.
template <class Config>
[[nodiscard]] Config port_config(const PtpOptions& options, const ptp::PortIdentity& identity) {
  Config config;
  config.port = identity;
  config.domain = options.protocol.domain;
  config.major_sdo_id = options.protocol.major_sdo_id;
  config.minor_version = options.protocol.minor_version;
  config.log_announce_interval = options.protocol.log_announce_interval;
  config.log_min_delay_req_interval = options.protocol.log_min_delay_req_interval;
  config.unicast = options.socket.unicast.has_value();
  config.delay_mechanism = options.protocol.delay_mechanism;
  config.peer_delay = options.protocol.peer_delay_config();
  config.assume_two_step = options.protocol.assume_two_step;
  config.security = options.protocol.security ? &options.protocol.security->association() : nullptr;
  return config;
}

}  // namespace ftcs::daemon
