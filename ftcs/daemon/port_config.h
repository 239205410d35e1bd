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
  config.domain = options.domain;
  config.major_sdo_id = options.major_sdo_id;
  config.minor_version = options.minor_version;
  config.log_announce_interval = options.log_announce_interval;
  config.log_min_delay_req_interval = options.log_min_delay_req_interval;
  config.unicast = options.socket.unicast.has_value();
  config.delay_mechanism = options.delay_mechanism;
  config.peer_delay = options.peer_delay_config();
  config.assume_two_step = options.assume_two_step;
  config.security = options.security ? &options.security->association() : nullptr;
  return config;
}

}  // namespace ftcs::daemon
