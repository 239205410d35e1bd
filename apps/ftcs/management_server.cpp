// SPDX-License-Identifier: MIT
#include "apps/ftcs/management_server.h"

#include <algorithm>

namespace ftcs::app {
namespace {

constexpr int kAnswersAtOnce = 16;

std::span<const std::uint8_t> octets(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

bool is_status_query(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kStatusQuery.size() &&
         std::equal(kStatusQuery.begin(), kStatusQuery.end(), bytes.begin());
}

}  // namespace

Result<ManagementServer, platform::OsError> ManagementServer::open(const std::string& path) {
  auto socket = platform::LocalSocket::bind(path);
  if (!socket) return socket.error();
  return ManagementServer(std::move(*socket));
}

void ManagementServer::serve(Managed& port) {
  for (int i = 0; i < kAnswersAtOnce; ++i) {
    const auto request = socket_.receive();
    if (!request) return;
    // Who cannot be reached has gone: nothing that could be done about it.
    if (is_status_query(request->bytes)) {
      (void)socket_.send(request->sender, octets(port.status(responder_.counters())));
    } else if (const auto answer = responder_.answer(request->bytes, port.managed_port())) {
      (void)socket_.send(request->sender, answer->view());
    }
  }
}

}  // namespace ftcs::app
