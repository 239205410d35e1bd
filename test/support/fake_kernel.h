// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <functional>
#include <linux/errqueue.h>
#include <linux/ethtool.h>
#include <linux/net_tstamp.h>
#include <linux/sockios.h>
#include <map>
#include <net/if.h>
#include <string>
#include <sys/ioctl.h>
#include <vector>

#include "ftcs/platform/kernel.h"

namespace ftcs::platform {

/// A kernel for tests: two clocks, one interface "eth0", datagram sockets with receive and error
/// queues, and a switch for every way in which they are known to fail.
class FakeKernel : public Kernel {
 public:
  static constexpr unsigned kHardwareStamps =
      SOF_TIMESTAMPING_TX_HARDWARE | SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;

  struct Packet {
    std::vector<std::uint8_t> bytes;
    std::int64_t software_ns = 0;  ///< 0: the kernel gave no such stamp
    std::int64_t hardware_ns = 0;
    SocketAddress sender{};
    std::optional<in_addr> destination{};  ///< told with the message, as IP_PKTINFO asks for
  };
  struct Socket {
    std::deque<Packet> received;
    std::deque<Packet> error_queue;
    std::uint16_t port = 0;
    int family = AF_INET;
    std::vector<std::pair<int, int>> options;  ///< level and name of every option set
    std::map<int, int> socket_options;         ///< SOL_SOCKET options of integer size
  };

  // Clocks. Each reading of a clock takes reading_ns, as a real one does.
  std::int64_t raw_ns = 1'000'000'000'000;
  std::int64_t realtime_ns = 1'700'000'000'000'000'000;
  std::int64_t reading_ns = 20;
  std::function<void()> on_clock_read;

  // The interface.
  bool interface_exists = true;
  short interface_flags = IFF_UP | IFF_RUNNING | IFF_BROADCAST | IFF_MULTICAST;
  int interface_index = 2;
  bool interface_has_address = true;
  unsigned timestamping =
      SOF_TIMESTAMPING_TX_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  int phc_index = -1;

  // Failures: errno, 0 = works.
  int bind_errno = 0;
  int packet_socket_errno = 0;
  int send_errno = 0;
  int receive_errno = 0;  ///< reported once, as the kernel does
  int timestamping_errno = 0;
  int hardware_config_errno = 0;
  int open_errno = 0;
  bool gives_tx_stamps = true;
  int stamp_changes = 0;       ///< how often SIOCSHWTSTAMP was asked for
  bool stamps_are_on = false;  ///< what SIOCGHWTSTAMP says of the adapter

  std::map<int, Socket> sockets;
  std::vector<Packet> sent;
  SocketAddress last_destination{};

  /// "eth0" has a hardware clock, and stamps with it.
  void add_adapter_clock() {
    timestamping |= kHardwareStamps;
    phc_index = 0;
  }
  /// Lets both clocks run on.
  void advance(std::int64_t ns) {
    raw_ns += ns;
    realtime_ns += ns;
  }

