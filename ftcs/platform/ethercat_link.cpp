// SPDX-License-Identifier: MIT
#include "ftcs/platform/ethercat_link.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <linux/errqueue.h>
#include <linux/if_packet.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace ftcs::platform {

namespace {

/// Only newer headers name it: frames that this socket sent are not delivered to it.
constexpr int kPacketIgnoreOutgoing = 23;
constexpr std::size_t kControlSize = 512;

std::int64_t to_ns(const timespec& time) noexcept {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return static_cast<std::int64_t>(time.tv_sec) * kNsPerSecond + time.tv_nsec;
}

struct ControlData {
  std::int64_t stamp_ns = 0;
  std::uint32_t key = 0;
};

ControlData read_control(msghdr& message) noexcept {
  ControlData result;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level == SOL_SOCKET && part->cmsg_type == SCM_TIMESTAMPING) {
      scm_timestamping stamps{};
      std::memcpy(&stamps, CMSG_DATA(part), sizeof stamps);
      result.stamp_ns = to_ns(stamps.ts[0]);
    }
    const bool ip_error = part->cmsg_level == SOL_IP && part->cmsg_type == IP_RECVERR;
    const bool packet_error =
        part->cmsg_level == SOL_PACKET && part->cmsg_type == PACKET_TX_TIMESTAMP;
    if (ip_error || packet_error) {
      sock_extended_err error{};
      std::memcpy(&error, CMSG_DATA(part), sizeof error);
      result.key = error.ee_data;
    }
  }
  return result;
}

Result<sockaddr_in, OsError> address_of(const std::string& host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) {
    return OsError{OsErrorKind::kBadAddress, 0, "address " + host};
  }
  return address;
}

const sockaddr* generic(const sockaddr_in& address) noexcept {
  return reinterpret_cast<const sockaddr*>(&address);
}

}  // namespace

EthercatLink::EthercatLink(EthercatLink&& other) noexcept
    : fd_(other.fd_),
      raw_(other.raw_),
      answers_sender_(other.answers_sender_),
      peer_(other.peer_),
      mac_(other.mac_) {
  other.fd_ = -1;
}

EthercatLink::~EthercatLink() {
  if (fd_ >= 0) close(fd_);
}

std::optional<OsError> EthercatLink::enable_stamps() const {
  const unsigned flags = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_TX_SOFTWARE |
                         SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_OPT_ID |
                         SOF_TIMESTAMPING_OPT_TSONLY;
  if (setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPING, &flags, sizeof flags) != 0) {
    return os_error(errno, "timestamps");
  }
  return std::nullopt;
}

Result<EthercatLink, OsError> EthercatLink::open_raw(const std::string& interface) {
  if (interface.size() >= IFNAMSIZ) {
    return OsError{OsErrorKind::kNoSuchInterface, 0, "interface " + interface};
  }
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return os_error(errno, "raw socket");
  EthercatLink link(fd, true);
  ifreq request{};
  std::copy(interface.begin(), interface.end(), request.ifr_name);
  // A link that was just brought up has its carrier reported late.
  constexpr int kTries = 20;
  constexpr useconds_t kPause_us = 100'000;
  for (int i = 0; i < kTries; ++i) {
    if (ioctl(fd, SIOCGIFFLAGS, &request) != 0) return os_error(errno, "interface " + interface);
    if ((request.ifr_flags & IFF_UP) == 0) {
      return OsError{OsErrorKind::kInterfaceDown, ENETDOWN, "interface " + interface};
    }
    if ((request.ifr_flags & IFF_RUNNING) != 0) break;
    usleep(kPause_us);
  }
  if ((request.ifr_flags & IFF_RUNNING) == 0) {
    return OsError{OsErrorKind::kInterfaceDown, ENETDOWN, "no carrier on interface " + interface};
  }
  if (ioctl(fd, SIOCGIFHWADDR, &request) != 0) return os_error(errno, "interface " + interface);
  std::memcpy(link.mac_.data(), request.ifr_hwaddr.sa_data, link.mac_.size());
  if (ioctl(fd, SIOCGIFINDEX, &request) != 0) return os_error(errno, "interface " + interface);
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ethercat::kEtherType);
  address.sll_ifindex = request.ifr_ifindex;
  const int one = 1;
  // Refused by old kernels: then our own frames come back and are known by their index.
  setsockopt(fd, SOL_PACKET, kPacketIgnoreOutgoing, &one, sizeof one);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return os_error(errno, "interface " + interface);
  }
  if (auto error = link.enable_stamps()) return *error;
  return link;
}

