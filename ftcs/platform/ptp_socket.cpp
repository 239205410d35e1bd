// SPDX-License-Identifier: MIT
#include "ftcs/platform/ptp_socket.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <linux/errqueue.h>
#include <linux/if_packet.h>
#include <linux/net_tstamp.h>
#include <utility>

namespace ftcs::platform {
namespace {

// A driver that has never delivered a stamp after so many messages does not stamp at all.
constexpr std::uint64_t kMissesBeforeUserSpace = 8;
constexpr std::size_t kLongestEventMessage = 128;

struct Datagram {
  ssize_t size = 0;  // negative: -errno
  bool truncated = false;
  SocketAddress sender{};
  bool to_group = true;  // or nobody said
  KernelStamps stamps{};
};

void take(const cmsghdr& header, const unsigned char* data, Datagram& datagram) {
  if (header.cmsg_level == SOL_SOCKET && header.cmsg_type == SCM_TIMESTAMPING) {
    scm_timestamping stamps{};
    std::memcpy(&stamps, data, sizeof stamps);
    const auto nanoseconds = [](const auto& t) { return t.tv_sec * 1'000'000'000 + t.tv_nsec; };
    datagram.stamps = {nanoseconds(stamps.ts[0]), nanoseconds(stamps.ts[2])};
  } else if (header.cmsg_level == IPPROTO_IP && header.cmsg_type == IP_PKTINFO) {
    in_pktinfo info{};
    std::memcpy(&info, data, sizeof info);
    datagram.to_group = IN_MULTICAST(ntohl(info.ipi_addr.s_addr));
  } else if (header.cmsg_level == IPPROTO_IPV6 && header.cmsg_type == IPV6_PKTINFO) {
    in6_pktinfo info{};
    std::memcpy(&info, data, sizeof info);
    datagram.to_group = info.ipi6_addr.s6_addr[0] == 0xFF;
  }
}

bool is_packet_to_us(const sockaddr_storage& sender) {
  if (sender.ss_family != AF_PACKET) return false;
  sockaddr_ll link{};
  std::memcpy(&link, &sender, sizeof link);
  return link.sll_pkttype == PACKET_HOST;
}

Datagram receive_datagram(Kernel& kernel, int fd, std::span<std::uint8_t> buffer, int flags) {
  // Room for the stamps, the extended error of the error queue and its address.
  alignas(cmsghdr) std::array<char, 512> control{};
  iovec vector{buffer.data(), buffer.size()};
  sockaddr_storage sender{};
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
  datagram.sender = SocketAddress::from(sender);
  datagram.to_group = !is_packet_to_us(sender);
  datagram.truncated = (message.msg_flags & MSG_TRUNC) != 0;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    take(*header, CMSG_DATA(header), datagram);
  }
  return datagram;
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
  const int asking = kernel_->socket(AF_INET, SOCK_DGRAM);
  if (asking < 0) return os_error(-asking, "socket");
  const Descriptor closes(*kernel_, asking);
  const auto state = interface_state(*kernel_, asking, config_.interface);
  if (!state) return state.error();
  interface_ = *state;
  if (!state->up) return os_error(ENETDOWN, "interface " + config_.interface);
  auto opened = open_endpoint(*kernel_, config_, interface_, channel);
  if (!opened) return opened.error();
  sockets_[static_cast<std::size_t>(channel)] = std::move(*opened);
  return channel == Channel::kEvent ? enable_timestamps(descriptor(channel)) : std::nullopt;
}

std::optional<OsError> PtpSocket::enable_timestamps(int fd) {
  constexpr int kSoftware =
      SOF_TIMESTAMPING_TX_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  constexpr int kHardware =
      SOF_TIMESTAMPING_TX_HARDWARE | SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
  if (clock_->is_hardware()) {
    const auto capabilities = interface_capabilities(*kernel_, fd, config_.interface);
    if (!capabilities) return capabilities.error();
    if (auto error = enable_hardware_timestamps(*kernel_, fd, config_.interface, *capabilities,
                                                config_.transport == NetworkTransport::kEthernet)) {
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
                                       Group group) {
  return transmit(channel, bytes, destination_of(config_, interface_.index, channel, group));
}

std::optional<OsError> PtpSocket::send_to(Channel channel, std::span<const std::uint8_t> bytes,
                                          const SocketAddress& to) {
  return transmit(channel, bytes, to.with_port(port(channel)).on_interface(interface_.index));
}

std::optional<OsError> PtpSocket::transmit(Channel channel, std::span<const std::uint8_t> bytes,
                                           const SocketAddress& to) {
  std::array<std::uint8_t, kLongestEventMessage> padded{};
  const std::size_t padding = padding_of(config_.transport);
  if (channel == Channel::kEvent && padding > 0 && bytes.size() + padding <= padded.size()) {
    std::copy(bytes.begin(), bytes.end(), padded.begin());
    bytes = {padded.data(), bytes.size() + padding};
  }
  const ssize_t result = kernel_->send_to(descriptor(channel), bytes, to);
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
  if (!admits(datagram.sender, datagram.to_group,
              {buffer_.data(), static_cast<std::size_t>(datagram.size)})) {
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

bool PtpSocket::admits(const SocketAddress& sender, bool to_group,
                       std::span<const std::uint8_t> bytes) noexcept {
  if (config_.unicast) {
    const bool known = sender.is_same_host(*config_.unicast);
    if (!known) ++counters_.stranger_dropped;
    return known;
  }
  constexpr unsigned kDelayResp = 9;  // messageType, IEEE 1588-2019 table 36
  const bool answer = !bytes.empty() && (bytes[0] & 0xFU) == kDelayResp;
  const bool may = config_.unicast_messages == UnicastMessages::kAll ||
                   (answer && config_.unicast_messages == UnicastMessages::kDelayAnswers);
  if (to_group || may) return true;
  ++counters_.unicast_dropped;
  return false;
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
