// SPDX-License-Identifier: MIT
#include "ftcs/platform/ptp_socket.h"

#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr std::uint32_t kPtpPrimaryMulticast =
    0xE0000181;  // 224.0.1.129, IEEE 1588-2019, Annex C.3
// A driver that has never delivered a stamp after so many messages does not stamp at all.
constexpr std::uint64_t kMissesBeforeUserSpace = 8;

struct Datagram {
  ssize_t size = 0;  // negative: -errno
  bool truncated = false;
  in_addr sender{};
  KernelStamps stamps{};
};

Datagram receive_datagram(Kernel& kernel, int fd, std::span<std::uint8_t> buffer, int flags) {
  // Room for the stamps, the extended error of the error queue and its address.
  alignas(cmsghdr) std::array<char, 512> control{};
  iovec vector{buffer.data(), buffer.size()};
  sockaddr_in sender{};
  msghdr message{};
  message.msg_name = &sender;
  message.msg_namelen = sizeof sender;
  message.msg_iov = &vector;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();

  Datagram datagram;
  datagram.size = kernel.receive(fd, message, flags);
  if (datagram.size < 0) return datagram;
  datagram.sender = sender.sin_addr;
  datagram.truncated = (message.msg_flags & MSG_TRUNC) != 0;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_TIMESTAMPING) continue;
    scm_timestamping stamps{};
    std::memcpy(&stamps, CMSG_DATA(header), sizeof stamps);
    const auto nanoseconds = [](const auto& t) { return t.tv_sec * 1'000'000'000 + t.tv_nsec; };
    datagram.stamps = {nanoseconds(stamps.ts[0]), nanoseconds(stamps.ts[2])};
  }
  return datagram;
}

OsError socket_error(int result, const char* what, std::uint16_t port) {
  return os_error(-result, std::string(what) + " port " + std::to_string(port));
}

}  // namespace

Result<PtpSocket, OsError> PtpSocket::open(Kernel& kernel, const PtpSocketConfig& config,
                                           TimestampClock& clock) {
  PtpSocket socket(kernel, config, clock);
  for (const Channel channel : {Channel::kEvent, Channel::kGeneral}) {
    if (auto error = socket.open_channel(channel)) return std::move(*error);
  }
  return socket;
}

std::optional<OsError> PtpSocket::open_channel(Channel channel) {
  const int fd = kernel_->socket(AF_INET, SOCK_DGRAM);
  if (fd < 0) return os_error(-fd, "socket");
  Descriptor& owner = sockets_[static_cast<std::size_t>(channel)];
  owner = Descriptor(*kernel_, fd);
  if (const int result = kernel_->set_nonblocking(fd); result < 0) {
    return os_error(-result, "socket");
  }

  const std::string& interface = config_.interface;
  const auto state = interface_state(*kernel_, fd, interface);
  if (!state) return state.error();
  interface_ = *state;
  if (!state->up) return os_error(ENETDOWN, "interface " + interface);
  if (auto error = missing_ipv4_address(*kernel_, fd, interface)) return error;

  // The name with its terminating zero. Without the right (kernels before 5.7) the multicast
  // membership alone keeps other interfaces' messages out.
  const int bound = kernel_->set_option(fd, SOL_SOCKET, SO_BINDTODEVICE, interface.c_str(),
                                        static_cast<socklen_t>(interface.size() + 1));
  if (bound < 0 && bound != -EPERM) return os_error(-bound, "interface " + interface);

  // Multicast: several programs of one host may listen. Unicast: a port belongs to one.
  const int share = config_.unicast ? 0 : 1;
  int result = kernel_->set_option(fd, SOL_SOCKET, SO_REUSEADDR, &share, sizeof share);
  if (result < 0) return os_error(-result, "socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port(channel));
  result = kernel_->bind(fd, address);
  if (result < 0) return socket_error(result, "UDP", port(channel));
  if (!config_.unicast) {
    if (auto error = join_multicast(fd)) return error;
  }
  return channel == Channel::kEvent ? enable_timestamps(fd) : std::nullopt;
}

std::optional<OsError> PtpSocket::join_multicast(int fd) const {
  ip_mreqn group{};
  group.imr_multiaddr.s_addr = htonl(kPtpPrimaryMulticast);
  group.imr_ifindex = interface_.index;
  // On loopback the copy for ourselves is the only way to the neighbour process.
  const int loop = interface_.loopback ? 1 : 0;
  const int only_joined = 0;
  struct Option {
    int name;
    const void* value;
    socklen_t size;
  };
  const std::array options{Option{IP_ADD_MEMBERSHIP, &group, sizeof group},
                           Option{IP_MULTICAST_IF, &group, sizeof group},
                           Option{IP_MULTICAST_LOOP, &loop, sizeof loop},
                           Option{IP_MULTICAST_ALL, &only_joined, sizeof only_joined},
                           Option{IP_MULTICAST_TTL, &config_.ttl, sizeof config_.ttl}};
  for (const Option& option : options) {
    const int result = kernel_->set_option(fd, IPPROTO_IP, option.name, option.value, option.size);
    if (result < 0) return os_error(-result, "multicast on " + config_.interface);
  }
  return std::nullopt;
}

std::optional<OsError> PtpSocket::enable_timestamps(int fd) {
  constexpr int kSoftware =
      SOF_TIMESTAMPING_TX_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  constexpr int kHardware =
      SOF_TIMESTAMPING_TX_HARDWARE | SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
  if (clock_->is_hardware()) {
    const auto capabilities = interface_capabilities(*kernel_, fd, config_.interface);
    if (!capabilities) return capabilities.error();
    if (auto error = enable_hardware_timestamps(*kernel_, fd, config_.interface, *capabilities)) {
      return error;
    }
  }
  // Makes poll(2) report the error queue as POLLPRI too, apart from errors.
  const int on = 1;
  (void)kernel_->set_option(fd, SOL_SOCKET, SO_SELECT_ERR_QUEUE, &on, sizeof on);
  const int flags = clock_->is_hardware() ? kHardware : kSoftware;
  const int result = kernel_->set_option(fd, SOL_SOCKET, SO_TIMESTAMPING, &flags, sizeof flags);
  if (result >= 0) {
    receive_stamps_ = clock_->is_hardware() ? StampSource::kHardware : StampSource::kSoftware;
  } else if (clock_->mode() == TimestampMode::kBestAvailable && !clock_->is_hardware()) {
    receive_stamps_ = StampSource::kUserSpace;
  } else {
    return os_error(-result, "time stamping on " + config_.interface);
  }
  transmit_stamps_ = receive_stamps_;
  return std::nullopt;
}

std::optional<OsError> PtpSocket::send(Channel channel, std::span<const std::uint8_t> bytes,
                                       std::optional<in_addr> to) {
  if (!to) to = config_.unicast;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port(channel));
  address.sin_addr.s_addr = to ? to->s_addr : htonl(kPtpPrimaryMulticast);
  const ssize_t result = kernel_->send_to(descriptor(channel), bytes, address);
  if (result < 0) return os_error(static_cast<int>(-result), "sending on " + config_.interface);
  ++counters_.sent;
  if (channel != Channel::kEvent) return std::nullopt;
  if (transmit_stamps_ == StampSource::kUserSpace) {
    stamped_in_user_space_.emplace_back(std::vector<std::uint8_t>(bytes.begin(), bytes.end()),
                                        clock_->user_space_stamp());
  } else {
    log_.remember(bytes, clock_->source().now());
  }
  return std::nullopt;
}

