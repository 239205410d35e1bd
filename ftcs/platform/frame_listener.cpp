// SPDX-License-Identifier: MIT
#include "ftcs/platform/frame_listener.h"

#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr std::size_t kAddresses = 12;  // destination and source
constexpr std::size_t kTag = 4;

/// The kernel takes the tag out of the frame and tells it beside.
std::optional<std::uint32_t> tag_of(msghdr& message) {
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_PACKET || header->cmsg_type != PACKET_AUXDATA) continue;
    tpacket_auxdata data{};
    std::memcpy(&data, CMSG_DATA(header), sizeof data);
    if ((data.tp_status & TP_STATUS_VLAN_VALID) == 0) return std::nullopt;
    const std::uint32_t type =
        (data.tp_status & TP_STATUS_VLAN_TPID_VALID) != 0 ? data.tp_vlan_tpid : ETH_P_8021Q;
    return type << 16 | data.tp_vlan_tci;
  }
  return std::nullopt;
}

}  // namespace

Result<FrameListener, OsError> FrameListener::open(const std::string& interface) {
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return os_error(errno, "raw socket");
  FrameListener listener(fd);
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_ALL);
  address.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  if (address.sll_ifindex == 0) return os_error(errno, "interface " + interface);
  const int one = 1;
  setsockopt(fd, SOL_PACKET, PACKET_AUXDATA, &one, sizeof one);
  // Groups that nobody here has joined are heard too. Loopback has none, which is no error.
  packet_mreq all{};
  all.mr_ifindex = address.sll_ifindex;
  all.mr_type = PACKET_MR_PROMISC;
  setsockopt(fd, SOL_PACKET, PACKET_ADD_MEMBERSHIP, &all, sizeof all);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return os_error(errno, "interface " + interface);
  }
  return listener;
}

FrameListener::FrameListener(FrameListener&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), buffer_(std::move(other.buffer_)) {}

FrameListener::~FrameListener() {
  if (fd_ >= 0) close(fd_);
}

std::optional<std::span<const std::uint8_t>> FrameListener::next(std::chrono::milliseconds wait) {
  pollfd readable{fd_, POLLIN, 0};
  if (poll(&readable, 1, static_cast<int>(wait.count())) <= 0) return std::nullopt;
  // The addresses stay in front of the room for a tag, the rest comes behind it.
  std::array<iovec, 2> parts{
      {{buffer_.data(), kAddresses},
       {buffer_.data() + kAddresses + kTag, buffer_.size() - kAddresses - kTag}}};
  alignas(cmsghdr) std::array<char, 256> control{};
  sockaddr_ll from{};
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof from;
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(fd_, &message, 0);
  const bool usable =
      size > static_cast<ssize_t>(kAddresses) && from.sll_pkttype != PACKET_OUTGOING;
  if (!usable) return std::span<const std::uint8_t>{};
  const auto tag = tag_of(message);
  const auto length = static_cast<std::size_t>(size);
  if (tag) {
    for (std::size_t i = 0; i < kTag; ++i) {
      buffer_[kAddresses + i] = static_cast<std::uint8_t>(*tag >> (24 - 8 * i));
    }
    return std::span<const std::uint8_t>{buffer_.data(), length + kTag};
  }
  std::memmove(buffer_.data() + kTag, buffer_.data(), kAddresses);
  return std::span<const std::uint8_t>{buffer_.data() + kTag, length};
}

}  // namespace ftcs::platform
