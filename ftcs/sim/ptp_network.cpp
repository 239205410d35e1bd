// SPDX-License-Identifier: MIT
#include "ftcs/sim/ptp_network.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "ftcs/node/receiver_node.h"
#include "ftcs/ptp/time_transmitter.h"
#include "ftcs/sim/chain.h"
#include "ftcs/sim/event_queue.h"
#include "ftcs/time/relabel.h"

namespace ftcs::sim {
namespace {

/// A driver hands a transmit stamp over some time after the frame left.
constexpr Nanoseconds kStampLatency{10'000};
/// A timer never fires early, not even by the resolution of the oscillator.
constexpr Nanoseconds kTimerMargin{1};

enum class Port : std::uint8_t { kTransmitter, kReceiver };
enum class EventKind : std::uint8_t { kStart, kTimer, kMessage, kTransmitStamp, kTruth };

struct Event {
  EventKind kind = EventKind::kTruth;
  Port port = Port::kReceiver;
  std::size_t node = 0;
  ptp::Channel channel = ptp::Channel::kEvent;
  TrueTime sent{};
  ptp::MessageBytes bytes{};
};

ptp::PortIdentity identity(std::size_t node, Port port) {
  ptp::PortIdentity result{};
  result.clock.octets[0] = port == Port::kTransmitter ? 0x0A : 0x0B;
  result.clock.octets[6] = static_cast<std::uint8_t>(node >> 8);
  result.clock.octets[7] = static_cast<std::uint8_t>(node & 0xFF);
  result.port = 1;
  return result;
}

std::int8_t log_interval(Duration interval) {
  return static_cast<std::int8_t>(std::lround(std::log2(interval.seconds())));
}

ptp::DelayMechanism delay_mechanism(const TwoWaySpec& spec) {
  return spec.peer_to_peer ? ptp::DelayMechanism::kPeerToPeer : ptp::DelayMechanism::kEndToEnd;
}

ptp::TimeTransmitterConfig transmitter_config(const TwoWaySpec& spec, std::size_t node) {
  ptp::TimeTransmitterConfig config;
  config.port = identity(node, Port::kTransmitter);
  config.log_sync_interval = log_interval(spec.interval);
  config.log_min_delay_req_interval = log_interval(spec.interval);
  config.log_announce_interval = log_interval(spec.interval);
  config.delay_mechanism = delay_mechanism(spec);
  config.peer_delay.log_min_interval = log_interval(spec.interval);
  return config;
}

node::ReceiverNodeConfig receiver_config(const TwoWaySpec& spec, std::uint64_t seed,
                                         std::size_t node) {
  node::ReceiverNodeConfig config;
  config.port.port = identity(node, Port::kReceiver);
  config.port.log_announce_interval = log_interval(spec.interval);
  config.port.log_min_delay_req_interval = log_interval(spec.interval);
  config.port.delay_mechanism = delay_mechanism(spec);
  config.port.peer_delay.log_min_interval = log_interval(spec.interval);
  config.port.seed = seed * 1'000'003 + node + 1;
  config.follower.discipline = spec.nodes[node].discipline;
  return config;
}

/// A link of the chain: the transmitter at its upper end, the receiver at its lower one.
struct Ports {
  Ports(const ptp::TimeTransmitterConfig& transmits, const node::ReceiverNodeConfig& receives,
        AdjustableClock& clock)
      : transmitter(transmits), receiver(receives, clock) {}

  ptp::TimeTransmitter transmitter;
  node::ReceiverNode receiver;
  std::optional<TrueTime> transmitter_timer{};  ///< armed for
  std::optional<TrueTime> receiver_timer{};
};

class PtpRun {
 public:
  PtpRun(const TwoWaySpec& spec, std::uint64_t seed, TwoWayObserver& observer)
      : chain_(spec, seed, observer) {
    for (std::size_t i = 0; i < chain_.size(); ++i) {
      ports_.push_back(std::make_unique<Ports>(
          transmitter_config(spec, i), receiver_config(spec, seed, i), chain_.node(i).clock));
      schedule_start(i, Port::kReceiver, TrueTime{});
      schedule_start(i, Port::kTransmitter, chain_.phase(i));
    }
    queue_.schedule(chain_.start(), Event{});
  }

  PtpRunCounters run() {
    while (!queue_.empty() && queue_.next_time() < chain_.end()) {
      const auto entry = queue_.pop();
      now_ = entry.time;
      handle(entry.event);
    }
    return counters_;
  }

 private:
  void schedule_start(std::size_t node, Port port, TrueTime at) {
    Event event;
    event.kind = EventKind::kStart;
    event.port = port;
    event.node = node;
    queue_.schedule(at, event);
  }

  /// The oscillator that drives a port's timers. The grandmaster's is true time.
  [[nodiscard]] FreeRunningTime port_now(const Event& at) {
    if (at.port == Port::kReceiver) return chain_.node(at.node).oscillator.reading_at(now_);
    if (at.node == 0) return relabel<FreeRunningTime>(now_);
    return chain_.node(at.node - 1).oscillator.reading_at(now_);
  }
  [[nodiscard]] TrueTime true_time(const Event& at, FreeRunningTime reading) {
    if (at.port == Port::kReceiver) return chain_.node(at.node).oscillator.true_at(reading);
    if (at.node == 0) return relabel<TrueTime>(reading);
    return chain_.node(at.node - 1).oscillator.true_at(reading);
  }

  void handle(const Event& event) {
    if (event.kind == EventKind::kTruth) {
      chain_.look(now_, [this](std::size_t i) -> const Telemetry& {
        return ports_[i]->receiver.discipline().latest();
      });
      return queue_.schedule(chain_.look_time(++looks_), Event{});
    }
    Ports& ports = *ports_[event.node];
    if (event.kind == EventKind::kTimer) {
      auto& armed = event.port == Port::kReceiver ? ports.receiver_timer : ports.transmitter_timer;
      if (armed != now_) return;  // replaced by an earlier one
      armed.reset();
    }
    if (event.kind == EventKind::kMessage) ++counters_.messages;
    if (event.port == Port::kReceiver) {
      turn(ports.receiver, event);
    } else {
      for (const ptp::Action& action : input(ports.transmitter, event)) act(event, action);
    }
    arm(event);
  }

  /// One turn of the daemon's loop: an input, what it brings about, a look at the silence.
  void turn(node::ReceiverNode& receiver, const Event& event) {
    chain_.node(event.node).set_time(now_);
    input(receiver, event);
    take_all(receiver, event);
    receiver.on_silence(port_now(event));
    take_all(receiver, event);
  }

  void take_all(node::ReceiverNode& receiver, const Event& event) {
    for (;;) {
      const double error_ns = chain_.time_error_ns(event.node, now_);  // before it is steered
      const auto told = receiver.next();
      if (!told) return;
      if (const auto* action = std::get_if<ptp::Action>(&*told)) act(event, *action);
      if (const auto* steered = std::get_if<node::Steered>(&*told)) {
        ++counters_.pairs;
        chain_.show(event.node, now_, error_ns, steered->telemetry, steered->paces);
      }
    }
  }

  void input(node::ReceiverNode& receiver, const Event& event) {
    const FreeRunningTime now = port_now(event);
    const std::span<const std::uint8_t> bytes = event.bytes.view();
    switch (event.kind) {
      case EventKind::kStart:
        return receiver.start(now);
      case EventKind::kTimer:
        return receiver.on_timer(now);
      case EventKind::kTransmitStamp:
        return receiver.on_transmit_timestamp(ptp::event_id(bytes),
                                              chain_.node(event.node).stamp(event.sent), now);
      case EventKind::kMessage:
        if (event.channel == ptp::Channel::kGeneral) return receiver.on_general_message(bytes, now);
        return receiver.on_event_message(bytes, chain_.node(event.node).stamp(now_), now);
      case EventKind::kTruth:
        return;
    }
  }

  [[nodiscard]] ptp::ActionList input(ptp::TimeTransmitter& transmitter, const Event& event) {
    const FreeRunningTime now = port_now(event);
    const std::span<const std::uint8_t> bytes = event.bytes.view();
    switch (event.kind) {
      case EventKind::kStart:
        return transmitter.start(now);
      case EventKind::kTimer:
        return transmitter.on_timer(now);
      case EventKind::kTransmitStamp:
        return transmitter.on_transmit_timestamp(
            ptp::event_id(bytes), chain_.upstream_stamp(event.node, event.sent), now);
      case EventKind::kMessage:
        if (event.channel == ptp::Channel::kGeneral)
          return transmitter.on_general_message(bytes, now);
        return transmitter.on_event_message(bytes, chain_.upstream_stamp(event.node, now_), now);
      case EventKind::kTruth:
        break;
    }
    return {};
  }

  void act(const Event& cause, const ptp::Action& action) {
    if (const auto* send = std::get_if<ptp::SendMessage>(&action)) transmit(cause, *send);
  }

  void transmit(const Event& from, const ptp::SendMessage& message) {
    const bool downward = from.port == Port::kTransmitter;
    Node& node = chain_.node(from.node);
    const Arrivals arrivals = downward ? node.forward.send(now_) : node.backward.send(now_);
    Event event = from;
    event.kind = EventKind::kMessage;
    event.port = downward ? Port::kReceiver : Port::kTransmitter;
    event.channel = message.channel;
    event.bytes = message.bytes;
    for (int copy = 0; copy < arrivals.count; ++copy) {
      queue_.schedule(arrivals.times[static_cast<std::size_t>(copy)], event);
    }
    if (message.channel != ptp::Channel::kEvent) return;
    event.kind = EventKind::kTransmitStamp;
    event.port = from.port;
    event.sent = now_;
    queue_.schedule(now_ + kStampLatency, event);
  }

  /// A timer for the port's deadline, unless an earlier one is set.
  void arm(const Event& event) {
    Ports& ports = *ports_[event.node];
    const bool receiver = event.port == Port::kReceiver;
    const auto deadline = receiver ? ports.receiver.deadline() : ports.transmitter.deadline();
    if (!deadline) return;
    std::optional<TrueTime>& armed = receiver ? ports.receiver_timer : ports.transmitter_timer;
    const TrueTime at = std::max(true_time(event, *deadline), now_) + kTimerMargin;
    if (armed && *armed <= at) return;
    armed = at;
    Event timer;
    timer.kind = EventKind::kTimer;
    timer.port = event.port;
    timer.node = event.node;
    queue_.schedule(at, timer);
  }

  Chain chain_;
  std::vector<std::unique_ptr<Ports>> ports_;
  EventQueue<Event> queue_;
  TrueTime now_{};
  std::uint64_t looks_ = 0;
  PtpRunCounters counters_;
};

}  // namespace

PtpRunCounters run_ptp_network(const TwoWaySpec& spec, std::uint64_t seed,
                               TwoWayObserver& observer) {
  return PtpRun(spec, seed, observer).run();
}

}  // namespace ftcs::sim
