// SPDX-License-Identifier: MIT
#include "ftcs/daemon/port_data_sets.h"

#include <cmath>

namespace ftcs::daemon {
namespace {

constexpr std::uint8_t kTwoStep = 1;          // defaultDS flags
constexpr std::uint8_t kReceiverOnly = 2;     // the same
constexpr std::uint8_t kReceiverClass = 255;  // 7.6.2.5: never a grandmaster
constexpr std::uint16_t kTimeFlags =
    0x3F;  // what of an Announce's flags belongs to timePropertiesDS

ptp::ManagedPort common(const PtpOptions& options, const PortFacts& facts, ptp::PortState state) {
  ptp::ManagedPort port;
  port.identity = facts.identity;
  port.domain = options.protocol.domain;
  port.major_sdo_id = options.protocol.major_sdo_id;

  port.description.physical_layer = ptp::PtpText<32>("IEEE 802.3");
  for (std::size_t i = 0; i < facts.address.size(); ++i) {
    port.description.physical_address.octets[i] = facts.address[i];
  }
  port.description.physical_address.size = std::tuple_size_v<decltype(facts.address)>;
  // 7.4.1: 1 UDP/IPv4, 2 UDP/IPv6, 3 IEEE 802.3, in our order too.
  port.description.network_protocol =
      static_cast<std::uint16_t>(static_cast<int>(options.socket.transport) + 1);
  port.description.product = ptp::PtpText<64>(";;");
  port.description.revision = ptp::PtpText<32>(";;" FTCS_VERSION);
  port.description.profile = {0x00, 0x1B, 0x19, 0x00, 0x01, 0x00};  // default E2E, I.3

  port.default_set.flags = kTwoStep;
  port.default_set.identity = facts.identity.clock;
  port.default_set.domain = options.protocol.domain;
  port.default_set.priority1 = options.transmitter.priority1;
  port.default_set.priority2 = options.transmitter.priority2;
  port.default_set.quality = options.transmitter.quality;

  // Nobody above: the clock is its own parent and grandmaster (9.3.5, Table 30).
  port.parent.parent = {facts.identity.clock, 0};
  port.parent.grandmaster = facts.identity.clock;
  port.parent.grandmaster_quality = options.transmitter.quality;
  port.parent.grandmaster_priority1 = options.transmitter.priority1;
  port.parent.grandmaster_priority2 = options.transmitter.priority2;
  port.time_properties.utc_offset = options.transmitter.utc_offset;
  port.time_properties.time_source = options.transmitter.time_source;
  port.time_status.grandmaster = facts.identity.clock;

  port.port.port = facts.identity;
  port.port.state = state;
  port.port.log_announce_interval = options.protocol.log_announce_interval;
  port.port.announce_receipt_timeout = options.receiver.announce_receipt_timeout;
  port.port.log_sync_interval = options.transmitter.log_sync_interval;
  port.port.log_min_delay_req_interval = options.protocol.log_min_delay_req_interval;
  port.port.log_min_pdelay_req_interval = options.protocol.peer_delay.log_min_interval;
  if (options.protocol.peer_to_peer()) port.port.delay_mechanism = ptp::kPeerToPeerMechanism;
  port.port.version =
      static_cast<std::uint8_t>(options.protocol.minor_version << 4 | ptp::kVersion);
  port.properties = {facts.identity, state, static_cast<std::uint8_t>(facts.hardware_stamps),
                     ptp::PtpText<32>(options.interface)};
  port.stats.port = facts.identity;
  return port;
}

void set_peer_delay(const ptp::PeerDelay& peer_delay, ptp::ManagedPort& port) {
  if (port.port.delay_mechanism != ptp::kPeerToPeerMechanism) return;
  port.port.mean_link_delay = peer_delay.mean_link_delay().value_or(Duration{});
  port.port_np.as_capable = peer_delay.capable() ? 1 : 0;
}

ptp::ManagedPort receiver(const PtpOptions& options, const PortFacts& facts, ptp::PortState state) {
  // Nobody (phc2sys, ftcs phc) shall follow the adapter's clock, which runs freely behind a virtual
  // one. ptp4l's word for that, with free_running, is the same.
  const bool is_free = options.clock.kind == ClockKind::kVirtual && facts.hardware_stamps;
  if (is_free && state == ptp::PortState::kTimeReceiver) state = ptp::PortState::kUncalibrated;
  ptp::ManagedPort port = common(options, facts, state);
  port.default_set.flags |= kReceiverOnly;
  port.default_set.quality.clock_class = kReceiverClass;
  port.parent.grandmaster_quality = port.default_set.quality;
  return port;
}

struct CountedType {
  ptp::MessageType type;
  ptp::Counter received;
  ptp::Counter sent;
};

ptp::PortStatsNp statistics(const ptp::PortIdentity& identity, const ptp::Counters& counters) {
  using ptp::Counter;
  using ptp::MessageType;
  constexpr std::array kCounted{
      CountedType{MessageType::kSync, Counter::kSyncReceived, Counter::kSyncSent},
      CountedType{MessageType::kFollowUp, Counter::kFollowUpReceived, Counter::kFollowUpSent},
      CountedType{MessageType::kDelayReq, Counter::kDelayReqReceived, Counter::kDelayReqSent},
      CountedType{MessageType::kDelayResp, Counter::kDelayRespReceived, Counter::kDelayRespSent},
      CountedType{MessageType::kPdelayReq, Counter::kPdelayReqReceived, Counter::kPdelayReqSent},
      CountedType{MessageType::kPdelayResp, Counter::kPdelayRespReceived, Counter::kPdelayRespSent},
      CountedType{MessageType::kPdelayRespFollowUp, Counter::kPdelayRespFollowUpReceived,
                  Counter::kPdelayRespFollowUpSent},
      CountedType{MessageType::kAnnounce, Counter::kAnnounceReceived, Counter::kAnnounceSent},
  };
  ptp::PortStatsNp stats;
  stats.port = identity;
  for (const CountedType& one : kCounted) {
    stats.received[static_cast<std::size_t>(one.type)] = counters[one.received];
    stats.sent[static_cast<std::size_t>(one.type)] = counters[one.sent];
  }
  return stats;
}

void set_transmitter(const ptp::TransmitterData& transmitter, ptp::ManagedPort& port) {
  const ptp::Announce& announce = transmitter.announce;
  port.parent.parent = transmitter.port;
  port.parent.grandmaster = announce.grandmaster;
  port.parent.grandmaster_quality = announce.quality;
  port.parent.grandmaster_priority1 = announce.priority1;
  port.parent.grandmaster_priority2 = announce.priority2;
  port.time_properties.utc_offset = announce.utc_offset;
  port.time_properties.flags = static_cast<std::uint8_t>(transmitter.flags & kTimeFlags);
  port.time_properties.time_source = announce.time_source;
  port.current.steps_removed = static_cast<std::uint16_t>(announce.steps_removed + 1);
  port.time_status.grandmaster_present = 1;
  port.time_status.grandmaster = announce.grandmaster;
}

void set_sample(const FollowerRecord::Status& status, ptp::ManagedPort& port) {
  if (!status.has_sample || !status.last.offset_known) return;
  port.current.offset = status.last.offset;
  port.current.mean_path_delay = status.last.telemetry.servo.path_delay;
  port.time_status.offset_ns = status.last.offset.rounded_ns();
  port.time_status.ingress_ns = status.last_local.since_epoch().rounded_ns();
}

}  // namespace

ptp::ManagedPort data_sets(const PtpOptions& options, const PortFacts& facts,
                           const ptp::TimeReceiver& core, const FollowerRecord& record,
                           FreeRunningTime now) {
  ptp::ManagedPort port = receiver(options, facts, core.state());
  // In force is what the transmitter demands (7.7.2.4); the other intervals are those that the port
  // would use itself.
  port.port.log_min_delay_req_interval =
      static_cast<std::int8_t>(std::lround(std::log2(core.delay_request_interval().seconds())));
  set_peer_delay(core.peer_delay(), port);
  if (const auto* transmitter = core.transmitter()) {
    set_transmitter(*transmitter, port);
    set_sample(record.status(now), port);
  }
  port.stats = statistics(facts.identity, core.counters());
  return port;
}

ptp::ManagedPort data_sets(const PtpOptions& options, const PortFacts& facts, ptp::PortState state,
                           const std::optional<ptp::PortIdentity>& transmitter,
                           const FollowerRecord& record, FreeRunningTime now) {
  ptp::ManagedPort port = receiver(options, facts, state);
  if (!transmitter) return port;
  port.parent.parent = *transmitter;
  port.parent.grandmaster = transmitter->clock;
  port.current.steps_removed = 1;
  port.time_status.grandmaster_present = 1;
  port.time_status.grandmaster = transmitter->clock;
  set_sample(record.status(now), port);
  if (options.protocol.peer_to_peer()) port.port.mean_link_delay = port.current.mean_path_delay;
  return port;
}

ptp::ManagedPort data_sets(const PtpOptions& options, const PortFacts& facts,
                           const ptp::TimeTransmitter& core) {
  ptp::ManagedPort port = common(options, facts, core.state());
  set_peer_delay(core.peer_delay(), port);
  port.stats = statistics(facts.identity, core.counters());
  return port;
}

}  // namespace ftcs::daemon
