// SPDX-License-Identifier: MIT
//
// What is simulated is what ships: octets and stamps go through the daemon's loop on a fake kernel,
// and the same octets and stamps into the node on a simulated clock. World: a transmitter about
// 10 us away, Sync eight times a second, an adapter's clock that is 20 ppm fast; time passes only
// while the daemon waits.
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/ptp_receiver.h"
#include "ftcs/daemon/sample_report.h"
#include "ftcs/ptp/wire/codec.h"
#include "ftcs/sim/settable_source.h"
#include "test/support/fake_clocks.h"

namespace ftcs::daemon {
namespace {

using platform::FakeClocks;
using Octets = std::vector<std::uint8_t>;

/// What crossed the edge of the daemon, in its order.
struct Crossing {
  enum class Kind : std::uint8_t { kEvent, kGeneral, kTransmitStamp, kSent };
  Kind kind = Kind::kEvent;
  FreeRunningTime now;
  FreeRunningTime stamp;
  Octets octets;
};

class RecordingKernel final : public FakeClocks {
 public:
  RecordingKernel() {
    reading_ns = phc_reading_ns = 0;
    phc.oscillator = 1.00002;
    add_adapter_clock();
  }
  [[nodiscard]] FreeRunningTime adapter() const {
    return FreeRunningTime::from_ns(kEpoch + std::llround(phc.time_ns));
  }

  int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept override {
    if (ready(descriptors) == 0) pass(static_cast<double>(timeout_ms) * 1e6);
    return ready(descriptors);
  }
  ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                  const platform::SocketAddress&) noexcept override {
    const Octets octets{bytes.begin(), bytes.end()};
    crossings.push_back({Crossing::Kind::kSent, adapter(), {}, octets});
    queue_tx_stamp(fd, bytes, 0, adapter().since_epoch().floor_ns());
    const auto message = ptp::decode(bytes);
    if (message && std::holds_alternative<ptp::DelayReq>(message->body)) {
      const double there = path();
      ptp::Message answer = about(message->header.sequence_id);
      answer.body = ptp::DelayResp{reference(there), message->header.source};
      schedule(there + path(), 320, answer);
    }
    return static_cast<ssize_t>(bytes.size());
  }
  ssize_t receive(int fd, msghdr& message, int flags) noexcept override {
    const bool is_stamp = (flags & MSG_ERRQUEUE) != 0;
    const auto& queue = is_stamp ? sockets[fd].error_queue : sockets[fd].received;
    if (!queue.empty()) {
      using Kind = Crossing::Kind;
      constexpr std::ptrdiff_t kHeaders = 42;
      const Packet& next = queue.front();
      const bool event = sockets[fd].port == 319;
      crossings.push_back(
          {is_stamp ? Kind::kTransmitStamp
           : event  ? Kind::kEvent
                    : Kind::kGeneral,
           adapter(), FreeRunningTime::from_ns(next.hardware_ns),
           Octets{next.bytes.begin() + (is_stamp ? kHeaders : 0), next.bytes.end()}});
    }
    return FakeClocks::receive(fd, message, flags);
  }

  std::vector<Crossing> crossings;

 private:
  static constexpr double kInterval = 125e6;

  /// 10 us, and up to 200 ns that repeat after 199 messages.
  double path() {
    noise_ = (noise_ * 7 + 11) % 199;
    return 10'000.0 + noise_;
  }
  [[nodiscard]] ReferenceTime reference(double in_ns) const {
    return ReferenceTime::from_ns(kEpoch + std::llround(ideal_ns + in_ns));
  }
  static ptp::Message about(std::uint16_t sequence) {
    ptp::Message message;
    message.header.source = {ptp::ClockIdentity{{1, 2, 3, 4, 5, 6, 7, 8}}, 1};
    message.header.sequence_id = sequence;
    message.header.log_interval = -3;
    return message;
  }
  int ready(std::span<pollfd> descriptors) {
    int count = 0;
    for (pollfd& entry : descriptors) {
      entry.revents = 0;
      const auto socket = sockets.find(entry.fd);
      if (socket == sockets.end()) continue;
      if (!socket->second.received.empty()) entry.revents |= POLLIN;
      if (!socket->second.error_queue.empty()) entry.revents |= POLLPRI;
      count += entry.revents != 0 ? 1 : 0;
    }
    return count;
  }
  void pass(double most_ns) {
    if (ideal_ns >= next_sync_ns_) transmit();
    double until = std::min(ideal_ns + most_ns, next_sync_ns_);
    if (!arrivals_.empty()) until = std::min(until, arrivals_.begin()->first);
    run(std::max(until - ideal_ns, 0.0));
    while (!arrivals_.empty() && arrivals_.begin()->first <= ideal_ns) {
      const auto [port, octets] = arrivals_.begin()->second;
      arrivals_.erase(arrivals_.begin());
      for (auto& [fd, socket] : sockets) {
        if (socket.port == port) {
          socket.received.push_back({octets, 0, adapter().since_epoch().floor_ns()});
        }
      }
    }
  }
  void transmit() {
    next_sync_ns_ = ideal_ns + kInterval;
    ptp::Message sync = about(sequence_);
    sync.body = ptp::Sync{reference(0.0)};
    schedule(path(), 319, sync);
    if (sequence_++ % 8 != 0) return;
    ptp::Message announce = about(sequence_);
    announce.header.log_interval = 0;
    announce.header.flags = ptp::flag::kPtpTimescale;
    ptp::Announce body;
    body.grandmaster = announce.header.source.clock;
    announce.body = body;
    schedule(2 * path(), 320, announce);
  }
  void schedule(double in_ns, std::uint16_t port, const ptp::Message& message) {
    const auto bytes = ptp::encode(message);
    const auto view = bytes->view();
    arrivals_.emplace(ideal_ns + in_ns, std::pair{port, Octets{view.begin(), view.end()}});
  }

