// SPDX-License-Identifier: MIT
#include "ftcs/platform/ptp_transport.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <utility>

namespace ftcs::platform {
namespace {

constexpr Duration kLinkInterval{std::chrono::seconds{1}};
constexpr Duration kFirstReopenDelay{std::chrono::milliseconds{250}};
constexpr Duration kLongestReopenDelay{std::chrono::seconds{8}};
// A signal that arrives just before poll(2) is noticed after this at the latest.
constexpr Duration kLongestWait{std::chrono::milliseconds{250}};

// Rounded up, so that the deadline has passed when poll(2) returns.
int poll_timeout_ms(Duration wait) {
  constexpr std::int64_t kNsPerMs = 1'000'000;
  wait = std::clamp(wait, Duration{}, kLongestWait);
  return static_cast<int>((wait.floor_ns() + kNsPerMs - 1) / kNsPerMs);
}

/// Somebody plugs it in, sets it up or gives it an address: soon after, it is used.
bool is_awaited(const OsError& error) {
  return error.kind == OsErrorKind::kInterfaceDown || error.kind == OsErrorKind::kNoAddress;
}

}  // namespace

PtpTransport::PtpTransport(Kernel& kernel, PtpSocketConfig config, TimestampClock& clock,
                           TransportHandler& handler)
    : kernel_(kernel), config_(std::move(config)), clock_(clock), handler_(handler) {}

std::optional<OsError> PtpTransport::open() {
  auto opened = PtpSocket::open(kernel_, config_, clock_);
  if (!opened) return opened.error();
  socket_.emplace(std::move(*opened));
  closed_.reset();
  running_ = socket_->interface().running;
  carrier_is_reported_ = running_;
  carrier_ = true;
  suspect_ = false;
  reopen_delay_ = kFirstReopenDelay;
  next_check_ = clock_.source().now() + kLinkInterval;
  return std::nullopt;
}

std::optional<OsError> PtpTransport::open_or_wait() {
  auto error = open();
  if (!error || !is_awaited(*error)) return error;
  stamp_in_hardware();
  closed_ = std::move(error);
  reopen_delay_ = kFirstReopenDelay;
  next_check_ = clock_.source().now() + reopen_delay_;
  handler_.on_link(false, closed_->message());
  return std::nullopt;
}

// While there is the right to: the sockets may be opened without it. Where it fails, they say so.
void PtpTransport::stamp_in_hardware() {
  if (!clock_.is_hardware()) return;
  const int fd = kernel_.socket(AF_INET, SOCK_DGRAM);
  if (fd < 0) return;
  const Descriptor closes(kernel_, fd);
  if (const auto adapter = interface_capabilities(kernel_, fd, config_.interface)) {
    (void)enable_hardware_timestamps(kernel_, fd, config_.interface, *adapter,
                                     config_.transport == NetworkTransport::kEthernet);
  }
}

std::optional<OsError> PtpTransport::send(Channel channel, std::span<const std::uint8_t> bytes,
                                          Group group) {
  if (!socket_) return os_error(ENETDOWN, "interface " + config_.interface);
  return note(socket_->send(channel, bytes, group));
}

std::optional<OsError> PtpTransport::send_to(Channel channel, std::span<const std::uint8_t> bytes,
                                             const SocketAddress& to) {
  if (!socket_) return os_error(ENETDOWN, "interface " + config_.interface);
  return note(socket_->send_to(channel, bytes, to));
}

std::optional<OsError> PtpTransport::note(std::optional<OsError> error) {
  if (error && error->number != EAGAIN) suspect_ = true;  // a full queue says nothing of the link
  return error;
}

bool PtpTransport::wait_until(FreeRunningTime deadline) {
  const FreeRunningTime now = clock_.source().now();
  if (suspect_ || now >= next_check_) check_link(now);
  report_overdue();
  return poll_sockets(std::min(deadline, next_check_));
}

bool PtpTransport::poll_sockets(FreeRunningTime deadline) {
  // The sockets keep the first two places, watched ones follow; a negative descriptor is ignored.
  std::array<pollfd, 2 + kLargestWatch> descriptors{{{-1, 0, 0}, {-1, 0, 0}}};
  std::size_t count = 2;
  if (socket_) {
    constexpr auto kEvents = static_cast<short>(POLLIN | POLLPRI);
    descriptors[0] = {socket_->descriptor(Channel::kEvent), kEvents, 0};
    descriptors[1] = {socket_->descriptor(Channel::kGeneral), POLLIN, 0};
    if (const auto overdue = socket_->next_deadline()) deadline = std::min(deadline, *overdue);
  }
  for (const int descriptor : watched_) descriptors[count++] = {descriptor, POLLIN, 0};
  const int timeout = poll_timeout_ms(deadline - clock_.source().now());
  if (kernel_.poll({descriptors.data(), count}, timeout) <= 0) return false;
  constexpr auto kTransmitted = static_cast<short>(POLLPRI | POLLERR);
  if ((descriptors[0].revents & kTransmitted) != 0) {
    if (const auto transmitted = socket_->receive_transmitted()) {
      handler_.on_transmitted(*transmitted);
    } else if ((descriptors[0].revents & POLLERR) != 0) {
      receive(Channel::kEvent);  // fetches and so clears a pending error
    }
  }
  if ((descriptors[0].revents & POLLIN) != 0) receive(Channel::kEvent);
  if ((descriptors[1].revents & (POLLIN | POLLERR)) != 0) receive(Channel::kGeneral);
  for (std::size_t i = 2; i < count; ++i) {
    if ((descriptors[i].revents & POLLIN) != 0) handler_.on_readable(descriptors[i].fd);
  }
  return true;
}

void PtpTransport::receive(Channel channel) {
  const auto received = socket_->receive(channel);
  if (!received) {
    suspect_ = true;
  } else if (received->has_value()) {
    handler_.on_message(**received);
  }
}

void PtpTransport::report_overdue() {
  while (socket_) {
    const auto message = socket_->overdue();
    if (!message) return;
    handler_.on_transmitted(*message);
  }
}

void PtpTransport::check_link(FreeRunningTime now) {
  suspect_ = false;
  next_check_ = now + kLinkInterval;
  if (!socket_) return try_to_reopen(now);
  const auto state =
      interface_state(kernel_, socket_->descriptor(Channel::kGeneral), config_.interface);
  const std::string interface = "interface " + config_.interface;
  if (!state) return lose(state.error());
  if (!state->up) return lose(os_error(ENETDOWN, interface));
  if (state->index != socket_->interface().index) {
    return lose(os_error(ENODEV, interface), interface + ": was replaced");
  }
  if (config_.transport == NetworkTransport::kUdpIpv4) {
    const int descriptor = socket_->descriptor(Channel::kGeneral);
    // Syncs would come on, but no answer: it is said, and open() waits for the address.
    if (const auto none = missing_ipv4_address(kernel_, descriptor, config_.interface)) {
      return lose(*none);
    }
  }
  const bool came = state->running && !running_;
  running_ = state->running;
  carrier_is_reported_ = carrier_is_reported_ || state->running;
  const bool carrier = state->running || !carrier_is_reported_;
  if (carrier == carrier_ && !came) return;
  carrier_ = carrier;
  handler_.on_link(carrier, carrier ? "" : interface + ": no carrier");
}

void PtpTransport::lose(const OsError& error, const std::string& reason) {
  const bool was_up = is_up();
  socket_.reset();
  closed_ = error;
  next_check_ = clock_.source().now() + reopen_delay_;
  if (was_up) handler_.on_link(false, reason);
}

void PtpTransport::try_to_reopen(FreeRunningTime now) {
  const Duration delay = std::min(reopen_delay_ + reopen_delay_, kLongestReopenDelay);
  const std::string known = closed_ ? closed_->message() : "";
  if (auto error = open()) {
    reopen_delay_ = delay;
    next_check_ = now + (is_awaited(*error) ? std::min(delay, kLinkInterval) : delay);
    const bool is_news = error->message() != known;
    closed_ = std::move(error);
    if (is_news) handler_.on_link(false, closed_->message());
    return;
  }
  handler_.on_link(true, "");
}

}  // namespace ftcs::platform