  std::int64_t clock_ns(clockid_t clock) noexcept override {
    advance(reading_ns);
    if (on_clock_read) on_clock_read();
    return clock == CLOCK_REALTIME ? realtime_ns : raw_ns;
  }
  int socket(int family, int type) noexcept override {
    const int kind = type & ~(SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (kind != SOCK_DGRAM && (kind != SOCK_RAW || family != AF_PACKET)) return -EINVAL;
    if (family == AF_PACKET && packet_socket_errno != 0) return -packet_socket_errno;
    sockets[next_descriptor_] = {};
    sockets[next_descriptor_].family = family;
    return next_descriptor_++;
  }
  int bind(int fd, const SocketAddress& address) noexcept override {
    if (bind_errno != 0) return -bind_errno;
    sockets[fd].port = address.port();
    return 0;
  }
  int connect(int fd, const SocketAddress& address) noexcept override {
    sockets[fd].port = address.port();
    return 0;
  }
  std::uint16_t port_of(int fd) noexcept override { return sockets[fd].port; }
  int set_option(int fd, int level, int name, const void* value, socklen_t size) noexcept override {
    if (level == SOL_SOCKET && name == SO_TIMESTAMPING && timestamping_errno != 0) {
      return -timestamping_errno;
    }
    sockets[fd].options.emplace_back(level, name);
    if (level == SOL_SOCKET && size == sizeof(int)) {
      std::memcpy(&sockets[fd].socket_options[name], value, sizeof(int));
    }
    return 0;
  }
  int set_nonblocking(int) noexcept override { return 0; }
  ssize_t send_to(int fd, std::span<const std::uint8_t> bytes,
                  const SocketAddress& to) noexcept override {
    if (send_errno != 0) return -send_errno;
    last_destination = to;
    sent.push_back({{bytes.begin(), bytes.end()}, 0, 0});
    if (gives_tx_stamps && sockets[fd].socket_options.count(SO_TIMESTAMPING) != 0) {
      queue_tx_stamp(fd, bytes, realtime_ns, 0);
    }
    return static_cast<ssize_t>(bytes.size());
  }
  /// Puts a sent message with its stamp into the error queue, behind 42 bytes of Ethernet, IP and
  /// UDP headers.
  void queue_tx_stamp(int fd, std::span<const std::uint8_t> bytes, std::int64_t software,
                      std::int64_t hardware) {
    Packet packet{std::vector<std::uint8_t>(42, 0), software, hardware};
    packet.bytes.insert(packet.bytes.end(), bytes.begin(), bytes.end());
    sockets[fd].error_queue.push_back(packet);
  }
  ssize_t receive(int fd, msghdr& message, int flags) noexcept override {
    if (receive_errno != 0) {
      const int error = receive_errno;
      receive_errno = 0;
      return -error;
    }
    auto& queue = (flags & MSG_ERRQUEUE) != 0 ? sockets[fd].error_queue : sockets[fd].received;
    if (queue.empty()) return -EAGAIN;
    const Packet packet = queue.front();
    queue.pop_front();
    const std::size_t length = std::min(packet.bytes.size(), message.msg_iov[0].iov_len);
    std::memcpy(message.msg_iov[0].iov_base, packet.bytes.data(), length);
    message.msg_flags = length < packet.bytes.size() ? MSG_TRUNC : 0;
    if (message.msg_name != nullptr && packet.sender.size() > 0) {
      std::memcpy(message.msg_name, packet.sender.get(), packet.sender.size());
    }
    write_control(packet, message);
    return static_cast<ssize_t>(length);
  }
  int control(int, unsigned long request, void* argument) noexcept override {
    auto* query = static_cast<ifreq*>(argument);
    if (!interface_exists) return -ENODEV;
    switch (request) {
      case SIOCGIFINDEX:
        query->ifr_ifindex = interface_index;
        return 0;
      case SIOCGIFFLAGS:
        query->ifr_flags = interface_flags;
        return 0;
      case SIOCGIFADDR:
        return interface_has_address ? 0 : -EADDRNOTAVAIL;
      case SIOCGIFHWADDR: {
        constexpr std::array<char, 6> kAddress{0x02, 0x11, 0x22, 0x33, 0x44, 0x55};
        std::memcpy(query->ifr_hwaddr.sa_data, kAddress.data(), kAddress.size());
        return 0;
      }
      case SIOCETHTOOL: {
        auto* info = reinterpret_cast<ethtool_ts_info*>(query->ifr_data);
        info->so_timestamping = timestamping;
        info->phc_index = phc_index;
        info->rx_filters = 1U << HWTSTAMP_FILTER_PTP_V2_L4_EVENT;
        return 0;
      }
      case SIOCSHWTSTAMP:
        ++stamp_changes;
        return -hardware_config_errno;
      case SIOCGHWTSTAMP: {
        auto* config = reinterpret_cast<hwtstamp_config*>(query->ifr_data);
        config->tx_type = stamps_are_on ? HWTSTAMP_TX_ON : HWTSTAMP_TX_OFF;
        config->rx_filter = stamps_are_on ? HWTSTAMP_FILTER_PTP_V2_L4_EVENT : HWTSTAMP_FILTER_NONE;
        return 0;
      }
      default:
        return -EOPNOTSUPP;
    }
  }
  int open(const char*, int) noexcept override {
    return open_errno != 0 ? -open_errno : next_descriptor_++;
  }
  int poll(std::span<pollfd> descriptors, int timeout_ms) noexcept override {
    int ready = 0;
    for (pollfd& entry : descriptors) {
      entry.revents = 0;
      const auto socket = sockets.find(entry.fd);
      if (socket == sockets.end()) continue;
      if (!socket->second.received.empty()) entry.revents |= POLLIN;
      if (!socket->second.error_queue.empty()) entry.revents |= POLLPRI;
      ready += entry.revents != 0 ? 1 : 0;
    }
    if (ready == 0) advance(std::int64_t{timeout_ms} * 1'000'000);
    return ready;
  }
  int wait_readable(int fd, std::int64_t timeout_ns) noexcept override {
    const Socket& socket = sockets[fd];
    const bool ready = !socket.received.empty() || !socket.error_queue.empty();
    if (!ready) advance(timeout_ns);
    return ready ? 1 : 0;
  }
  void sleep_until(std::int64_t instant_ns) noexcept override {
    advance(std::max<std::int64_t>(instant_ns - raw_ns, 0));
  }
  void close(int fd) noexcept override { sockets.erase(fd); }
  // Clocks are steered in fake_clocks.h.
  ssize_t read(int, std::span<std::uint8_t>) noexcept override { return -EBADF; }
  int adjust_clock(clockid_t, timex&) noexcept override { return -EINVAL; }
  int open_timer() noexcept override { return next_descriptor_++; }
  int set_timer(int, std::int64_t) noexcept override { return 0; }
  int hold_name(const char*) noexcept override { return next_descriptor_++; }
  int lock(int) noexcept override { return 0; }
  std::int64_t device_number(int) noexcept override { return 0; }

 private:
  static void write_control(const Packet& packet, msghdr& message) {
    std::size_t size = 0;
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (packet.software_ns != 0 || packet.hardware_ns != 0) {
      write_stamps(packet, header);
      size += CMSG_SPACE(sizeof(scm_timestamping));
      header = CMSG_NXTHDR(&message, header);
    }
    if (packet.destination) {
      const in_pktinfo info{2, {}, *packet.destination};
      header->cmsg_level = IPPROTO_IP;
      header->cmsg_type = IP_PKTINFO;
      header->cmsg_len = CMSG_LEN(sizeof info);
      std::memcpy(CMSG_DATA(header), &info, sizeof info);
      size += CMSG_SPACE(sizeof info);
    }
    message.msg_controllen = size;
  }
  static void write_stamps(const Packet& packet, cmsghdr* header) {
    scm_timestamping stamps{};
    stamps.ts[0] = {packet.software_ns / 1'000'000'000, packet.software_ns % 1'000'000'000};
    stamps.ts[2] = {packet.hardware_ns / 1'000'000'000, packet.hardware_ns % 1'000'000'000};
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_TIMESTAMPING;
    header->cmsg_len = CMSG_LEN(sizeof stamps);
    std::memcpy(CMSG_DATA(header), &stamps, sizeof stamps);
  }

  int next_descriptor_ = 10;
};

}  // namespace ftcs::platform
