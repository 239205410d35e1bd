// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "ftcs/ptp/wire/codec.h"
#include "test/support/fake_clocks.h"

namespace ftcs::daemon {

inline constexpr double kSecond = 1e9;
inline constexpr double kTai = 37 * kSecond;

/// A kernel with a transmitter 10 us away at its network interface: Announce and one-step Sync once
/// a second, and an answer to each Delay_Req.
class NetworkKernel final : public platform::FakeClocks {
 public:
  double reference_ahead = kTai;  ///< of ideal time
  std::uint16_t flags = ptp::flag::kPtpTimescale | ptp::flag::kUtcOffsetValid;
  std::function<void()> on_second;
  bool is_silent = false;       ///< nothing is announced
  double stamp_delay_ns = 0.0;  ///< until a transmit stamp is there; negative: for ever

  int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept override {
    if (ideal_ns >= next_ns_) transmit();
    while (!late_stamps_.empty() && late_stamps_.front().due_ns <= ideal_ns) {
      const LateStamp& late = late_stamps_.front();
      queue_tx_stamp(late.fd, late.bytes, late.system_ns, late.phc_ns);
      late_stamps_.pop_front();
    }
    int ready = 0;
    for (pollfd& entry : descriptors) {
      entry.revents = 0;
      const auto socket = sockets.find(entry.fd);
      if (socket == sockets.end()) continue;
      if (!socket->second.received.empty()) entry.revents |= POLLIN;
      if (!socket->second.error_queue.empty()) entry.revents |= POLLPRI;
      ready += entry.revents != 0 ? 1 : 0;
    }
    return ready > 0 ? ready : FakeClocks::poll(descriptors, std::min(timeout_ms, 20));
  }
  ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                  const platform::SocketAddress&) noexcept override {
    const auto message = ptp::decode(bytes);
    if (message && std::holds_alternative<ptp::DelayReq>(message->body)) {
      if (stamp_delay_ns >= 0.0) {
        late_stamps_.push_back({ideal_ns + stamp_delay_ns,
                                fd,
                                {bytes.begin(), bytes.end()},
                                stamp(system),
                                stamp(phc)});
      }
      run(kPath);
      ptp::Message answer = about(message->header.sequence_id);
      answer.body = ptp::DelayResp{reference(), message->header.source};
      deliver(320, answer);
    }
    return static_cast<ssize_t>(bytes.size());
  }

 private:
  static constexpr double kPath = 10'000.0;
  struct LateStamp {
    double due_ns = 0.0;
    int fd = -1;
    std::vector<std::uint8_t> bytes;
    std::int64_t system_ns = 0;
    std::int64_t phc_ns = 0;
  };
  static std::int64_t stamp(const Clock& clock) { return kEpoch + std::llround(clock.time_ns); }
  [[nodiscard]] ReferenceTime reference() const {
    return ReferenceTime::from_ns(kEpoch + std::llround(ideal_ns + reference_ahead));
  }
  static ptp::Message about(std::uint16_t sequence) {
    ptp::Message message;
    message.header.source = {ptp::ClockIdentity{{1, 2, 3, 4, 5, 6, 7, 8}}, 1};
    message.header.sequence_id = sequence;
    message.header.log_interval = 0;
    return message;
  }
  void transmit() {
    next_ns_ = ideal_ns + kSecond;
    if (on_second) on_second();
    if (is_silent) return;
    ptp::Message announce = about(sequence_);
    announce.header.flags = flags;
    ptp::Announce body;
    body.utc_offset = 37;
    body.grandmaster = announce.header.source.clock;
    announce.body = body;
    deliver(320, announce);
    ptp::Message sync = about(sequence_++);
    sync.body = ptp::Sync{reference()};
    run(kPath);
    deliver(319, sync);
  }
  void deliver(std::uint16_t port, const ptp::Message& message) {
    const auto bytes = ptp::encode(message);
    const auto view = bytes->view();
    for (auto& [fd, socket] : sockets) {
      if (socket.port != port) continue;
      socket.received.push_back({{view.begin(), view.end()}, stamp(system), stamp(phc)});
    }
  }

  std::deque<LateStamp> late_stamps_;
  double next_ns_ = 0.0;
  std::uint16_t sequence_ = 0;
};

}  // namespace ftcs::daemon
