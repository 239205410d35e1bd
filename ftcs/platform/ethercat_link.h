// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <netinet/in.h>
#include <optional>
#include <string>

#include "ftcs/ethercat/wire/frame.h"
#include "ftcs/platform/host_clock.h"
#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// One end of an EtherCAT cable: raw Ethernet (AF_PACKET, EtherType 0x88A4; needs CAP_NET_RAW) or
/// the UDP encapsulation (port 0x88A4; needs nothing). Kernel stamps on CLOCK_MONOTONIC where the
/// kernel gives them. After opening: no allocation; the only system calls are send, receive and
/// poll.
class EthercatLink {
 public:
  /// Both roles use the same socket on raw Ethernet.
  [[nodiscard]] static Result<EthercatLink, OsError> open_raw(const std::string& interface);
  /// The MainDevice's end; the segment listens at `host`:`port`.
  [[nodiscard]] static Result<EthercatLink, OsError> connect_udp(const std::string& host,
                                                                 std::uint16_t port);
  /// The segment's end: answers whoever sent the last frame. Port 0: the system chooses one.
  [[nodiscard]] static Result<EthercatLink, OsError> listen_udp(const std::string& address,
                                                                std::uint16_t port);
  EthercatLink(EthercatLink&& other) noexcept;
  EthercatLink& operator=(EthercatLink&&) = delete;
  ~EthercatLink();

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
  void refresh_clock() noexcept { clock_.refresh(); }

 private:
  EthercatLink(int fd, bool raw) noexcept : fd_(fd), raw_(raw) {}
  [[nodiscard]] std::optional<OsError> enable_stamps() const;
  [[nodiscard]] bool wait_readable(FreeRunningTime deadline) const noexcept;
  [[nodiscard]] std::optional<Received> read_one() noexcept;
  void drain_errors() noexcept;

  int fd_ = -1;
  bool raw_ = false;
  bool answers_sender_ = false;
  sockaddr_in peer_{};
  ethercat::MacAddress mac_{};
  HostClock clock_;
  std::uint32_t sent_ = 0;           ///< frames sent: the key of the transmit stamps
  std::int64_t transmitted_ns_ = 0;  ///< stamp of the last of them; zero: not known yet
  std::uint64_t foreign_ = 0;
  std::array<std::uint8_t, 2048> receive_buffer_{};
  std::array<std::uint8_t, ethercat::kMaxEthernetSize> send_buffer_{};
};

}  // namespace ftcs::platform