  std::multimap<double, std::pair<std::uint16_t, Octets>> arrivals_;
  double next_sync_ns_ = 0.0;
  std::uint16_t sequence_ = 0;
  int noise_ = 1;
};

/// The node on a simulated clock, fed with what was recorded.
class Replay {
 public:
  Replay(const PtpOptions& options, const ptp::PortIdentity& identity, std::uint64_t seed)
      : clock_(source_,
               {options.clock.start->free_running,
                LocalTime::from_ns(options.clock.start->realtime_ns) + options.clock.initial_offset,
                Rate{}, options.follower.servo.limits}),
        node_(receiver_node_config(options, {identity, {}, true}, std::nullopt, seed), clock_),
        start_(options.clock.start->free_running) {
    set(start_);
    node_.start(start_);
    take();
  }
  void feed(const Crossing& crossing) {
    using Kind = Crossing::Kind;
    set(crossing.now);
    if (crossing.kind == Kind::kSent) {
      node_.on_timer(now_);
    } else if (crossing.kind == Kind::kTransmitStamp) {
      node_.on_transmit_timestamp(ptp::event_id(crossing.octets), crossing.stamp, now_);
    } else if (crossing.kind == Kind::kEvent) {
      node_.on_event_message(crossing.octets, crossing.stamp, now_);
    } else {
      node_.on_general_message(crossing.octets, now_);
    }
    take();
  }

  std::vector<std::string> lines;  ///< as --json
  std::vector<Octets> sent;

 private:
  void set(FreeRunningTime now) {
    now_ = now;
    source_.set(now);
  }
  void take() {
    while (const auto event = node_.next()) {
      if (const auto* steered = std::get_if<node::Steered>(&*event)) add(*steered);
      const auto* action = std::get_if<ptp::Action>(&*event);
      const auto* message = action != nullptr ? std::get_if<ptp::SendMessage>(action) : nullptr;
      if (message == nullptr) continue;
      const auto view = message->bytes.view();
      sent.emplace_back(view.begin(), view.end());
    }
  }
  void add(const node::Steered& steered) {
    const Telemetry& telemetry = steered.telemetry;
    if (telemetry.direction != Direction::kForward) return;
    const bool used = telemetry.verdict == SampleVerdict::kUsed;
    lines.push_back(
        json_line({(now_ - start_).seconds(), used ? telemetry.servo.offset : steered.perceived,
                   telemetry.servo.offset_known, telemetry}));
  }

  sim::SettableSource source_;
  VirtualClock clock_;
  node::ReceiverNode node_;
  FreeRunningTime start_;
  FreeRunningTime now_{};
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

class SameCommands : public testing::TestWithParam<ServoKind> {};

TEST_P(SameCommands, through_the_daemons_loop_and_in_the_simulator) {
  RecordingKernel kernel;
  PtpOptions options;
  options.interface = options.socket.interface = "eth0";
  options.timestamps = platform::TimestampMode::kHardware;
  options.protocol.log_min_delay_req_interval = -3;
  options.follower.servo.kind = GetParam();
  options.clock.initial_offset = Duration::from_ns(50e3);
  options.clock.start = {kernel.adapter(), FakeClocks::kEpoch};
  options.duration = Duration::from_ns(20e9);
  options.output = Output::kJson;
  options.log_level = 3;
  const ptp::PortIdentity identity{ptp::ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};
  options.protocol.clock_identity = identity.clock;
  const auto seed = static_cast<std::uint64_t>(std::llround(kernel.raw));

  testing::internal::CaptureStdout();
  EXPECT_EQ(run_ptp(kernel, options), kSuccess) << "locked";
  const auto daemon = lines_of(testing::internal::GetCapturedStdout());

  Replay replay(options, identity, seed);
  std::vector<Octets> sent;
  for (const Crossing& crossing : kernel.crossings) {
    if (crossing.kind == Crossing::Kind::kSent) sent.push_back(crossing.octets);
    replay.feed(crossing);
  }
  EXPECT_GT(daemon.size(), 150U);
  ASSERT_EQ(replay.lines.size(), daemon.size());
  for (std::size_t i = 0; i < daemon.size(); ++i) EXPECT_EQ(replay.lines[i], daemon[i]) << i;
  EXPECT_GT(sent.size(), 100U);
  EXPECT_EQ(replay.sent, sent);
}

INSTANTIATE_TEST_SUITE_P(Servos, SameCommands,
                         testing::Values(ServoKind::kAdaptive, ServoKind::kFtcs,
                                         ServoKind::kLinuxptpPi));

}  // namespace
}  // namespace ftcs::daemon
