// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ftcs/platform/kernel.h"
#include "ftcs/platform/network_interface.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/platform/ptp_endpoint.h"
#include "ftcs/platform/timestamp_clock.h"
#include "ftcs/platform/transmission_log.h"
#include "ftcs/ptp/actions.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

struct PtpSocketConfig : PtpEndpointConfig {
  /// How long the kernel may take to deliver a transmit timestamp (ptp4l: tx_timestamp_timeout).
  Nanoseconds tx_timestamp_timeout = std::chrono::milliseconds{10};
};

/// A message from the network. `bytes` is valid until the socket is used again.
struct ReceivedMessage {
  Channel channel = Channel::kEvent;
  std::span<const std::uint8_t> bytes;
  SocketAddress sender{};
  std::optional<Stamp> stamp{};  ///< of event messages; none: the kernel's stamp could not be used
};

/// What became of the transmit timestamp of an event message.
struct TransmittedMessage {
  std::span<const std::uint8_t> bytes;  ///< the message, valid until the socket is used again
  std::optional<Stamp> stamp{};         ///< none: it did not come within tx_timestamp_timeout
};

struct SocketCounters {
  std::uint64_t received = 0;
  std::uint64_t sent = 0;
  std::uint64_t oversized = 0;               ///< longer than any PTP message: dropped
  std::uint64_t unicast_dropped = 0;         ///< sent to us instead of the group (UnicastMessages)
  std::uint64_t stranger_dropped = 0;        ///< not from the configured peer
  std::uint64_t receive_stamp_missing = 0;   ///< event messages without a usable kernel stamp
  std::uint64_t transmit_stamp_missing = 0;  ///< not within tx_timestamp_timeout
  std::uint64_t transmit_stamp_late =
      0;  ///< came after it; matched to its own message all the same
  std::uint64_t transmit_stamp_unknown = 0;  ///< matches no message that we remember
};

/// The two sockets of one PTP port, with timestamps of the free-running clock. Nothing
/// blocks.
///
/// One receive call for each readiness that poll(2) reports on a descriptor: POLLIN means
/// receive(), POLLPRI or POLLERR means receive_transmitted().
class PtpSocket {
 public:
  /// Opens, binds, joins the groups and asks for timestamps. The error says what could not be had.
  /// `clock` must outlive the socket.
  [[nodiscard]] static Result<PtpSocket, OsError> open(Kernel& kernel,
                                                       const PtpSocketConfig& config,
                                                       TimestampClock& clock);

  /// Sends to the group or, where one is configured, to the only peer instead. The stamp of an
  /// event message comes later, from receive_transmitted().
  [[nodiscard]] std::optional<OsError> send(Channel channel, std::span<const std::uint8_t> bytes,
                                            Group group = Group::kPrimary);
  /// Sends to this host, at the channel's port.
  [[nodiscard]] std::optional<OsError> send_to(Channel channel, std::span<const std::uint8_t> bytes,
                                               const SocketAddress& to);
  /// No value: nothing there, or dropped and counted.
  [[nodiscard]] Result<std::optional<ReceivedMessage>, OsError> receive(Channel channel);
  /// A stamp from the error queue, matched to its message by content.
  [[nodiscard]] std::optional<TransmittedMessage> receive_transmitted();
  /// A message whose stamp is overdue (each once), or one that was stamped in user space. Call
  /// until empty.
  [[nodiscard]] std::optional<TransmittedMessage> overdue();
  /// When overdue() will next have something to say.
  [[nodiscard]] std::optional<FreeRunningTime> next_deadline() const noexcept;

  [[nodiscard]] int descriptor(Channel channel) const noexcept {
    return sockets_[static_cast<std::size_t>(channel)].get();
  }
  /// Which stamps are in use for messages received and sent; user space only as a last resort.
  [[nodiscard]] StampSource receive_stamps() const noexcept { return receive_stamps_; }
  [[nodiscard]] StampSource transmit_stamps() const noexcept { return transmit_stamps_; }
  [[nodiscard]] const InterfaceState& interface() const noexcept { return interface_; }
  [[nodiscard]] const SocketCounters& counters() const noexcept { return counters_; }

 private:
  PtpSocket(Kernel& kernel, PtpSocketConfig config, TimestampClock& clock)
      : kernel_(&kernel), config_(std::move(config)), clock_(&clock) {}

  [[nodiscard]] std::optional<OsError> open_channel(Channel channel);
  /// Whether a message may be heard; if not, it is counted.
  [[nodiscard]] bool admits(const SocketAddress& sender, bool to_group,
                            std::span<const std::uint8_t> bytes) noexcept;
  [[nodiscard]] std::optional<OsError> transmit(Channel channel,
                                                std::span<const std::uint8_t> bytes,
                                                const SocketAddress& to);
  [[nodiscard]] std::optional<OsError> enable_timestamps(int fd);
  [[nodiscard]] std::uint16_t port(Channel channel) const noexcept {
    return channel == Channel::kEvent ? config_.event_port : config_.general_port;
  }

  Kernel* kernel_;
  PtpSocketConfig config_;
  TimestampClock* clock_;
  std::array<Descriptor, 2> sockets_{};
  InterfaceState interface_{};
  StampSource receive_stamps_ = StampSource::kSoftware;
  StampSource transmit_stamps_ = StampSource::kSoftware;
  TransmissionLog log_{};
  std::deque<std::pair<std::vector<std::uint8_t>, Stamp>> stamped_in_user_space_{};
  std::vector<std::uint8_t> handed_out_{};
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(kBufferSize);
  std::uint64_t stamps_obtained_ = 0;
  SocketCounters counters_{};

  static constexpr std::size_t kBufferSize = 2048;  // an Ethernet frame and room to spare
};

}  // namespace ftcs::platform
