// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/follower_record.h"
#include "ftcs/daemon/port_data_sets.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/diagnosis/port_diagnosis.h"
#include "ftcs/ptp/management_responder.h"
#include "ftcs/ptp/time_receiver.h"
#include "ftcs/ptp/time_transmitter.h"

namespace ftcs::daemon {

/// What every port has.
struct StatusOfPort {
  const PtpOptions& options;
  const PortFacts& facts;
  double uptime_s;
  const ptp::ManagementCounters& management;
};

// The status as one JSON object; docs/beside-your-tools.md lists the fields. Units end their names;
// what is not known is null.
[[nodiscard]] std::string receiver_status(const StatusOfPort& port, const ptp::TimeReceiver& core,
                                          const FollowerRecord& record,
                                          const diagnosis::PortSeen& seen, FreeRunningTime now);
/// `trouble`: why it does not transmit.
[[nodiscard]] std::string transmitter_status(const StatusOfPort& port,
                                             const ptp::TimeTransmitter& core,
                                             const std::optional<diagnosis::Finding>& trouble);

[[nodiscard]] std::string monitor_status(const StatusOfPort& port, const ptp::MonitorSource& source,
                                         ptp::PortState state, const FollowerRecord& record,
                                         const diagnosis::Finding& finding, FreeRunningTime now);

/// The same for people, as lines "name  value".
struct StatusForPeople {
  std::string text;
  int exit_code = 0;  ///< locked (or transmitting) or not
};
/// None: that is no status of ours.
[[nodiscard]] std::optional<StatusForPeople> read_status(std::string_view json);

}  // namespace ftcs::daemon