Result<EthercatLink, OsError> EthercatLink::connect_udp(const std::string& host,
                                                        std::uint16_t port) {
  const auto address = address_of(host, port);
  if (!address) return address.error();
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return os_error(errno, "UDP socket");
  EthercatLink link(fd, false);
  if (connect(fd, generic(*address), sizeof *address) != 0) return os_error(errno, "host " + host);
  if (auto error = link.enable_stamps()) return *error;
  return link;
}

Result<EthercatLink, OsError> EthercatLink::listen_udp(const std::string& address,
                                                       std::uint16_t port) {
  const auto own = address_of(address, port);
  if (!own) return own.error();
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return os_error(errno, "UDP socket");
  EthercatLink link(fd, false);
  link.answers_sender_ = true;
  if (bind(fd, generic(*own), sizeof *own) != 0) {
    return os_error(errno, "UDP port " + std::to_string(port));
  }
  if (auto error = link.enable_stamps()) return *error;
  return link;
}

std::uint16_t EthercatLink::port() const noexcept {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (raw_ || getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

int EthercatLink::send(ethercat::ConstBytes frame) noexcept {
  ethercat::ConstBytes bytes = frame;
  if (raw_) {
    const auto ethernet = ethercat::encode_ethernet(send_buffer_, mac_, frame);
    if (!ethernet) return EMSGSIZE;
    bytes = *ethernet;
  }
  const sockaddr* to = answers_sender_ ? generic(peer_) : nullptr;
  const socklen_t size = answers_sender_ ? sizeof peer_ : 0;
  if (sendto(fd_, bytes.data(), bytes.size(), 0, to, size) < 0) return errno;
  ++sent_;
  transmitted_ns_ = 0;
  return 0;
}

bool EthercatLink::wait_readable(FreeRunningTime deadline) const noexcept {
  const Duration left = deadline - HostClock::now();
  if (left <= Duration{}) return false;
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  const timespec timeout{.tv_sec = left.floor_ns() / kNsPerSecond,
                         .tv_nsec = left.floor_ns() % kNsPerSecond};
  pollfd entry{.fd = fd_, .events = POLLIN, .revents = 0};
  if (ppoll(&entry, 1, &timeout, nullptr) < 0) return false;  // a signal: let the caller look
  return entry.revents != 0;
}

/// Transmit stamps come through the error queue, each with the number of its frame.
void EthercatLink::drain_errors() noexcept {
  std::array<std::uint8_t, 64> data{};
  alignas(cmsghdr) std::array<std::uint8_t, kControlSize> control{};
  while (true) {
    iovec part{.iov_base = data.data(), .iov_len = data.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (recvmsg(fd_, &message, MSG_ERRQUEUE) < 0) return;
    const ControlData found = read_control(message);
    if (found.stamp_ns != 0 && found.key == sent_ - 1) transmitted_ns_ = found.stamp_ns;
  }
}

std::optional<FreeRunningTime> EthercatLink::transmit_stamp() noexcept {
  if (transmitted_ns_ == 0) drain_errors();
  if (transmitted_ns_ == 0) return std::nullopt;
  return clock_.from_realtime(transmitted_ns_);
}

std::optional<EthercatLink::Received> EthercatLink::read_one() noexcept {
  alignas(cmsghdr) std::array<std::uint8_t, kControlSize> control{};
  iovec part{.iov_base = receive_buffer_.data(), .iov_len = receive_buffer_.size()};
  sockaddr_in sender{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  if (!raw_) {
    message.msg_name = &sender;
    message.msg_namelen = sizeof sender;
  }
  const ssize_t size = recvmsg(fd_, &message, 0);
  if (size < 0) return std::nullopt;
  ethercat::Bytes frame = ethercat::Bytes{receive_buffer_}.first(static_cast<std::size_t>(size));
  if (raw_) {
    const auto inside = ethercat::decode_ethernet(frame);
    if (!inside) {
      ++foreign_;
      return std::nullopt;
    }
    frame = *inside;
  }
  if (answers_sender_) peer_ = sender;
  const ControlData found = read_control(message);
  if (found.stamp_ns == 0) return Received{frame, HostClock::now(), false};
  return Received{frame, clock_.from_realtime(found.stamp_ns), true};
}

std::optional<EthercatLink::Received> EthercatLink::receive(FreeRunningTime deadline,
                                                            bool spin) noexcept {
  constexpr int kMostLate = 64;
  int late = 0;
  while (true) {
    if (auto received = read_one()) return received;
    // However many frames of others come: the answer may wait behind some, not behind a flood.
    const bool over = HostClock::now() >= deadline;
    if (over && (spin || ++late > kMostLate)) return std::nullopt;
    if (spin) continue;
    if (!wait_readable(deadline)) return std::nullopt;
    drain_errors();
  }
}

}  // namespace ftcs::platform
