// SPDX-License-Identifier: MIT
#include "ftcs/daemon/ptp_transmitter.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/port_config.h"
#include "ftcs/daemon/status_report.h"

namespace ftcs::daemon {
namespace {

ptp::TimeTransmitterConfig core_config(const PtpOptions& options,
                                       const ptp::PortIdentity& identity) {
  auto config = port_config<ptp::TimeTransmitterConfig>(options, identity);
  config.log_sync_interval = options.transmitter.log_sync_interval;
  config.priority1 = options.transmitter.priority1;
  config.priority2 = options.transmitter.priority2;
  config.quality = options.transmitter.quality;
  config.utc_offset = options.transmitter.utc_offset;
  config.time_source = options.transmitter.time_source;
  config.follow_up_info = options.transmitter.follow_up_info;
  config.path_trace = options.transmitter.path_trace;
  return config;
}

}  // namespace

PtpTransmitter::PtpTransmitter(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                               std::unique_ptr<platform::TimestampClock> timestamps,
                               const PortFacts& facts)
    : PtpCorePort(kernel, options, log, std::move(timestamps),
                  core_config(options, facts.identity)),
      facts_(facts) {}

// Receivers follow the better one; this port gives way to nobody.
void PtpTransmitter::act(const ptp::Action& action) {
  constexpr std::size_t kMostTold = 16;
  const auto* const seen = std::get_if<ptp::TransmitterSeen>(&action);
  if (seen == nullptr || others_.size() == kMostTold ||
      std::find(others_.begin(), others_.end(), seen->port) != others_.end()) {
    return;
  }
  others_.push_back(seen->port);
  log()(LogLevel::kWarning,
        "port 1 ({}): {} announces itself in domain {} too: receivers follow the better of the two "
        "(priority1, clockClass), and this port goes on",
        options().interface, to_text(seen->port).view(), options().protocol.domain);
}

int PtpTransmitter::finish() {
  using ptp::Counter;
  const ptp::Counters& counters = core().counters();
  const bool transmitting = core().state() == ptp::PortState::kTimeTransmitter;
  log()(LogLevel::kNotice, "summary: {}, {} Syncs sent, {} delay requests answered",
        transmitting ? "transmitting" : "not transmitting", counters[Counter::kSyncSent],
        counters[Counter::kDelayRespSent]);
  log_peer_delay(core().peer_delay());
  log_unusual(counters);
  return transmitting ? kSuccess : kNotLocked;
}

ptp::ManagedPort PtpTransmitter::managed_port() { return data_sets(options(), facts_, core()); }

std::string PtpTransmitter::status(const ptp::ManagementCounters& management) {
  const StatusOfPort port{options(), facts_, seconds_since_start(), management};
  return transmitter_status(port, core(), diagnosis::link_trouble(seen_of_link()));
}

}  // namespace ftcs::daemon
