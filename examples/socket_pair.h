// SPDX-License-Identifier: MIT
// What example 04 talks to: a datagram socket with a PTP time transmitter at its far end.
#pragma once

#include <array>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <optional>
#include <span>
#include <sys/socket.h>
#include <unistd.h>

#include "ftcs/clock/adjustable_clock.h"
#include "ftcs/node/receiver_node.h"
#include "ftcs/ptp/time_transmitter.h"

namespace example {

struct Datagram {
  bool event = false;  ///< of port 319; the others are of port 320
  std::array<std::uint8_t, 128> octets{};
  std::size_t size = 0;
  [[nodiscard]] std::span<const std::uint8_t> view() const { return {octets.data(), size}; }
};

struct Sent {
  ftcs::ptp::EventId id;
  ftcs::FreeRunningTime at;
};

/// None: the event is no message that shall be sent.
[[nodiscard]] inline const ftcs::ptp::SendMessage* to_send(const ftcs::node::ReceiverEvent& event) {
  const auto* action = std::get_if<ftcs::ptp::Action>(&event);
  return action != nullptr ? std::get_if<ftcs::ptp::SendMessage>(action) : nullptr;
}

inline void wait() { usleep(1000); }

class SocketPair {
 public:
  explicit SocketPair(ftcs::FreeRunningSource& host) : host_(host) {
    if (socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, sockets_.data()) != 0) std::abort();
  }
  ~SocketPair() {
    for (const int socket : sockets_) close(socket);
  }
  SocketPair(const SocketPair&) = delete;
  SocketPair& operator=(const SocketPair&) = delete;

  void send(const ftcs::ptp::SendMessage& message) {
    put(sockets_[0], message);
    if (message.channel == ftcs::ptp::Channel::kEvent) sent_.push_back({message.id(), host_.now()});
    far_end();  // at once: what it stamps late would be asymmetry of the path
  }
  /// The stamp of an event message that has left, once, as a kernel's error queue tells it.
  [[nodiscard]] std::optional<Sent> sent() {
    if (sent_.empty()) return std::nullopt;
    const Sent first = sent_.front();
    sent_.pop_front();
    return first;
  }
  [[nodiscard]] std::optional<Datagram> receive() { return get(sockets_[0]); }

  /// A turn of the far end's loop: its clock is the host's, plus a second.
  void far_end() {
    const ftcs::FreeRunningTime now = host_.now();
    if (!started_) perform(transmitter_.start(now), now);
    started_ = true;
    if (transmitter_.deadline() && *transmitter_.deadline() <= now)
      perform(transmitter_.on_timer(now), now);
    while (const auto message = get(sockets_[1])) {
      perform(message->event
                  ? transmitter_.on_event_message(message->view(), reference_at(now), now)
                  : transmitter_.on_general_message(message->view(), now),
              now);
    }
  }

 private:
  [[nodiscard]] static ftcs::ReferenceTime reference_at(ftcs::FreeRunningTime now) {
    return ftcs::ReferenceTime{now.since_epoch() + ftcs::Duration{std::chrono::seconds{1}}};
  }
  void perform(const ftcs::ptp::ActionList& actions, ftcs::FreeRunningTime now) {
    for (const auto& action : actions) {
      const auto* message = std::get_if<ftcs::ptp::SendMessage>(&action);
      if (message == nullptr) continue;
      put(sockets_[1], *message);
      if (message->channel == ftcs::ptp::Channel::kEvent) {
        perform(transmitter_.on_transmit_timestamp(message->id(), reference_at(now), now), now);
      }
    }
  }
  static void put(int socket, const ftcs::ptp::SendMessage& message) {
    std::array<std::uint8_t, 129> octets{};
    octets[0] = message.channel == ftcs::ptp::Channel::kEvent ? 1 : 0;
    std::memcpy(&octets[1], message.bytes.octets.data(), message.bytes.size);
    if (::send(socket, octets.data(), message.bytes.size + 1U, 0) < 0) std::abort();
  }
  [[nodiscard]] static std::optional<Datagram> get(int socket) {
    std::array<std::uint8_t, 129> octets{};
    const ssize_t size = recv(socket, octets.data(), octets.size(), 0);
    if (size < 1) return std::nullopt;
    Datagram datagram{octets[0] != 0, {}, static_cast<std::size_t>(size) - 1};
    std::memcpy(datagram.octets.data(), &octets[1], datagram.size);
    return datagram;
  }

  ftcs::FreeRunningSource& host_;
  std::array<int, 2> sockets_{};
  bool started_ = false;
  std::deque<Sent> sent_{};
  ftcs::ptp::TimeTransmitter transmitter_{{.port = {{2}, 1},
                                           .log_announce_interval = -3,
                                           .log_sync_interval = -4,
                                           .log_min_delay_req_interval = -4}};
};

}  // namespace example
