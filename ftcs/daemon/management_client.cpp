// SPDX-License-Identifier: MIT
#include "ftcs/daemon/management_client.h"

#include <chrono>

namespace ftcs::daemon {

Result<ManagementClient, platform::OsError> ManagementClient::open(const PortAddress& address) {
  auto socket = platform::LocalSocket::client();
  if (!socket) return socket.error();
  return ManagementClient(address, std::move(*socket));
}

// To all ports, as pmc -b 0 asks.
void ManagementClient::ask(ptp::ManagementId id) {
  ptp::ManagementMessage question;
  question.header.domain = address_.domain;
  question.header.major_sdo_id = address_.major_sdo_id;
  question.header.minor_version = 0;  // every version of linuxptp takes it
  question.body.target.clock.octets.fill(0xFF);
  question.body.target.port = 0xFFFF;
  question.id = id;
  question.header.sequence_id = ++asked_;
  (void)socket_.send(address_.socket, ptp::encode_management(question).view());
}

std::optional<ptp::ManagementData> ManagementClient::next_answer() {
  while (const auto datagram = socket_.receive()) {
    const auto message = ptp::decode_management(datagram->bytes);
    if (!message || !message->data) continue;
    const auto age = static_cast<std::uint16_t>(asked_ - message->header.sequence_id);
    if (age < kAwaited && age < asked_) return *message->data;
  }
  return std::nullopt;
}

std::optional<ptp::ManagementData> ManagementClient::wait_for_answer(int patience_ms) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::milliseconds{patience_ms};
  while (true) {
    if (auto answer = next_answer()) return answer;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    if (left.count() <= 0) return std::nullopt;
    socket_.wait(static_cast<int>(left.count()));
  }
}

}  // namespace ftcs::daemon
