// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_transmitter.h"

#include <utility>

#include "apps/ftcs/commands.h"

namespace ftcs::app {
namespace {

ptp::TimeTransmitterConfig core_config(const PtpOptions& options,
                                       const ptp::PortIdentity& identity) {
  ptp::TimeTransmitterConfig config;
  config.port = identity;
  config.domain = options.domain;
  config.major_sdo_id = options.major_sdo_id;
  config.minor_version = options.minor_version;
  config.log_announce_interval = options.log_announce_interval;
  config.log_sync_interval = options.log_sync_interval;
  config.log_min_delay_req_interval = options.log_min_delay_req_interval;
  config.priority1 = options.priority1;
  config.priority2 = options.priority2;
  config.quality = options.quality;
  config.utc_offset = options.utc_offset;
  config.time_source = options.time_source;
  config.unicast = options.socket.unicast.has_value();
  return config;
}

}  // namespace

PtpTransmitter::PtpTransmitter(platform::Kernel& kernel, const PtpOptions& options, Log& log,
                               std::unique_ptr<platform::TimestampClock> timestamps,
                               const ptp::PortIdentity& identity)
    : PtpPort(kernel, options, log, std::move(timestamps)), core_(core_config(options, identity)) {}

ReferenceTime PtpTransmitter::reference_at(FreeRunningTime instant) {
  return ReferenceTime{clock().local_at(instant).since_epoch()};
}

ptp::ActionList PtpTransmitter::start(FreeRunningTime now) { return core_.start(now); }

ptp::ActionList PtpTransmitter::on_event(std::span<const std::uint8_t> bytes,
                                         FreeRunningTime received, FreeRunningTime now) {
  return core_.on_event_message(bytes, reference_at(received), now);
}

ptp::ActionList PtpTransmitter::on_general(std::span<const std::uint8_t> bytes,
                                           FreeRunningTime now) {
  return core_.on_general_message(bytes, now);
}

ptp::ActionList PtpTransmitter::on_sent(std::uint16_t sequence_id,
                                        std::optional<FreeRunningTime> sent, FreeRunningTime now) {
  return sent ? core_.on_transmit_timestamp(sequence_id, reference_at(*sent), now)
              : core_.on_transmit_timestamp_missing(sequence_id, now);
}

ptp::ActionList PtpTransmitter::on_timer(FreeRunningTime now) { return core_.on_timer(now); }

ptp::ActionList PtpTransmitter::on_link_change(bool up, FreeRunningTime now) {
  return up ? core_.on_link_up(now) : core_.on_link_down(now);
}

std::optional<FreeRunningTime> PtpTransmitter::deadline() const { return core_.deadline(); }

int PtpTransmitter::finish() {
  using ptp::Counter;
  const ptp::Counters& counters = core_.counters();
  const bool transmitting = core_.state() == ptp::PortState::kTimeTransmitter;
  log()(LogLevel::kNotice, "summary: {}, {} Syncs sent, {} delay requests answered",
        transmitting ? "transmitting" : "not transmitting", counters[Counter::kSyncSent],
        counters[Counter::kDelayRespSent]);
  log_unusual(counters);
  return transmitting ? kSuccess : kNotLocked;
}

}  // namespace ftcs::app
