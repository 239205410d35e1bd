// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/config_file.h"
#include "apps/ftcs/ptp_arguments.h"
#include "apps/ftcs/ptp_option_table.h"
#include "apps/ftcs/ptp_presets.h"
#include "apps/ftcs/watch_arguments.h"
#include "ftcs/daemon/management_server.h"
#include "ftcs/daemon/ptp_port.h"
#include "ftcs/daemon/rights.h"
#include "ftcs/platform/network_interface.h"
#include "ftcs/record/quantity_text.h"

namespace ftcs::app {
namespace {

using Wrong = std::optional<std::string>;

Wrong set_duration(const std::string& text, const char* flag, Duration& target) {
  if (text.empty()) return std::nullopt;
  const auto value = parse_duration(text);
  if (!value) return fmt::format("{}: {}", flag, value.error().message);
  target = *value;
  return std::nullopt;
}

/// The first flag given that only the paper's servo has.
std::optional<std::string> ftcs_flag(const PtpArguments& arguments) {
  if (arguments.offset_gain) return "--offset-gain";
  if (!arguments.correction_time.empty()) return "--correction-time";
  if (arguments.converged_dwell) return "--converged-dwell";
  if (!arguments.converged_band.empty()) return "--converged-band";
  return std::nullopt;
}

Wrong apply_servo(const PtpArguments& arguments, daemon::PtpOptions& options) {
  ServoConfig& servo = options.follower.servo;
  if (auto wrong = choose_servo(arguments.steering, servo)) return wrong;
  if (options.follower.free_running) servo.kind = ServoKind::kFreeRunning;
  options.follower.epoch = epoch_rules(arguments.epoch);
  // Debian's ptp4l.conf names it, and its user may never have chosen.
  if (arguments.steering.servo.empty() && servo.kind == ServoKind::kLinuxptpPi) {
    options.notes.emplace_back(
        "clock_servo pi: the servo is linuxptp-pi, with ptp4l's gains and steps; --servo adaptive "
        "needs no tuning and does not step");
  }
  if (const auto flag = ftcs_flag(arguments); flag && servo.kind != ServoKind::kFtcs) {
    return fmt::format("{} is of the servo ftcs, this one is {}: add --servo ftcs", *flag,
                       servo_kind_name(servo.kind));
  }
  if (arguments.offset_gain) servo.ftcs.offset_gain = *arguments.offset_gain;
  Duration correction_time{servo.ftcs.correction_time};
  if (auto wrong = set_duration(arguments.correction_time, "--correction-time", correction_time)) {
    return wrong;
  }
  servo.ftcs.correction_time = Nanoseconds{correction_time.rounded_ns()};
  if (arguments.converged_dwell) servo.ftcs.converged_dwell = *arguments.converged_dwell;
  if (!arguments.converged_band.empty()) {
    const auto band = parse_band(arguments.converged_band);
    if (!band) return "--converged-band: " + band.error().message;
    servo.ftcs.converged_band = *band;
  }
  if (auto wrong = apply_steering(arguments.steering, servo, options.follower.steering))
    return wrong;
  if (options.follower.steering.never_step) {
    if (options.follower.first_step) return "--never-step and --first-step exclude each other";
    options.follower.first_step_threshold = options.follower.step_threshold = Nanoseconds{0};
  }
  return check_steering(servo, options.follower.steering);
}

Wrong apply_clock(const PtpArguments& arguments, daemon::PtpOptions& options) {
  const std::string& clock = arguments.clock;
  if (clock == "virtual") {
    options.clock.kind = daemon::ClockKind::kVirtual;
  } else if (clock == "system") {
    options.clock.kind = daemon::ClockKind::kSystem;
  } else if (clock == "auto") {
    options.clock.kind = daemon::ClockKind::kAuto;
  } else if (clock == "phc" || clock.starts_with("/dev/")) {
    options.clock.kind = daemon::ClockKind::kPhc;
    if (clock != "phc") options.clock.device = clock;
  } else {
    return fmt::format("--clock: '{}': expected virtual, system, phc, /dev/ptpN or auto", clock);
  }
  if (options.clock.kind != daemon::ClockKind::kVirtual) {
    if (options.role == daemon::Role::kTimeTransmitter)
      return "a time transmitter steers no clock: --clock";
    if (!arguments.offset.empty()) return "--offset: only of the virtual clock";
    if (!arguments.skew.empty()) return "--skew: only of the virtual clock";
  }
  if (auto wrong = set_duration(arguments.offset, "--offset", options.clock.initial_offset))
    return wrong;
  if (!arguments.skew.empty()) {
    const auto ppb = parse_ppb(arguments.skew);
    if (!ppb) return "--skew: " + ppb.error().message;
    options.clock.skew_ppb = *ppb;
  }
  options.follower.first_step = arguments.first_step;
  return std::nullopt;
}

Wrong apply_peer(const PtpArguments& arguments, daemon::PtpOptions& options) {
  using platform::NetworkTransport;
  if (arguments.unicast.empty()) return std::nullopt;
  const NetworkTransport transport = options.socket.transport;
  options.socket.unicast = platform::parse_peer(transport, arguments.unicast);
  if (options.receiver.hybrid) return "--unicast and hybrid_e2e exclude each other";
  if (options.socket.unicast) return std::nullopt;
  const char* const kind = transport == NetworkTransport::kUdpIpv4   ? "an IPv4"
                           : transport == NetworkTransport::kUdpIpv6 ? "an IPv6"
                                                                     : "an Ethernet";
  return fmt::format("--unicast: '{}' is not {} address", arguments.unicast, kind);
}

Wrong apply_trust(const PtpArguments& arguments, daemon::PtpOptions& options) {
  // Who only receives time by multicast is asked nothing: messages to its own address come from
  // whoever can route a packet here.
  if (options.role == daemon::Role::kTimeReceiver) {
    options.socket.unicast_messages = options.receiver.hybrid
                                          ? platform::UnicastMessages::kDelayAnswers
                                          : platform::UnicastMessages::kNone;
  }
  for (const std::string& text : arguments.acceptable) {
    const auto identity = parse_clock_identity(text);
    if (!identity) {
      return fmt::format("--acceptable-transmitter: '{}': expected 001122.fffe.334455", text);
    }
    if (!options.receiver.acceptable.add(*identity))
      return "--acceptable-transmitter: more than 16 clocks";
  }
  if (arguments.no_fast_start) options.receiver.fast_start = false;
  return open_keys(options);
}

Wrong apply_network(const PtpArguments& arguments, daemon::PtpOptions& options) {
  if (arguments.interfaces.size() > 1) return "-i: only one port is supported";
  if (!arguments.interfaces.empty()) {
    if (!options.interface.empty() && options.interface != arguments.interfaces.front()) {
      return fmt::format(
          "-i {}: the configuration file has interface {}; only one port is supported",
          arguments.interfaces.front(), options.interface);
    }
    options.interface = arguments.interfaces.front();
  }
  if (arguments.source == "ptp4l") {
    options.source = daemon::Source::kPtp4l;
    if (!arguments.ptp4l_socket.empty()) options.monitor.management = arguments.ptp4l_socket;
    if (options.role == daemon::Role::kTimeTransmitter)
      return "--source: only a time receiver has one";
    return std::nullopt;  // the interface is ptp4l's to know
  }
  if (options.interface.empty()) return "no interface: give one with -i, for example -i eth0";
  options.socket.interface = options.interface;
  if (arguments.event_port) options.socket.event_port = *arguments.event_port;
  if (arguments.general_port) options.socket.general_port = *arguments.general_port;
  if (options.socket.event_port == options.socket.general_port) {
    return "--event-port and --general-port must differ";
  }
  return apply_peer(arguments, options);
}

Wrong apply_feed(const PtpArguments& arguments, daemon::PtpOptions& options) {
  options.feeds.time_page = arguments.time_page;
  if (!options.feeds.time_page.empty() && options.role == daemon::Role::kTimeTransmitter) {
    return "--time-page: a time transmitter follows nobody";
  }
  options.feeds.chrony_socket = arguments.chrony_socket;
  options.feeds.ntp_shm_unit = arguments.ntp_shm_unit;
  if (options.feeds.chrony_socket.empty() && !options.feeds.ntp_shm_unit) return std::nullopt;
  const char* const flag = options.feeds.ntp_shm_unit ? "--ntp-shm" : "--chrony-sock";
  if (options.role == daemon::Role::kTimeTransmitter) {
    return fmt::format("{}: a time transmitter follows nobody", flag);
  }
  if (options.clock.kind == daemon::ClockKind::kSystem ||
      options.clock.kind == daemon::ClockKind::kAuto) {
    return fmt::format(
        "{}: then two programs would steer the system clock; use --clock virtual or "
        "phc",
        flag);
  }
  return std::nullopt;
}

Wrong apply_role(const PtpArguments& arguments, daemon::PtpOptions& options) {
  if (arguments.role == "time-transmitter") {
    options.role = daemon::Role::kTimeTransmitter;
  } else if (arguments.role == "time-receiver" || arguments.receiver_only) {
    options.role = daemon::Role::kTimeReceiver;
  }
  if (arguments.receiver_only && options.role == daemon::Role::kTimeTransmitter) {
    return "-s asks for a time receiver, --role for a time transmitter";
  }
  for (const auto& [name, value] : arguments.settings) {
    const bool transmitter = (name == "masterOnly" || name == "serverOnly") && value == "1";
    if (arguments.receiver_only && transmitter) {
      return fmt::format("-s asks for a time receiver, --{} for a time transmitter", name);
    }
  }
  if (arguments.hardware) options.timestamps = platform::TimestampMode::kHardware;
  if (arguments.software) options.timestamps = platform::TimestampMode::kSoftware;
  options.watch = arguments.watch;
  if (options.watch.is_wanted() && options.role == daemon::Role::kTimeTransmitter) {
    return "--web and --metrics: a time transmitter follows nobody, there is nothing to show";
  }
  if (arguments.json) options.output = daemon::Output::kJson;
  if (arguments.csv) options.output = daemon::Output::kCsv;
  if (arguments.duration_s) options.duration = Duration::from_ns(*arguments.duration_s * 1e9);
  return std::nullopt;
}

}  // namespace

std::optional<std::string> open_keys(daemon::PtpOptions& options) {
  const daemon::SecurityOptions& wanted = options.protocol.authentication;
  if (!wanted.spp) {
    if (wanted.active_key_id != 0) return "active_key_id needs spp";
    return std::nullopt;  // as for ptp4l: a file that no port names
  }
  if (wanted.sa_file.empty()) return "spp needs sa_file";
  if (wanted.active_key_id == 0) return "spp needs active_key_id, 1 or more";
  if (options.protocol.minor_version == 0)
    return "spp needs ptp_minor_version 1: IEEE 1588-2008 has no such TLV";
  if (options.source == daemon::Source::kPtp4l)
    return "spp: with --source ptp4l it is ptp4l that authenticates";
  options.protocol.security = std::make_shared<daemon::Security>(wanted);
  return options.protocol.security->load();
}

std::optional<std::string> make_ptp_options(const PtpArguments& arguments,
                                            daemon::PtpOptions& options) {
  if (!arguments.preset.empty()) {
    if (auto wrong = apply_preset(options, arguments.preset)) return "--preset: " + *wrong;
  }
  if (!arguments.config_file.empty()) {
    if (auto wrong = read_config_file(arguments.config_file, options)) return wrong;
  }
  for (const auto& [name, value] : arguments.settings) {
    if (auto wrong = apply_setting(options, name, value)) return "--" + *wrong;
  }
  for (const auto step :
       {apply_role, apply_network, apply_trust, apply_clock, apply_feed, apply_servo}) {
    if (auto wrong = step(arguments, options)) return wrong;
  }
  return std::nullopt;
}

void add_ptp_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("ptp", "follow a PTP time transmitter, or be one (flags as ptp4l's)");
  const auto arguments = std::make_shared<PtpArguments>();
  add_ptp_arguments(*command, *arguments);
  add_watch_flags(*command, arguments->watch);
  command->callback([arguments, &exit_code] {
    daemon::PtpOptions options;
    if (const auto wrong = make_ptp_options(*arguments, options)) {
      fmt::print(stderr, "ftcs ptp: {}\n", *wrong);
      exit_code = kUsageError;
      return;
    }
    if (!options.management.is_required) {
      options.management.socket = platform::writable_socket_path(daemon::kSocketName);
    }
    if (const auto wrong =
            confine_to(daemon::rights_of(options), arguments->rights, &options.once_open)) {
      fmt::print(stderr, "ftcs ptp: {}\n", *wrong);
      exit_code = kRuntimeError;
      return;
    }
    platform::LinuxKernel kernel;
    exit_code = daemon::run_ptp(kernel, options);
  });
}

}  // namespace ftcs::app
