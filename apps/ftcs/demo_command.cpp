// SPDX-License-Identifier: MIT
#include <arpa/inet.h>
#include <unistd.h>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/units.h"
#include "ftcs/daemon/ptp_transmitter.h"
#include "ftcs/fieldbus/demo_report.h"

namespace ftcs::app {
namespace {

using daemon::DemoOptions;
using daemon::DemoReceiver;
using daemon::DemoResult;

/// Where the figures go; empty: nowhere.
struct DemoFiles {
  std::string json;
  std::string html;
};

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
  std::uint16_t port = 0;
  for (int i = 0; i < kAttempts; ++i) {
    port = static_cast<std::uint16_t>(kFirst + 2 * ((getpid() + i) % kPairs));
    if (!port_in_use(kernel, port)) break;
  }
  return port;
}

ptp::ClockIdentity identity(std::uint8_t last) {
  // Locally administered, as no adapter stands behind it.
  return ptp::ClockIdentity::from_mac({0x02, 0x46, 0x54, 0x43, 0x53, last});
}

daemon::PtpOptions port_options(platform::Kernel& kernel, const DemoOptions& demo) {
  daemon::PtpOptions options;
  options.interface = "lo";
  if (!demo.interface.empty()) {
    options.interface = demo.interface;
    options.timestamps = platform::TimestampMode::kSoftware;  // the truth is CLOCK_REALTIME
  } else {
    options.socket.event_port = demo.event_port != 0 ? demo.event_port : default_event_port(kernel);
    options.socket.general_port = static_cast<std::uint16_t>(options.socket.event_port + 1);
  }
  options.socket.interface = options.interface;
  options.log_sync_interval = demo.log_sync_interval;
  options.log_min_delay_req_interval = demo.log_sync_interval;
  options.log_announce_interval = -2;  // two of them qualify the transmitter: half a second
  options.log_level = static_cast<int>(daemon::LogLevel::kWarning);
  return options;
}

std::optional<platform::OsError> open(platform::Kernel& kernel, const daemon::PtpOptions& options,
                                      std::unique_ptr<platform::TimestampClock>& clock) {
  auto opened = platform::TimestampClock::open(kernel, options.interface, options.timestamps);
  if (!opened) return opened.error();
  clock = std::move(*opened);
  return std::nullopt;
}

int run_transmitter(daemon::PtpOptions options) {
  // Ctrl-C at a terminal goes to a process group: only the receiver must hear it, which then ends
  // us; otherwise it would find its transmitter dead and call that an error.
  (void)setpgid(0, 0);
  platform::LinuxKernel kernel;
  daemon::Log log(kernel, stderr, options.log_level);
  options.role = daemon::Role::kTimeTransmitter;
  std::unique_ptr<platform::TimestampClock> clock;
  if (const auto error = open(kernel, options, clock)) {
    fmt::print(stderr, "ftcs demo: {}\n", error->message());
    return kRuntimeError;
  }
  return daemon::PtpTransmitter(kernel, options, log, std::move(clock), {{identity(1), 1}}).run();
}

struct DemoArguments {
  DemoOptions options;
  std::string offset;
  std::string skew;
  DemoFiles files;
  std::string part = "both";
};

std::optional<std::string> complete(DemoArguments& arguments) {
  if (!arguments.offset.empty()) {
    const auto offset = parse_duration(arguments.offset);
    if (!offset) return "--offset: " + offset.error().message;
    if (abs(*offset) > Duration{std::chrono::milliseconds{100}}) {
      return "--offset: at most 100ms either way; within one interval more could not be slewed";
    }
    arguments.options.offset = *offset;
  }
  if (!arguments.skew.empty()) {
    const auto skew = parse_ppb(arguments.skew);
    if (!skew) return "--skew: " + skew.error().message;
    if (std::abs(*skew) > arguments.options.max_frequency_ppb / 2) {
      return "--skew: at most 50000ppm either way, half of the rate limit";
    }
    arguments.options.skew_ppb = *skew;
  }
  return std::nullopt;
}

}  // namespace

