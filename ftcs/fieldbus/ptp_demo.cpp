// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/ptp_demo.h"

#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/ptp_transmitter.h"
#include "ftcs/fieldbus/demo_report.h"
#include "ftcs/platform/child_process.h"

namespace ftcs::daemon {
namespace {

/// The two processes share their ports with each other, so that the system would let a third one
/// in: two demonstrations on one port hear each other. Whoever asks for a port alone is refused.
std::optional<platform::OsError> port_in_use(platform::Kernel& kernel, std::uint16_t event_port) {
  for (const int port : {int{event_port}, event_port + 1}) {
    const int fd = kernel.socket(AF_INET, SOCK_DGRAM);
    if (fd < 0) return platform::os_error(-fd, "socket");
    const platform::Descriptor socket(kernel, fd);
    const auto address = platform::SocketAddress::ipv4({}, static_cast<std::uint16_t>(port));
    const int result = kernel.bind(fd, address);
    if (result < 0) return platform::os_error(-result, fmt::format("UDP port {}", port));
  }
  return std::nullopt;
}

/// Ports of this process alone, below the range of ephemeral ports; no rights needed.
std::uint16_t default_event_port(platform::Kernel& kernel) {
  constexpr int kFirst = 20000;
  constexpr int kPairs = 5000;
  constexpr int kAttempts = 100;  // all of them taken: let the last one be the error
  // Two that begin in the same microsecond look on.
  const std::int64_t start = kernel.clock_ns(CLOCK_MONOTONIC) / 1000 % kPairs;
  std::uint16_t port = 0;
  for (int i = 0; i < kAttempts; ++i) {
    port = static_cast<std::uint16_t>(kFirst + 2 * ((start + i) % kPairs));
    if (!port_in_use(kernel, port)) break;
  }
  return port;
}

ptp::ClockIdentity identity(std::uint8_t last) {
  // Locally administered, as no adapter stands behind it.
  return ptp::ClockIdentity::from_mac({0x02, 0x46, 0x54, 0x43, 0x53, last});
}

PtpOptions port_options(platform::Kernel& kernel, const DemoOptions& demo) {
  PtpOptions options;
  options.interface = "lo";
  if (!demo.interface.empty()) {
    options.interface = demo.interface;
    options.timestamps = platform::TimestampMode::kSoftware;  // the truth is CLOCK_REALTIME
  } else {
    options.socket.event_port = demo.event_port != 0 ? demo.event_port : default_event_port(kernel);
    options.socket.general_port = static_cast<std::uint16_t>(options.socket.event_port + 1);
  }
  options.socket.interface = options.interface;
  options.transmitter.log_sync_interval = demo.log_sync_interval;
  options.protocol.log_min_delay_req_interval = demo.log_sync_interval;
  options.protocol.log_announce_interval =
      -2;  // two of them qualify the transmitter: half a second
  options.log_level = static_cast<int>(LogLevel::kWarning);
  return options;
}

std::optional<platform::OsError> open(platform::Kernel& kernel, const PtpOptions& options,
                                      std::unique_ptr<platform::TimestampClock>& clock) {
  auto opened = platform::TimestampClock::open(kernel, options.interface, options.timestamps);
  if (!opened) return opened.error();
  clock = std::move(*opened);
  return std::nullopt;
}

int run_transmitter(platform::Kernel& kernel, PtpOptions options) {
  Log log(kernel, stderr, options.log_level);
  options.role = Role::kTimeTransmitter;
  std::unique_ptr<platform::TimestampClock> clock;
  if (const auto error = open(kernel, options, clock)) {
    fmt::print(stderr, "ftcs demo: {}\n", error->message());
    return kRuntimeError;
  }
  return PtpTransmitter(kernel, options, log, std::move(clock), {{identity(1), 1}}).run();
}

}  // namespace

int run_ptp_demo(platform::Kernel& kernel, const DemoOptions& demo, DemoResult& result) {
  PtpOptions options = port_options(kernel, demo);
  if (const auto error = port_in_use(kernel, options.socket.event_port)) {
    fmt::print(stderr, "ftcs demo: {}\n", error->message());
    return kRuntimeError;
  }
  Log log(kernel, stderr, options.log_level);
  std::unique_ptr<platform::TimestampClock> clock;
  if (const auto error = open(kernel, options, clock)) {
    fmt::print(stderr, "ftcs demo: {}\n", error->message());
    return kRuntimeError;
  }
  options.clock.start =
      clock->read_realtime();  // both processes stand on this line: the truth is known
  std::optional<platform::ChildProcess> transmitter;
  if (demo.interface.empty()) {
    auto started = platform::ChildProcess::start(
        [&kernel, &options] { return run_transmitter(kernel, options); });
    if (!started) {
      fmt::print(stderr, "ftcs demo: {}\n", started.error().message());
      return kRuntimeError;
    }
    transmitter.emplace(std::move(*started));
  }
  options.protocol.clock_identity = identity(2);
  options.clock.skew_ppb = demo.skew_ppb;
  options.duration = Duration::from_ns(demo.duration_s * 1e9);
  const std::string timestamps = clock->is_hardware() ? "hardware" : "kernel software";
  DemoReceiver receiver(kernel, options, demo, log, std::move(clock),
                        transmitter ? &*transmitter : nullptr);
  if (const int code = receiver.run(); code != kSuccess) return code;
  result = receiver.result();
  result.timestamps = timestamps;
  fmt::print("{}", demo_text(demo, result));
  std::fflush(stdout);
  return kSuccess;
}

}  // namespace ftcs::daemon
