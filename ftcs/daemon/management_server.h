// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ftcs/platform/local_socket.h"
#include "ftcs/ptp/management_responder.h"

namespace ftcs::daemon {

/// The datagram that asks for the status; the answer is one JSON object. No PTP message begins so:
/// versionPTP would be 4.
inline constexpr std::string_view kStatusQuery = "ftcs status";
/// The socket's usual name, in /var/run or $XDG_RUNTIME_DIR.
inline constexpr const char* kSocketName = "ftcs";

/// What answers questions about a running port.
class Managed {
 public:
  virtual ~Managed() = default;
  [[nodiscard]] virtual ptp::ManagedPort managed_port() = 0;
  /// One JSON object (status_report.h).
  [[nodiscard]] virtual std::string status(const ptp::ManagementCounters& management) = 0;

 protected:
  Managed() = default;
  Managed(const Managed&) = default;
  Managed& operator=(const Managed&) = default;
};

/// The management socket: pmc's messages and the status query.
class ManagementServer {
 public:
  [[nodiscard]] static Result<ManagementServer, platform::OsError> open(const std::string& path);

  [[nodiscard]] int descriptor() const { return socket_.descriptor(); }
  [[nodiscard]] const std::string& path() const { return socket_.path(); }
  /// Answers what has arrived; some at a time, so that nobody keeps the clock waiting. Tells the
  /// subscribers (SUBSCRIBE_EVENTS_NP) when the port has another state than the last time.
  void serve(Managed& port, FreeRunningTime now);

 private:
  explicit ManagementServer(platform::LocalSocket socket) : socket_(std::move(socket)) {}

  struct Subscriber {
    std::string path;
    ptp::PortIdentity identity{};
    ptp::SubscribeEventsNp wanted{};
    FreeRunningTime until{};
    std::uint16_t next_sequence_id = 0;
  };
  void answer(const platform::LocalSocket::Datagram& request, Managed& port, FreeRunningTime now);
  void subscribe(const std::string& path, const ptp::ManagementResponder::Subscription& asked,
                 FreeRunningTime now);
  void notify(Managed& port, FreeRunningTime now);
  [[nodiscard]] std::vector<Subscriber>::iterator find(const std::string& path);

  platform::LocalSocket socket_;
  ptp::ManagementResponder responder_;
  std::vector<Subscriber> subscribers_;
  std::optional<ptp::PortState> told_{};  ///< none: nobody listened
};

}  // namespace ftcs::daemon