namespace {

/// The PTP half; a message and an exit code if it could not be shown.
int run_ptp_demo(const DemoOptions& demo, DemoResult& result) {
  platform::LinuxKernel kernel;
  daemon::PtpOptions options = port_options(kernel, demo);
  if (const auto error = port_in_use(kernel, options.socket.event_port)) {
    fmt::print(stderr, "ftcs demo: {}\n", error->message());
    return kRuntimeError;
  }
  daemon::Log log(kernel, stderr, options.log_level);
  std::unique_ptr<platform::TimestampClock> clock;
  if (const auto error = open(kernel, options, clock)) {
    fmt::print(stderr, "ftcs demo: {}\n", error->message());
    return kRuntimeError;
  }
  options.start = clock->read_realtime();  // both processes stand on this line: the truth is known
  std::optional<platform::ChildProcess> transmitter;
  if (demo.interface.empty()) {
    auto started = platform::ChildProcess::start([&options] { return run_transmitter(options); });
    if (!started) {
      fmt::print(stderr, "ftcs demo: {}\n", started.error().message());
      return kRuntimeError;
    }
    transmitter.emplace(std::move(*started));
  }
  options.clock_identity = identity(2);
  options.skew_ppb = demo.skew_ppb;
  options.duration = Duration::from_ns(demo.duration_s * 1e9);
  const std::string timestamps = clock->is_hardware() ? "hardware" : "kernel software";
  DemoReceiver receiver(kernel, options, demo, log, std::move(clock),
                        transmitter ? &*transmitter : nullptr);
  if (const int code = receiver.run(); code != kSuccess) return code;
  result = receiver.result();
  result.timestamps = timestamps;
  fmt::print("{}", daemon::demo_text(demo, result));
  std::fflush(stdout);
  return kSuccess;
}

int write_files(const DemoOptions& demo, const DemoFiles& files, const DemoResult* result,
                const daemon::EthercatDemo* ethercat) {
  bool written =
      files.json.empty() || write_result(files.json, daemon::demo_json(demo, result, ethercat));
  written &=
      files.html.empty() || write_result(files.html, daemon::demo_html(demo, result, ethercat));
  if (!files.html.empty() && written) fmt::print("\nreport: {}\n", files.html);
  return written ? kSuccess : kRuntimeError;
}

/// Runs both parts; prints tables and sentences. Returns an exit code: both locked or not.
int run_demo(const DemoOptions& demo, const DemoFiles& files) {
  if (!can_write_results({files.json, files.html})) return kRuntimeError;
  DemoResult result;
  if (demo.ptp) {
    if (const int code = run_ptp_demo(demo, result); code != kSuccess) return code;
  }
  platform::LinuxKernel kernel;
  std::unique_ptr<daemon::EthercatDemo> ethercat;
  if (demo.ethercat && !result.interrupted) {
    // Four runs, which with the PTP half take less than three times its time.
    constexpr double kPartOfDuration = 0.3;
    ethercat =
        daemon::run_ethercat_demo(kernel, {demo.duration_s * kPartOfDuration, demo.live_view});
    if (ethercat == nullptr) return kRuntimeError;
    fmt::print("{}", daemon::ethercat_demo_text(*ethercat));
  }
  const int code = write_files(demo, files, demo.ptp ? &result : nullptr, ethercat.get());
  if (code != kSuccess) return code;
  const bool ptp_locked = !demo.ptp || result.servos.front().locked;
  const bool ethercat_locked =
      ethercat == nullptr ||
      (!ethercat->runs.empty() && ethercat->runs.front()->decision().state == CycleState::kLocked);
  return ptp_locked && ethercat_locked ? kSuccess : kNotLocked;
}

}  // namespace

void add_demo_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("demo",
                                         "lock a clock over PTP, then eight EtherCAT drives, on "
                                         "this machine: no root, no configuration");
  const auto arguments = std::make_shared<DemoArguments>();
  DemoOptions& options = arguments->options;
  command
      ->add_option("--duration", options.duration_s,
                   "of the PTP half, default 20; each EtherCAT run takes three tenths of it")
      ->type_name("SECONDS")
      ->check(number_from(3, 86'400));
  command->add_option("--json", arguments->files.json, "write the figures to this file")
      ->type_name("FILE");
  command->add_option("--html", arguments->files.html, "write a report with plots to this file")
      ->type_name("FILE");
  command
      ->add_option("--interface", options.interface,
                   "no transmitter of its own: listen there to one that stamps with this machine's "
                   "CLOCK_REALTIME")
      ->type_name("NAME");
  command->add_option("--part", arguments->part, "both (default), ptp or ethercat")
      ->check(CLI::IsMember({"both", "ptp", "ethercat"}));
  command->add_option("--offset", arguments->offset, "of the clock at the start; default 1ms")
      ->type_name("TIME");
  command->add_option("--skew", arguments->skew, "of its oscillator; default 50ppm")
      ->type_name("RATE");
  command
      ->add_option("--logSyncInterval", options.log_sync_interval,
                   "log2 of seconds; default -3 (125 ms)")
      ->type_name("N")
      ->check(integer_from(-7, 0));
  command
      ->add_option("--event-port", options.event_port,
                   "UDP port, and the next one for general messages")
      ->type_name("PORT")
      ->check(integer_from(1024, 65'534));
  command->add_flag_callback(
      "--no-live", [&options] { options.live_view = false; }, "no live view on the terminal");
  command->callback([arguments, &exit_code] {
    if (const auto wrong = complete(*arguments)) {
      fmt::print(stderr, "ftcs demo: {}\n", *wrong);
      exit_code = kUsageError;
      return;
    }
    arguments->options.ptp = arguments->part != "ethercat";
    arguments->options.ethercat = arguments->part != "ptp";
    arguments->options.live_view = arguments->options.live_view && isatty(STDOUT_FILENO) == 1;
    exit_code = run_demo(arguments->options, arguments->files);
  });
}

}  // namespace ftcs::app
