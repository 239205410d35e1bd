// SPDX-License-Identifier: MIT
#include "ftcs/daemon/management_client.h"

#include <chrono>
#include <string_view>
#include <vector>

namespace ftcs::daemon {
namespace {

/// linuxptp after 4.4 has its sockets in a folder of their own, and one that only answers: where
/// DIR/ptp4l is meant, DIR/ptp/ptp4l is too, and those that may be asked by everybody.
std::vector<std::string> names_of(const std::string& path) {
  constexpr std::string_view kName = "/ptp4l";
  if (!path.ends_with(kName)) return {path};
  const std::string folder = path.substr(0, path.size() - kName.size());
  std::vector<std::string> names;
  for (const char* name : {"/ptp/ptp4l", "/ptp4l", "/ptp/ptp4lro", "/ptp4lro"}) {
    names.push_back(folder + name);
  }
  return names;
}

}  // namespace

Result<ManagementClient, platform::OsError> ManagementClient::open(const PortAddress& address) {
  auto socket = platform::LocalSocket::client(address.socket);
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
  const auto bytes = ptp::encode_management(question);
  for (const std::string& name : names_of(address_.socket)) {
    if (!socket_.send(name, bytes.view())) return;  // somebody has it
  }
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
