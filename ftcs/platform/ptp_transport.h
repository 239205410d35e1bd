// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ftcs/platform/kernel.h"
#include "ftcs/platform/ptp_socket.h"
#include "ftcs/platform/timestamp_clock.h"

namespace ftcs::platform {

/// What happened on the network side of a port. Called from PtpTransport::wait_until() only; may
/// call send().
class TransportHandler {
 public:
  virtual ~TransportHandler() = default;
  /// `bytes` is valid during the call.
  virtual void on_message(const ReceivedMessage& message) = 0;
  /// The timestamp of an event message that was sent, or its absence.
  virtual void on_transmitted(const TransmittedMessage& message) = 0;
  /// The link went up or down; `reason` is empty when it came up. Down again: for another reason.
  virtual void on_link(bool up, const std::string& reason) = 0;
  /// A descriptor given to PtpTransport::watch() can be read.
  virtual void on_readable(int) {}

 protected:
  TransportHandler() = default;
  TransportHandler(const TransportHandler&) = default;
  TransportHandler& operator=(const TransportHandler&) = default;
};

/// The sockets of one port over the life of its link: asks once a second whether the interface is
/// still there, up and the same (an adapter that was unplugged comes back with another index),
/// closes the sockets when it is not and opens them again with a growing delay. One thread,
/// poll(2).
class PtpTransport {
 public:
  PtpTransport(Kernel& kernel, PtpSocketConfig config, TimestampClock& clock,
               TransportHandler& handler);

  /// The first opening, whose error is the user's to repair.
  [[nodiscard]] std::optional<OsError> open();
  /// As open(), but an interface that is down or has no address yet is no error: the handler hears
  /// of it, and it is waited for as one that was lost.
  [[nodiscard]] std::optional<OsError> open_or_wait();
  /// An error is also noted for the link's sake: the caller need not act on it.
  std::optional<OsError> send(Channel channel, std::span<const std::uint8_t> bytes,
                              Group group = Group::kPrimary);
  /// To one host instead.
  std::optional<OsError> send_to(Channel channel, std::span<const std::uint8_t> bytes,
                                 const SocketAddress& to);
  /// Handles what arrives until `deadline` (on the free-running clock), or returns early after an
  /// event or a signal, and at the latest after a quarter of a second. True if there was something
  /// to handle: more may be waiting behind it.
  bool wait_until(FreeRunningTime deadline);

  /// As wait_until(), for the watched descriptors alone: without sockets of its own, and without
  /// trying to open any.
  void wait_watched(FreeRunningTime deadline) { poll_sockets(deadline); }
  /// Another descriptor that ends the wait when it can be read: a timer finer than poll's
  /// milliseconds. At most kLargestWatch; a negative one is none.
  void watch(int descriptor) {
    if (descriptor >= 0 && watched_.size() < kLargestWatch) watched_.push_back(descriptor);
  }
  static constexpr std::size_t kLargestWatch = 4;

  [[nodiscard]] bool is_up() const noexcept { return socket_.has_value() && carrier_; }
  /// Whether the kernel says that the link has carrier. Some virtual interfaces never do: is_up()
  /// is then true all the same.
  [[nodiscard]] bool has_carrier() const noexcept { return running_; }
  /// Why there are no sockets; none: there are, or open() was not called.
  [[nodiscard]] const std::optional<OsError>& closed() const noexcept { return closed_; }
  /// No value while the link is down.
  [[nodiscard]] const PtpSocket* socket() const noexcept { return socket_ ? &*socket_ : nullptr; }

 private:
  std::optional<OsError> note(std::optional<OsError> error);
  bool poll_sockets(FreeRunningTime deadline);
  void receive(Channel channel);
  void report_overdue();
  void check_link(FreeRunningTime now);
  void try_to_reopen(FreeRunningTime now);
  void lose(const OsError& error, const std::string& reason);
  void lose(const OsError& error) { lose(error, error.message()); }
  void stamp_in_hardware();

  Kernel& kernel_;
  PtpSocketConfig config_;
  TimestampClock& clock_;
  TransportHandler& handler_;
  std::optional<PtpSocket> socket_;
  std::optional<OsError> closed_{};
  std::vector<int> watched_;
  bool carrier_ = true;
  bool running_ = false;              // as the kernel said last
  bool carrier_is_reported_ = false;  // some virtual interfaces never say IFF_RUNNING
  bool suspect_ = false;              // a call failed: look at the link at once
  FreeRunningTime next_check_{};
  Duration reopen_delay_{};
};

}  // namespace ftcs::platform
