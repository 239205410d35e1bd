// SPDX-License-Identifier: MIT
#include "apps/ftcs/ptp_arguments.h"

#include <fmt/core.h>

#include "apps/ftcs/number_check.h"
#include "apps/ftcs/ptp_fixed_settings.h"
#include "apps/ftcs/ptp_option_table.h"
#include "apps/ftcs/ptp_presets.h"

namespace ftcs::app {
namespace {

/// One line an option.
class Flags {
 public:
  explicit Flags(CLI::App& command) : command_(command) {}

  template <class Target>
  CLI::Option* value(const char* flag, Target& target, const char* type, const std::string& help) {
    return command_.add_option(flag, target, help)->type_name(type);
  }
  CLI::Option* given(const char* flag, bool& target, const char* help) {
    return command_.add_flag(flag, target, help);
  }
  /// As --NAME VALUE for a setting of ptp4l's configuration file; later ones win.
  void setting(const char* flag, const char* name, PtpArguments& arguments, const char* type,
               const char* help) {
    command_
        .add_option_function<std::string>(
            flag,
            [&arguments, name](const std::string& value) {
              arguments.settings.emplace_back(name, value);
            },
            help)
        ->type_name(type);
  }
  /// A flag that stands for one value of a setting.
  void shorthand(const char* flag, const char* name, const char* value, PtpArguments& arguments,
                 const char* help) {
    command_.add_flag_callback(
        flag, [&arguments, name, value] { arguments.settings.emplace_back(name, value); }, help);
  }
  void accept(const char* flag, const char* help) {
    command_.add_flag_callback(
        flag, [] {}, help);
  }
  void refuse(const char* flag, const char* reason) {
    command_.add_flag_callback(
        flag, [flag, reason] { throw CLI::ValidationError(flag, reason); }, reason);
  }

