// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/platform/os_error.h"

namespace ftcs::platform {

/// What a service tells systemd (sd_notify(3), the protocol of its socket, which is stable): ready,
/// alive, and a sentence for `systemctl status`. Without a service manager every call does nothing.
class ServiceManager {
 public:
  static constexpr std::size_t kSentence = 400;

  /// `socket`: $NOTIFY_SOCKET, a path or @ and an abstract name; empty: nobody listens.
  /// `watchdog_us`: $WATCHDOG_USEC; zero: nobody waits for signs of life.
  explicit ServiceManager(std::string socket, std::int64_t watchdog_us = 0);
  /// From the environment. $WATCHDOG_PID of another process: no watchdog.
  [[nodiscard]] static ServiceManager from_environment();

  ServiceManager(ServiceManager&& other) noexcept;
  ServiceManager& operator=(ServiceManager&&) = delete;
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;
  ~ServiceManager();

  /// Once; later calls do nothing, unless it did not go through (a full queue): then it is told
  /// again. What waits for the service starts now.
  void ready();
  /// A sentence; the same one again is not sent. Up to kSentence octets it touches no heap.
  void status(std::string_view sentence);
  /// The service ends on purpose.
  void stopping();
  /// Once per turn of a loop, with a time that does not run backward: a sign of life, at most four
  /// times per watchdog period.
  void alive(std::int64_t now_ns);

  /// Of the latest datagram, if it did not go through.
  [[nodiscard]] std::optional<OsError> error() const { return error_; }

 private:
  /// False: it did not go through.
  bool send(std::string_view text);

  std::string socket_;
  std::int64_t watchdog_ns_ = 0;
  int fd_ = -1;
  bool ready_ = false;
  std::optional<std::int64_t> alive_ns_{};
  std::string sentence_{};
  std::string datagram_{};
  std::optional<OsError> error_{};
};

}  // namespace ftcs::platform
