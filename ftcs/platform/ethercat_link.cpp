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
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "ftcs/time/duration.h"

namespace ftcs::platform {

namespace {

/// Only newer headers name it: frames that this socket sent are not delivered to it.
constexpr int kPacketIgnoreOutgoing = 23;
constexpr std::size_t kControlSize = 512;

std::int64_t to_ns(const timespec& time) noexcept {
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

/// -errno as what the user is told.
OsError refused(int result, const std::string& what) { return os_error(-result, what); }

Result<SocketAddress, OsError> address_of(const std::string& host, std::uint16_t port) {
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1) {
    return OsError{OsErrorKind::kBadAddress, 0, "address " + host};
  }
  return SocketAddress::ipv4(address, port);
}

}  // namespace

std::optional<OsError> EthercatLink::enable_stamps() const {
  const unsigned flags = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_TX_SOFTWARE |
                         SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_OPT_ID |
                         SOF_TIMESTAMPING_OPT_TSONLY;
  const int result =
      kernel_->set_option(fd_.get(), SOL_SOCKET, SO_TIMESTAMPING, &flags, sizeof flags);
  if (result < 0) return refused(result, "timestamps");
  return std::nullopt;
}

std::optional<OsError> EthercatLink::attach_to(const std::string& interface) {
  const std::string name = "interface " + interface;
  ifreq request{};
  std::copy(interface.begin(), interface.end(), request.ifr_name);
  const auto ask = [&](unsigned long what) { return kernel_->control(fd_.get(), what, &request); };
  // A link that was just brought up has its carrier reported late.
  constexpr int kTries = 20;
  constexpr Nanoseconds kPause{100'000'000};
  for (int i = 0; i < kTries; ++i) {
    if (const int result = ask(SIOCGIFFLAGS); result < 0) return refused(result, name);
    if ((request.ifr_flags & IFF_UP) == 0) {
      return OsError{OsErrorKind::kInterfaceDown, ENETDOWN, name};
    }
    if ((request.ifr_flags & IFF_RUNNING) != 0) break;
    clock_.wait_until(clock_.now() + Duration{kPause}, Nanoseconds{0});
  }
  if ((request.ifr_flags & IFF_RUNNING) == 0) {
    return OsError{OsErrorKind::kInterfaceDown, ENETDOWN, "no carrier on " + name};
  }
  if (const int result = ask(SIOCGIFHWADDR); result < 0) return refused(result, name);
  std::memcpy(mac_.data(), request.ifr_hwaddr.sa_data, mac_.size());
  if (const int result = ask(SIOCGIFINDEX); result < 0) return refused(result, name);
  const int one = 1;
  // Refused by old kernels: then our own frames come back and are known by their index.
  static_cast<void>(
      kernel_->set_option(fd_.get(), SOL_PACKET, kPacketIgnoreOutgoing, &one, sizeof one));
  const auto own = SocketAddress::ethernet(mac_, ethercat::kEtherType, request.ifr_ifindex);
  if (const int result = kernel_->bind(fd_.get(), own); result < 0) return refused(result, name);
  return std::nullopt;
}

Result<EthercatLink, OsError> EthercatLink::open_raw(Kernel& kernel, const std::string& interface) {
  if (interface.size() >= IFNAMSIZ) {
    return OsError{OsErrorKind::kNoSuchInterface, 0, "interface " + interface};
  }
  const int fd = kernel.socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return refused(fd, "raw socket");
  EthercatLink link(kernel, fd, true);
  if (auto error = link.attach_to(interface)) return *error;
  if (auto error = link.enable_stamps()) return *error;
  return link;
}

Result<EthercatLink, OsError> EthercatLink::open_udp(Kernel& kernel) {
  const int fd = kernel.socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return refused(fd, "UDP socket");
  return EthercatLink(kernel, fd, false);
}

Result<EthercatLink, OsError> EthercatLink::connect_udp(Kernel& kernel, const std::string& host,
                                                        std::uint16_t port) {
  const auto address = address_of(host, port);
  if (!address) return address.error();
  auto link = open_udp(kernel);
  if (!link) return link.error();
  const int result = kernel.connect(link->fd_.get(), *address);
  if (result < 0) return refused(result, "host " + host);
  if (auto error = link->enable_stamps()) return *error;
  return link;
}

Result<EthercatLink, OsError> EthercatLink::listen_udp(Kernel& kernel, const std::string& address,
                                                       std::uint16_t port) {
  const auto own = address_of(address, port);
  if (!own) return own.error();
  auto link = open_udp(kernel);
  if (!link) return link.error();
  link->answers_sender_ = true;
  const int result = kernel.bind(link->fd_.get(), *own);
  if (result < 0) return refused(result, "UDP port " + std::to_string(port));
  if (auto error = link->enable_stamps()) return *error;
  return link;
}

std::uint16_t EthercatLink::port() const noexcept { return raw_ ? 0 : kernel_->port_of(fd_.get()); }

int EthercatLink::send(ethercat::ConstBytes frame) noexcept {
  ethercat::ConstBytes bytes = frame;
  if (raw_) {
    const auto ethernet = ethercat::encode_ethernet(send_buffer_, mac_, frame);
    if (!ethernet) return EMSGSIZE;
    bytes = *ethernet;
  }
  const ssize_t result = kernel_->send_to(fd_.get(), bytes, peer_);
  if (result < 0) return static_cast<int>(-result);
  ++sent_;
  transmitted_ns_ = 0;
  return 0;
}

bool EthercatLink::wait_readable(FreeRunningTime deadline) const noexcept {
  const Duration left = deadline - clock_.now();
  if (left <= Duration{}) return false;
  return kernel_->wait_readable(fd_.get(), left.floor_ns()) > 0;  // a signal: let the caller look
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
    if (kernel_->receive(fd_.get(), message, MSG_ERRQUEUE) < 0) return;
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
  sockaddr_storage sender{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  if (!raw_) {
    message.msg_name = &sender;
    message.msg_namelen = sizeof sender;
  }
  const ssize_t size = kernel_->receive(fd_.get(), message, 0);
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
  if (answers_sender_) peer_ = SocketAddress::from(sender);
  const ControlData found = read_control(message);
  if (found.stamp_ns == 0) return Received{frame, clock_.now(), false};
  return Received{frame, clock_.from_realtime(found.stamp_ns), true};
}

std::optional<EthercatLink::Received> EthercatLink::receive(FreeRunningTime deadline,
                                                            bool spin) noexcept {
  constexpr int kMostLate = 64;
  clock_.follow_steps();
  int late = 0;
  while (true) {
    if (auto received = read_one()) return received;
    // However many frames of others come: the answer may wait behind some, not behind a flood.
    const bool over = clock_.now() >= deadline;
    if (over && (spin || ++late > kMostLate)) return std::nullopt;
    if (spin) continue;
    if (!wait_readable(deadline)) return std::nullopt;
    drain_errors();
  }
}

}  // namespace ftcs::platform
