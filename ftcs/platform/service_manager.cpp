// SPDX-License-Identifier: MIT
#include "ftcs/platform/service_manager.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace ftcs::platform {
namespace {

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before any thread
  return value == nullptr ? std::string_view{} : std::string_view{value};
}

std::int64_t number(std::string_view text) {
  std::int64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

ServiceManager::ServiceManager(std::string socket, std::int64_t watchdog_us)
    : socket_(std::move(socket)), watchdog_ns_(std::max<std::int64_t>(watchdog_us, 0) * 1000) {
  if (!socket_.empty()) fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  // A loop at real-time priority speaks through it: room once, never again.
  sentence_.reserve(kSentence);
  datagram_.reserve(kSentence + sizeof "STATUS=");
}

ServiceManager ServiceManager::from_environment() {
  const std::string_view pid = environment("WATCHDOG_PID");
  const bool ours = pid.empty() || number(pid) == getpid();
  return ServiceManager{std::string{environment("NOTIFY_SOCKET")},
                        ours ? number(environment("WATCHDOG_USEC")) : 0};
}

ServiceManager::ServiceManager(ServiceManager&& other) noexcept
    : socket_(std::move(other.socket_)),
      watchdog_ns_(other.watchdog_ns_),
      fd_(std::exchange(other.fd_, -1)),
      ready_(other.ready_),
      alive_ns_(other.alive_ns_),
      sentence_(std::move(other.sentence_)),
      datagram_(std::move(other.datagram_)) {}

ServiceManager::~ServiceManager() {
  if (fd_ >= 0) close(fd_);
}

void ServiceManager::ready() {
  if (!ready_) ready_ = send("READY=1");
}

void ServiceManager::status(std::string_view sentence) {
  if (sentence == sentence_) return;
  sentence_ = sentence;
  std::replace(sentence_.begin(), sentence_.end(), '\n', ' ');  // one line is one assignment
  datagram_ = "STATUS=";
  datagram_ += sentence_;
  send(datagram_);
}

void ServiceManager::stopping() { send("STOPPING=1"); }

void ServiceManager::alive(std::int64_t now_ns) {
  if (watchdog_ns_ == 0 || (alive_ns_ && now_ns - *alive_ns_ < watchdog_ns_ / 4)) return;
  alive_ns_ = now_ns;
  send("WATCHDOG=1");
}

bool ServiceManager::send(std::string_view text) {
  if (fd_ < 0) return true;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(socket_.size(), sizeof address.sun_path - 1);
  std::memcpy(address.sun_path, socket_.data(), length);
  if (address.sun_path[0] == '@') address.sun_path[0] = '\0';
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  const bool sent = sendto(fd_, text.data(), text.size(), MSG_NOSIGNAL, to, size) >= 0;
  error_ = sent ? std::nullopt : std::optional{os_error(errno, socket_)};
  return sent;
}

}  // namespace ftcs::platform
