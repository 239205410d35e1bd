// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "ftcs/ethercat/wire/frame.h"
#include "ftcs/platform/host_clock.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/platform/socket_address.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// One end of an EtherCAT cable: raw Ethernet (AF_PACKET, EtherType 0x88A4; needs CAP_NET_RAW) or
/// the UDP encapsulation (port 0x88A4; needs nothing). Kernel stamps on CLOCK_MONOTONIC where the
/// kernel gives them. After opening: no allocation; the kernel is asked to send, to receive, to
/// wait and for the time alone. It must outlive the link.
class EthercatLink {
 public:
  /// Both roles use the same socket on raw Ethernet.
  [[nodiscard]] static Result<EthercatLink, OsError> open_raw(Kernel& kernel,
                                                              const std::string& interface);
  /// The MainDevice's end; the segment listens at `host`:`port`.
  [[nodiscard]] static Result<EthercatLink, OsError> connect_udp(Kernel& kernel,
                                                                 const std::string& host,
                                                                 std::uint16_t port);
  /// The segment's end: answers whoever sent the last frame. Port 0: the system chooses one.
  [[nodiscard]] static Result<EthercatLink, OsError> listen_udp(Kernel& kernel,
                                                                const std::string& address,
                                                                std::uint16_t port);
  EthercatLink(EthercatLink&&) noexcept = default;
  EthercatLink& operator=(EthercatLink&&) = delete;
  ~EthercatLink() = default;

  /// Sends a frame (from the EtherCAT header on). Zero or errno.
  int send(ethercat::ConstBytes frame) noexcept;

  struct Received {
    ethercat::Bytes frame;  ///< valid until the next call
    FreeRunningTime stamp;
    bool by_kernel = false;  ///< else read after the call returned
  };
  /// The next EtherCAT frame, waiting until `deadline` at most. Foreign packets are counted and
  /// passed over. With `spin` the processor is kept busy instead of asleep.
  [[nodiscard]] std::optional<Received> receive(FreeRunningTime deadline, bool spin) noexcept;
  /// The kernel's stamp of the frame that was sent last, if it is there by now.
  [[nodiscard]] std::optional<FreeRunningTime> transmit_stamp() noexcept;

  /// The own UDP port; zero on raw Ethernet.
  [[nodiscard]] std::uint16_t port() const noexcept;
  [[nodiscard]] std::uint64_t foreign() const noexcept { return foreign_; }
  /// The clock that its stamps are of.
  [[nodiscard]] const HostClock& clock() const noexcept { return clock_; }

 private:
  EthercatLink(Kernel& kernel, int fd, bool raw) noexcept
      : kernel_(&kernel), fd_(kernel, fd), raw_(raw), clock_(kernel) {}
  /// A socket of the UDP encapsulation that is not bound yet.
  [[nodiscard]] static Result<EthercatLink, OsError> open_udp(Kernel& kernel);
  /// Waits for the carrier; then the address and the index of the interface are known.
  [[nodiscard]] std::optional<OsError> attach_to(const std::string& interface);
  [[nodiscard]] std::optional<OsError> enable_stamps() const;
  [[nodiscard]] bool wait_readable(FreeRunningTime deadline) const noexcept;
  [[nodiscard]] std::optional<Received> read_one() noexcept;
  void drain_errors() noexcept;

  Kernel* kernel_;
  Descriptor fd_;
  bool raw_ = false;
  bool answers_sender_ = false;
  SocketAddress peer_;
  ethercat::MacAddress mac_{};
  HostClock clock_;
  std::uint32_t sent_ = 0;           ///< frames sent: the key of the transmit stamps
  std::int64_t transmitted_ns_ = 0;  ///< stamp of the last of them; zero: not known yet
  std::uint64_t foreign_ = 0;
  std::array<std::uint8_t, 2048> receive_buffer_{};
  std::array<std::uint8_t, ethercat::kMaxEthernetSize> send_buffer_{};
};

}  // namespace ftcs::platform
