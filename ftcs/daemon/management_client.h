// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "ftcs/platform/local_socket.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/ptp/wire/management.h"
#include "ftcs/time/result.h"

namespace ftcs::daemon {

/// Where a PTP program of this machine is asked, and in which domain.
struct PortAddress {
  std::string socket = "/var/run/ptp4l";
  std::uint8_t domain = 0;
  std::uint8_t major_sdo_id = 0;
};

/// Asks a PTP program of this machine (ptp4l, ftcs ptp) over its management socket, as pmc does.
/// Questions and answers are datagrams: nothing is waited for, and who asks takes what has come.
class ManagementClient {
 public:
  [[nodiscard]] static Result<ManagementClient, platform::OsError> open(const PortAddress& address);

  /// To all ports. Nobody there is no error: it may come.
  void ask(ptp::ManagementId id);
  /// The next answer that can be understood; no value: none has come.
  [[nodiscard]] std::optional<ptp::ManagementData> next_answer();
  /// Asks, and waits so long for each answer until it is that one (an earlier question may be
  /// answered late): for where nothing runs yet.
  template <class Data>
  [[nodiscard]] std::optional<Data> ask_and_wait(ptp::ManagementId id, int patience_ms) {
    ask(id);
    for (int i = 0; i < kMostAnswers; ++i) {
      const auto answer = wait_for_answer(patience_ms);
      if (!answer) break;
      if (const auto* data = std::get_if<Data>(&*answer)) return *data;
    }
    return std::nullopt;
  }
  /// Readable when an answer has come.
  [[nodiscard]] int descriptor() const { return socket_.descriptor(); }

 private:
  /// Answers to so many of the last questions are taken; no others were asked for.
  static constexpr std::uint16_t kAwaited = 64;
  static constexpr int kMostAnswers = 64;  // a boundary clock answers for each of its ports

  ManagementClient(PortAddress address, platform::LocalSocket socket)
      : address_(std::move(address)), socket_(std::move(socket)) {}

  /// Datagrams that are no answers do not end the wait, nor prolong it.
  [[nodiscard]] std::optional<ptp::ManagementData> wait_for_answer(int patience_ms);

  PortAddress address_;
  platform::LocalSocket socket_;
  std::uint16_t asked_ = 0;  ///< the last question's sequence id; the first one's is 1
};

}  // namespace ftcs::daemon