 private:
  CLI::App& command_;
};

void add_ptp4l_flags(CLI::App& command, PtpArguments& arguments) {
  command.set_help_flag("-h,--help", "print this help and exit");
  command.set_version_flag("-v,--version", "ftcs " FTCS_VERSION, "print the version and exit");
  Flags flags(command);
  flags.value("-i", arguments.interfaces, "NAME", "network interface, for example eth0")
      ->allow_extra_args(false);
  flags.value("-f", arguments.config_file, "FILE", "configuration file in ptp4l's format");
  flags.given("-s", arguments.receiver_only, "time receiver only (the default role)");
  flags.setting("-l", "logging_level", arguments, "LEVEL", "log level, 0 to 7; default 6");
  flags.accept("-m", "accepted: messages always go to standard output");
  flags.accept("-q", "accepted: messages never go to the system log");
  flags.shorthand("-E", "delay_mechanism", "E2E", arguments, "end-to-end delay (default)");
  flags.shorthand("-P", "delay_mechanism", "P2P", arguments, "peer-to-peer delay");
  flags.shorthand("-A", "delay_mechanism", "E2E", arguments, "accepted as -E");
  flags.shorthand("-2", "network_transport", "L2", arguments, "IEEE 802.3, without IP");
  flags.shorthand("-4", "network_transport", "UDPv4", arguments, "UDP over IPv4 (default)");
  flags.shorthand("-6", "network_transport", "UDPv6", arguments, "UDP over IPv6");
  auto* hardware = flags.given("-H", arguments.hardware, "hardware time stamping or an error");
  auto* software = flags.given("-S", arguments.software, "software time stamping or an error");
  hardware->excludes(software);
  flags.refuse("-L", "legacy time stamping is not supported");
  flags.value("-p", arguments.clock, "DEVICE", "PTP hardware clock to steer, as --clock DEVICE");
}

void add_servo_flags(CLI::App& command, PtpArguments& arguments) {
  add_steering_flags(command, arguments.steering);
  add_epoch_flags(command, arguments.epoch);
  Flags flags(command);
  flags.value("--offset-gain", arguments.offset_gain, "P",
              "ftcs: p inside the band, 0 to 1; default 1/16");
  flags.value("--converged-band", arguments.converged_band, "BAND",
              "ftcs: B, as ENTER[:LEAVE], for example 1us:5us");
  flags
      .value("--converged-dwell", arguments.converged_dwell, "N",
             "ftcs: samples inside the band before p applies; default 4")
      ->check(integer_from(0, 1'000'000'000));
  flags.value("--correction-time", arguments.correction_time, "TIME",
              "ftcs: T_c, in which an offset is removed; default: the Sync interval");
}

void add_clock_flags(CLI::App& command, PtpArguments& arguments) {
  Flags flags(command);
  flags.value("--clock", arguments.clock, "NAME",
              "what is steered: virtual (default), system, phc, /dev/ptpN, auto");
  flags.value("--offset", arguments.offset, "TIME",
              "the virtual clock starts at CLOCK_REALTIME plus this, for example 1ms");
  flags.value("--skew", arguments.skew, "RATE",
              "rate error of the virtual clock's oscillator, for example 50ppm");
  flags.given("--first-step", arguments.first_step, "allow one step at the start");
}

void add_run_flags(CLI::App& command, PtpArguments& arguments) {
  command.add_option("--role", arguments.role, "time-receiver (default) or time-transmitter")
      ->check(CLI::IsMember({"time-receiver", "time-transmitter"}));
  command
      .add_option("--source", arguments.source,
                  "of timestamps: network (default), or ptp4l, a free-running one on this machine")
      ->check(CLI::IsMember({"network", "ptp4l"}));
  Flags flags(command);
  flags.value("--ptp4l-socket", arguments.ptp4l_socket, "PATH",
              "with --source ptp4l: its uds_address; default /var/run/ptp4l");
  flags.value("--time-page", arguments.time_page, "PATH",
              "for programs with ftcs_now.h: the time, and between which instants it surely is");
  flags.value("--chrony-sock", arguments.chrony_socket, "PATH",
              "samples for chronyd: the path of its refclock SOCK");
  flags
      .value("--ntp-shm", arguments.ntp_shm_unit, "UNIT",
             "samples for ntpd, chronyd or gpsd through NTP's shared memory")
      ->check(integer_from(0, 255));
  auto* json = flags.given("--json", arguments.json, "one JSON object a sample");
  flags.given("--csv", arguments.csv, "one CSV line a sample")->excludes(json);
  flags.value("--duration", arguments.duration_s, "SECONDS", "stop after so many seconds")
      ->check(number_from(0.001, 1e9));
}

void add_network_flags(CLI::App& command, PtpArguments& arguments) {
  Flags flags(command);
  flags.value("--event-port", arguments.event_port, "PORT", "UDP port; default 319")
      ->check(integer_from(1, 65'535));
  flags.value("--general-port", arguments.general_port, "PORT", "UDP port; default 320")
      ->check(integer_from(1, 65'535));
  flags.value("--unicast", arguments.unicast, "ADDRESS",
              "the only peer: an IPv4, IPv6 or Ethernet address");
  flags.setting("--max-path-delay", "max_path_delay", arguments, "NS",
                "a message whose path delay is longer steers nothing; 0: any");
  flags.value("--preset", arguments.preset, "NAME",
              preset_names() + ": settings that belong together");
  flags
      .value("--acceptable-transmitter", arguments.acceptable, "ID",
             "follow only these clocks, for example 001b21.fffe.a1b2c3; up to 16")
      ->allow_extra_args(false)
      ->delimiter(',');
  flags.given("--no-fast-start", arguments.no_fast_start,
              "wait for a second Announce before measuring, as IEEE 1588 has it");
}

}  // namespace

void add_ptp_arguments(CLI::App& command, PtpArguments& arguments) {
  add_ptp4l_flags(command, arguments);
  add_servo_flags(command, arguments);
  add_clock_flags(command, arguments);
  add_run_flags(command, arguments);
  add_network_flags(command, arguments);
  add_rights_flags(command, arguments.rights, true);
  const auto add_setting = [&](const std::string& name, const std::string& help) {
    return command
        .add_option_function<std::string>(
            "--" + name,
            [&arguments, name](const std::string& value) {
              arguments.settings.emplace_back(name, value);
            },
            help)
        ->type_name("VALUE");
  };
  for (const PtpSetting& setting : ptp_settings()) {
    add_setting(setting.name, setting.help)->group("Settings of ptp4l's configuration file");
  }
  // As in a file: accepted with the value that describes what happens anyway. Not in the help.
  for (const std::string& name : fixed_setting_names()) add_setting(name, "")->group("");
}

}  // namespace ftcs::app
