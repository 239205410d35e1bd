// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "ftcs/fieldbus/segment_server.h"
#include "ftcs/platform/host_clock.h"

namespace ftcs::daemon {

/// A segment of modelled drives in a thread of this process, on loopback by the UDP encapsulation:
/// no root, no second program. The kernel must outlive it.
class LocalSegment {
 public:
  /// SCHED_FIFO at `priority` for its thread, if the system grants it.
  [[nodiscard]] static Result<std::unique_ptr<LocalSegment>, platform::OsError> start(
      platform::Kernel& kernel, const SegmentOptions& options, int priority) {
    auto link = platform::EthercatLink::listen_udp(kernel, options.address, 0);
    if (!link) return link.error();
    const std::uint16_t port = link->port();
    return std::unique_ptr<LocalSegment>(
        new LocalSegment(kernel, options, std::move(*link), port, priority));
  }
  ~LocalSegment() { stop(); }
  LocalSegment(const LocalSegment&) = delete;
  LocalSegment& operator=(const LocalSegment&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  /// Afterwards the server may be looked at.
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] const SegmentServer& server() const noexcept { return server_; }

 private:
  LocalSegment(platform::Kernel& kernel, const SegmentOptions& options, platform::EthercatLink link,
               std::uint16_t port, int priority)
      : port_(port), server_(kernel, options, std::move(link)), thread_([this, priority] {
          static_cast<void>(platform::make_realtime(priority, -1));
          server_.run([this] { return stop_.load(); });
        }) {}

  std::uint16_t port_;
  std::atomic<bool> stop_{false};
  SegmentServer server_;
  std::thread thread_;
};

}  // namespace ftcs::daemon
