// SPDX-License-Identifier: MIT
#include "ftcs/daemon/management_server.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace ftcs::daemon {
namespace {

constexpr int kAnswersAtOnce = 16;
constexpr std::size_t kMostSubscribers = 16;  // who comes then is answered, and told nothing

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

void ManagementServer::serve(Managed& port, FreeRunningTime now) {
  for (int i = 0; i < kAnswersAtOnce; ++i) {
    const auto request = socket_.receive();
    if (!request) break;
    answer(*request, port, now);
  }
  notify(port, now);
}

// Who cannot be reached has gone: nothing that could be done about it.
void ManagementServer::answer(const platform::LocalSocket::Datagram& request, Managed& port,
                              FreeRunningTime now) {
  if (is_status_query(request.bytes)) {
    (void)socket_.send(request.sender, octets(port.status(responder_.counters())));
    return;
  }
  ptp::ManagedPort managed = port.managed_port();
  const auto known = find(request.sender);
  if (known != subscribers_.end() && known->until > now) managed.subscription = known->wanted;
  const auto answer = responder_.answer(request.bytes, managed);
  if (!answer) return;
  (void)socket_.send(request.sender, answer->view());
  if (const auto asked = responder_.take_subscription()) subscribe(request.sender, *asked, now);
}

std::vector<ManagementServer::Subscriber>::iterator ManagementServer::find(
    const std::string& path) {
  return std::ranges::find(subscribers_, path, &Subscriber::path);
}

void ManagementServer::subscribe(const std::string& path,
                                 const ptp::ManagementResponder::Subscription& asked,
                                 FreeRunningTime now) {
  const auto until = now + Duration{std::chrono::seconds{asked.wanted.duration_s}};
  if (const auto known = find(path); known != subscribers_.end()) {
    known->wanted = asked.wanted;
    known->until = until;
    known->identity = asked.subscriber;
  } else if (subscribers_.size() < kMostSubscribers && !path.empty()) {
    subscribers_.push_back({path, asked.subscriber, asked.wanted, until});
  }
}

void ManagementServer::notify(Managed& port, FreeRunningTime now) {
  std::erase_if(subscribers_, [&](const Subscriber& one) { return one.until <= now; });
  if (subscribers_.empty()) {
    told_.reset();
    return;
  }
  const ptp::ManagedPort managed = port.managed_port();
  const auto before = std::exchange(told_, managed.port.state);
  if (!before || *before == managed.port.state) return;
  constexpr auto kBit = std::uint8_t{1} << ptp::SubscribeEventsNp::kPortState;
  for (Subscriber& one : subscribers_) {
    if ((one.wanted.events[0] & kBit) == 0) continue;
    const auto notice =
        ptp::ManagementResponder::port_state_notice(managed, one.identity, one.next_sequence_id++);
    (void)socket_.send(one.path, notice.view());
  }
}

}  // namespace ftcs::daemon
