// SPDX-License-Identifier: MIT
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/config_file.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/ptp_option_table.h"
#include "apps/ftcs/ptp_port.h"
#include "apps/ftcs/units.h"
#include "ftcs/platform/network_interface.h"

namespace ftcs::app {
namespace {

using Wrong = std::optional<std::string>;

/// The command line as it was given: a configuration file is read first, the command line wins.
struct PtpArguments {
  std::vector<std::string> interfaces;
  std::string config_file;
  std::vector<std::pair<std::string, std::string>> settings;  ///< ptp4l's names
  bool receiver_only = false;
  bool hardware = false;
  bool software = false;
  std::string role;
  std::string servo;
  std::optional<double> offset_gain;
  std::string converged_band;
  std::optional<std::uint32_t> converged_dwell;
  std::string correction_time;
  std::string max_frequency;
  std::string clock = "virtual";
  std::string offset;
  std::string skew;
  bool first_step = false;
  bool json = false;
  bool csv = false;
  std::optional<std::uint16_t> event_port;
  std::optional<std::uint16_t> general_port;
  std::string unicast;
  std::optional<double> duration_s;
};

Wrong set_duration(const std::string& text, const char* flag, Duration& target) {
  if (text.empty()) return std::nullopt;
  const auto value = parse_duration(text);
  if (!value) return fmt::format("{}: {}", flag, value.error().message);
  target = *value;
  return std::nullopt;
}

std::string servo_names() {
  std::string names;
  for (const ServoKindName& known : kServoKinds) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", known.name);
  }
  return names;
}

Wrong apply_servo(const PtpArguments& arguments, PtpOptions& options) {
  ServoConfig& servo = options.servo;
  if (!arguments.servo.empty()) {
    const auto kind = servo_kind_from_name(arguments.servo);
    if (!kind) {
      return fmt::format("--servo: unknown servo '{}' (known: {})", arguments.servo, servo_names());
    }
    servo.kind = *kind;
  }
  if (options.free_running) servo.kind = ServoKind::kFreeRunning;
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
  if (!arguments.max_frequency.empty()) {
    const auto ppb = parse_ppb(arguments.max_frequency);
    if (!ppb) return "--max-frequency: " + ppb.error().message;
    if (*ppb <= 0.0) return "--max-frequency: must be greater than zero";
    servo.limits = RateLimits::symmetric_ppb(*ppb);
  }
  if (const auto error = validate(servo)) return std::string(describe(*error));
  return std::nullopt;
}

Wrong apply_clock(const PtpArguments& arguments, PtpOptions& options) {
  if (arguments.clock != "virtual") {
    return fmt::format("--clock: '{}' is not supported, only virtual", arguments.clock);
  }
  if (auto wrong = set_duration(arguments.offset, "--offset", options.initial_offset)) return wrong;
  if (!arguments.skew.empty()) {
    const auto ppb = parse_ppb(arguments.skew);
    if (!ppb) return "--skew: " + ppb.error().message;
    options.skew_ppb = *ppb;
  }
  options.first_step = arguments.first_step;
  return std::nullopt;
}

Wrong apply_network(const PtpArguments& arguments, PtpOptions& options) {
  if (arguments.interfaces.size() > 1) return "-i: only one port is supported";
  if (!arguments.interfaces.empty()) {
    if (!options.interface.empty() && options.interface != arguments.interfaces.front()) {
      return fmt::format(
          "-i {}: the configuration file has interface {}; only one port is supported",
          arguments.interfaces.front(), options.interface);
    }
    options.interface = arguments.interfaces.front();
  }
  if (options.interface.empty()) return "no interface: give one with -i, for example -i eth0";
  options.socket.interface = options.interface;
  if (arguments.event_port) options.socket.event_port = *arguments.event_port;
  if (arguments.general_port) options.socket.general_port = *arguments.general_port;
  if (options.socket.event_port == options.socket.general_port) {
    return "--event-port and --general-port must differ";
  }
  if (!arguments.unicast.empty()) {
    options.socket.unicast = platform::parse_ipv4(arguments.unicast);
    if (!options.socket.unicast) {
      return fmt::format("--unicast: '{}' is not an IPv4 address", arguments.unicast);
    }
  }
  return std::nullopt;
}

Wrong apply_role(const PtpArguments& arguments, PtpOptions& options) {
  if (arguments.role == "time-transmitter") {
    options.role = Role::kTimeTransmitter;
  } else if (arguments.role == "time-receiver" || arguments.receiver_only) {
    options.role = Role::kTimeReceiver;
  }
  if (arguments.receiver_only && options.role == Role::kTimeTransmitter) {
    return "-s asks for a time receiver, --role for a time transmitter";
  }
  if (arguments.hardware) options.timestamps = platform::TimestampMode::kHardware;
  if (arguments.software) options.timestamps = platform::TimestampMode::kSoftware;
  if (arguments.json) options.output = Output::kJson;
  if (arguments.csv) options.output = Output::kCsv;
  if (arguments.duration_s) options.duration = Duration::from_ns(*arguments.duration_s * 1e9);
  return std::nullopt;
}

Wrong make_options(const PtpArguments& arguments, PtpOptions& options) {
  if (!arguments.config_file.empty()) {
    if (auto wrong = read_config_file(arguments.config_file, options)) return wrong;
  }
  for (const auto& [name, value] : arguments.settings) {
    if (auto wrong = apply_setting(options, name, value)) return "--" + *wrong;
  }
  for (const auto step : {apply_role, apply_network, apply_clock, apply_servo}) {
    if (auto wrong = step(arguments, options)) return wrong;
  }
  return std::nullopt;
}

void refuse(CLI::App& command, const char* flag, const char* reason) {
  command.add_flag_callback(
      flag, [flag, reason] { throw CLI::ValidationError(flag, reason); }, reason);
}

void add_ptp4l_flags(CLI::App& command, PtpArguments& arguments) {
  command.set_help_flag("-h,--help", "print this help and exit");
  command.set_version_flag("-v,--version", "ftcs " FTCS_VERSION, "print the version and exit");
  command.add_option("-i", arguments.interfaces, "network interface, for example eth0")
      ->type_name("NAME");
  command.add_option("-f", arguments.config_file, "configuration file in ptp4l's format")
      ->type_name("FILE");
  command.add_flag("-s", arguments.receiver_only, "time receiver only (the default role)");
  command
      .add_option_function<std::string>(
          "-l",
          [&arguments](const std::string& level) {
            arguments.settings.emplace_back("logging_level", level);
          },
          "log level, 0 to 7; default 6")
      ->type_name("LEVEL");
  command.add_flag_callback(
      "-m", [] {}, "accepted: messages always go to standard output");
  command.add_flag_callback(
      "-q", [] {}, "accepted: messages never go to the system log");
  command.add_flag_callback(
      "-E", [] {}, "end-to-end delay (the only one)");
  command.add_flag_callback(
      "-A", [] {}, "accepted as -E");
  command.add_flag_callback(
      "-4", [] {}, "UDP over IPv4 (the only transport)");
  auto* hardware = command.add_flag("-H", arguments.hardware, "hardware time stamping or an error");
  auto* software = command.add_flag("-S", arguments.software, "software time stamping or an error");
  hardware->excludes(software);
  refuse(command, "-P", "the peer delay mechanism is not supported");
  refuse(command, "-2", "transport over IEEE 802.3 is not supported");
  refuse(command, "-6", "transport over UDP/IPv6 is not supported");
  refuse(command, "-L", "legacy time stamping is not supported");
  command
      .add_option_function<std::string>(
          "-p",
          [](const std::string&) {
            throw CLI::ValidationError("-p", "steering a hardware clock is not supported");
          },
          "not supported: the steered clock is virtual")
      ->type_name("DEVICE");
}

void add_own_flags(CLI::App& command, PtpArguments& arguments) {
  command.add_option("--role", arguments.role, "time-receiver (default) or time-transmitter")
      ->check(CLI::IsMember({"time-receiver", "time-transmitter"}));
  command.add_option("--servo", arguments.servo, servo_names() + "; default ftcs")
      ->type_name("NAME");
  command
      .add_option("--offset-gain", arguments.offset_gain,
                  "ftcs: p inside the band, 0 to 1; default 1/16")
      ->type_name("P");
  command
      .add_option("--converged-band", arguments.converged_band,
                  "ftcs: B, as ENTER[:LEAVE], for example 1us:5us")
      ->type_name("BAND");
  command
      .add_option("--converged-dwell", arguments.converged_dwell,
                  "ftcs: samples inside the band before p applies; default 4")
      ->type_name("N")
      ->check(integer_from(0, 1'000'000'000));
  command
      .add_option("--correction-time", arguments.correction_time,
                  "ftcs: T_c, in which an offset is removed; default: the Sync interval")
      ->type_name("TIME");
  command
      .add_option("--max-frequency", arguments.max_frequency,
                  "largest adjustment, for example 500ppm")
      ->type_name("RATE");
  command.add_option("--clock", arguments.clock, "virtual (the only one)")->type_name("NAME");
  command
      .add_option("--offset", arguments.offset,
                  "the virtual clock starts at CLOCK_REALTIME plus this, for example 1ms")
      ->type_name("TIME");
  command
      .add_option("--skew", arguments.skew,
                  "rate error of the virtual clock's oscillator, for example 50ppm")
      ->type_name("RATE");
  command.add_flag("--first-step", arguments.first_step, "allow one step at the start");
  auto* json = command.add_flag("--json", arguments.json, "one JSON object a sample");
  command.add_flag("--csv", arguments.csv, "one CSV line a sample")->excludes(json);
  command.add_option("--event-port", arguments.event_port, "UDP port; default 319")
      ->type_name("PORT")
      ->check(integer_from(1, 65'535));
  command.add_option("--general-port", arguments.general_port, "UDP port; default 320")
      ->type_name("PORT")
      ->check(integer_from(1, 65'535));
  command.add_option("--unicast", arguments.unicast, "IPv4 address of the only peer")
      ->type_name("ADDRESS");
  command.add_option("--duration", arguments.duration_s, "stop after so many seconds")
      ->type_name("SECONDS")
      ->check(number_from(0.001, 1e9));
}

}  // namespace

void add_ptp_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("ptp", "follow a PTP time transmitter, or be one (flags as ptp4l's)");
  const auto arguments = std::make_shared<PtpArguments>();
  add_ptp4l_flags(*command, *arguments);
  add_own_flags(*command, *arguments);
  for (const PtpSetting& setting : ptp_settings()) {
    const std::string name = setting.name;
    command
        ->add_option_function<std::string>(
            "--" + name,
            [arguments, name](const std::string& value) {
              arguments->settings.emplace_back(name, value);
            },
            setting.help)
        ->type_name("VALUE")
        ->group("Settings of ptp4l's configuration file");
  }
  command->callback([arguments, &exit_code] {
    PtpOptions options;
    if (const auto wrong = make_options(*arguments, options)) {
      fmt::print(stderr, "ftcs ptp: {}\n", *wrong);
      exit_code = kUsageError;
      return;
    }
    platform::LinuxKernel kernel;
    exit_code = run_ptp(kernel, options);
  });
}

}  // namespace ftcs::app