Result<std::optional<ReceivedMessage>, OsError> PtpSocket::receive(Channel channel) {
  const Datagram datagram = receive_datagram(*kernel_, descriptor(channel), buffer_, 0);
  // Read at once: the nearer to the arrival, the better as a last resort.
  const Stamp arrival = clock_->user_space_stamp();
  if (datagram.size == -EAGAIN || datagram.size == -EINTR) return std::optional<ReceivedMessage>{};
  if (datagram.size < 0) {
    return os_error(static_cast<int>(-datagram.size), "receiving on " + config_.interface);
  }
  if (datagram.truncated) {
    ++counters_.oversized;
    return std::optional<ReceivedMessage>{};
  }
  ++counters_.received;
  ReceivedMessage message;
  message.channel = channel;
  message.bytes = {buffer_.data(), static_cast<std::size_t>(datagram.size)};
  message.sender = datagram.sender;
  if (channel == Channel::kEvent) {
    if (receive_stamps_ == StampSource::kUserSpace) {
      message.stamp = arrival;
    } else {
      message.stamp = clock_->convert(datagram.stamps);
      if (!message.stamp) ++counters_.receive_stamp_missing;
    }
  }
  return std::optional<ReceivedMessage>{message};
}

std::optional<TransmittedMessage> PtpSocket::receive_transmitted() {
  const Datagram datagram =
      receive_datagram(*kernel_, descriptor(Channel::kEvent), buffer_, MSG_ERRQUEUE);
  if (datagram.size < 0) return std::nullopt;
  const auto size = static_cast<std::size_t>(datagram.size);
  const auto entry = log_.match({buffer_.data(), size});
  const auto stamp = clock_->convert(datagram.stamps);
  if (!entry) {
    ++counters_.transmit_stamp_unknown;
    return std::nullopt;
  }
  if (!stamp) {
    ++counters_.transmit_stamp_missing;
    return TransmittedMessage{entry->bytes, std::nullopt};
  }
  ++stamps_obtained_;
  if (entry->was_expired) ++counters_.transmit_stamp_late;
  return TransmittedMessage{entry->bytes, stamp};
}

std::optional<TransmittedMessage> PtpSocket::overdue() {
  if (!stamped_in_user_space_.empty()) {
    Stamp stamp;
    std::tie(handed_out_, stamp) = std::move(stamped_in_user_space_.front());
    stamped_in_user_space_.pop_front();
    return TransmittedMessage{handed_out_, stamp};
  }
  const auto bytes = log_.expire(clock_->source().now(), config_.tx_timestamp_timeout);
  if (!bytes) return std::nullopt;
  ++counters_.transmit_stamp_missing;
  if (stamps_obtained_ == 0 && counters_.transmit_stamp_missing >= kMissesBeforeUserSpace &&
      clock_->mode() == TimestampMode::kBestAvailable && !clock_->is_hardware()) {
    transmit_stamps_ = StampSource::kUserSpace;
  }
  return TransmittedMessage{*bytes, std::nullopt};
}

std::optional<FreeRunningTime> PtpSocket::next_deadline() const noexcept {
  if (!stamped_in_user_space_.empty()) return FreeRunningTime{};  // now
  const auto oldest = log_.oldest();
  if (!oldest) return std::nullopt;
  return *oldest + Duration{config_.tx_timestamp_timeout};
}

}  // namespace ftcs::platform
