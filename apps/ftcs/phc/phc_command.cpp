// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/config_file.h"
#include "apps/ftcs/epoch_arguments.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/rights.h"
#include "apps/ftcs/steering_arguments.h"
#include "apps/ftcs/watch_arguments.h"
#include "ftcs/daemon/phc/phc_options.h"
#include "ftcs/daemon/phc/phc_runner.h"
#include "ftcs/daemon/rights.h"

namespace ftcs::app {
namespace {

using Wrong = std::optional<std::string>;

/// The command line as it was given.
struct PhcArguments {
  daemon::PhcOptions options;
  SteeringArguments steering;
  RightsArguments rights;
  EpochArguments epoch;
  std::string law;  ///< -E
  std::optional<double> proportional;
  std::optional<double> integral;
  std::optional<double> first_step_s;
  std::optional<double> step_s;
  std::optional<double> duration_s;
  bool leap_by_us = false;
  int system_clock = 0;  ///< how many -r
};

void refuse(CLI::App& command, const char* flag, const char* reason, bool takes_value) {
  const auto fail = [flag, reason] { throw CLI::ValidationError(flag, reason); };
  if (takes_value) {
    command
        .add_option_function<std::string>(
            flag, [fail](const std::string&) { fail(); }, reason)
        ->type_name("VALUE");
  } else {
    command.add_flag_callback(flag, fail, reason);
  }
}

/// What phc2sys reads of ptp4l's configuration file.
void read_file(const std::string& path, PhcArguments& arguments) {
  daemon::PtpOptions file;
  if (const auto wrong = read_config_file(path, file)) throw CLI::ValidationError("-f", *wrong);
  daemon::PhcOptions& options = arguments.options;
  options.port.domain = file.protocol.domain;
  options.port.major_sdo_id = file.protocol.major_sdo_id;
  if (file.management.is_required) options.port.socket = file.management.socket;
  options.first_step_threshold = file.follower.first_step_threshold;
  options.step_threshold = file.follower.step_threshold;
  options.log_level = file.log_level;
  arguments.leap_by_us = !file.clock.kernel_leap;
  options.steering = file.follower.steering;
  options.servo.kind = file.follower.servo.kind;
  options.servo.limits = file.follower.servo.limits;
  options.servo.adaptive.steering = file.follower.servo.adaptive.steering;
  const auto& pi = file.follower.servo.linuxptp_pi;
  auto& ours = options.servo.linuxptp_pi;
  if (pi.proportional_const > 0.0) ours.proportional_const = pi.proportional_const;
  if (pi.integral_const > 0.0) ours.integral_const = pi.integral_const;
}

void add_clock_flags(CLI::App& command, PhcArguments& arguments) {
  daemon::PhcOptions& options = arguments.options;
  // Before all others, which are read in this order: they win.
  command
      .add_option_function<std::string>(
          "-f", [&arguments](const std::string& path) { read_file(path, arguments); },
          "configuration file in ptp4l's format")
      ->type_name("FILE");
  command.add_option("-s", options.source, "source: /dev/ptpN, an interface or CLOCK_REALTIME")
      ->type_name("CLOCK");
  command.add_option("-c", options.sink, "what is steered, named likewise; default CLOCK_REALTIME")
      ->type_name("CLOCK");
  command.add_option("-O", options.sink_ahead_s, "steered clock minus source, in seconds")
      ->type_name("SECONDS")
      ->check(integer_from(-100'000, 100'000));
  command
      .add_option(
          "--leapfile", options.leap_file,
          "instead of -O: the source is TAI, the system clock UTC by this leap-seconds.list")
      ->type_name("FILE");
  command.add_flag("-x", arguments.leap_by_us,
                   "leap seconds by stepping the clock instead of by the kernel");
  command.add_flag("-a", options.automatic,
                   "follow the state of a PTP port of this machine; with -r");
  command.add_flag("-r", arguments.system_clock,
                   "-a: the system clock follows the port's clock while that receives time; twice: "
                   "and leads it while that transmits; with -w twice: a port that transmits will "
                   "do");
  command.add_flag("-w", options.wait_for_port,
                   "wait until the PTP port is synchronised, and take UTC from it");
  command
      .add_option("-z,--uds_address", options.port.socket,
                  "-a, -w: management socket of ptp4l or ftcs ptp; default /var/run/ptp4l")
      ->type_name("PATH");
  command.add_option("-n,--domainNumber", options.port.domain, "-a, -w: PTP domain; default 0")
      ->type_name("DOMAIN")
      ->check(integer_from(0, 255));
  command
      .add_option("--transportSpecific", options.port.major_sdo_id,
                  "-a, -w: majorSdoId, 0 to 15; default 0")
      ->type_name("VALUE")
      ->check(integer_from(0, 15));
  command.add_flag("--free-running", options.free_running, "compare, steer nothing");
}

void add_servo_flags(CLI::App& command, PhcArguments& arguments) {
  add_steering_flags(command, arguments.steering);
  add_epoch_flags(command, arguments.epoch);
  command.add_option("-E,--clock_servo", arguments.law, "pi: as --servo linuxptp-pi")
      ->type_name("NAME");
  command
      .add_option("-P,--pi_proportional_const", arguments.proportional,
                  "pi: proportional constant; default 0.7")
      ->type_name("KP")
      ->check(number_from(0.0, 1e6));
  command
      .add_option("-I,--pi_integral_const", arguments.integral,
                  "pi: integral constant; default 0.3")
      ->type_name("KI")
      ->check(number_from(0.0, 1e6));
  command
      .add_option("-F,--first_step_threshold", arguments.first_step_s,
                  "step at the start above this; default 0.00002, 0: never")
      ->type_name("SECONDS")
      ->check(number_from(0.0, 1e9));
  command
      .add_option("-S,--step_threshold", arguments.step_s,
                  "step at any time above this; default 0: never")
      ->type_name("SECONDS")
      ->check(number_from(0.0, 1e9));
}

void add_reading_flags(CLI::App& command, PhcArguments& arguments) {
  daemon::PhcOptions& options = arguments.options;
  command.add_option("-R", options.rate_hz, "comparisons a second; default 1")
      ->type_name("HZ")
      ->check(number_from(1e-3, 1e3));
  command
      .add_option("-N", options.readings, "readings a comparison, the quickest counts; default 5")
      ->type_name("N")
      ->check(integer_from(1, 25));
  command
      .add_option("-u", options.samples_per_summary,
                  "comparisons in a summary line; default 0: each")
      ->type_name("N")
      ->check(integer_from(0, 1'000'000));
  command.add_option("-l,--logging_level", options.log_level, "log level, 0 to 7; default 6")
      ->type_name("LEVEL")
      ->check(integer_from(0, 7));
  command.add_option("--duration", arguments.duration_s, "stop after so many seconds")
      ->type_name("SECONDS")
      ->check(number_from(0.001, 1e9));
  command.add_flag_callback(
      "-m", [] {}, "accepted: messages always go to standard output");
  command.add_flag_callback(
      "-q", [] {}, "accepted: messages never go to the system log");
  command
      .add_option_function<std::string>(
          "-L,--sanity_freq_limit", [](const std::string&) {},
          "accepted: the clock is always watched for others' steering")
      ->type_name("PPB")
      ->check(number_from(0.0, 1e9));
}

void refuse_the_rest(CLI::App& command) {
  refuse(command, "-d", "a PPS source is not supported", true);
  refuse(command, "-t", "a message tag is not supported", true);
  refuse(command, "-M", "an NTP SHM segment is not supported", true);
}

Wrong apply_servo(const PhcArguments& arguments, daemon::PhcOptions& options) {
  ServoConfig& servo = options.servo;
  if (!arguments.law.empty()) {
    if (arguments.law != "pi") {
      return fmt::format("-E: '{}' is not supported, only pi (--servo knows more)", arguments.law);
    }
    servo.kind = ServoKind::kLinuxptpPi;
  }
  if (!arguments.steering.servo.empty() && !arguments.law.empty()) {
    return "-E and --servo exclude each other";
  }
  if (auto wrong = choose_servo(arguments.steering, servo)) return wrong;
  if ((arguments.proportional || arguments.integral) && servo.kind != ServoKind::kLinuxptpPi) {
    return "-P and -I are of the pi servo: -E pi";
  }
  if (arguments.proportional) servo.linuxptp_pi.proportional_const = *arguments.proportional;
  if (arguments.integral) servo.linuxptp_pi.integral_const = *arguments.integral;
  if (options.free_running) servo.kind = ServoKind::kFreeRunning;
  if (auto wrong = apply_steering(arguments.steering, servo, options.steering)) return wrong;
  return check_steering(servo, options.steering);
}

Wrong apply_steps(const PhcArguments& arguments, daemon::PhcOptions& options) {
  const auto nanoseconds = [](double seconds) {
    return Nanoseconds{Duration::from_ns(seconds * 1e9).rounded_ns()};
  };
  if (arguments.first_step_s) options.first_step_threshold = nanoseconds(*arguments.first_step_s);
  if (arguments.step_s) options.step_threshold = nanoseconds(*arguments.step_s);
  if (!options.steering.never_step) return std::nullopt;
  if (arguments.first_step_s.value_or(0.0) > 0.0 || arguments.step_s.value_or(0.0) > 0.0) {
    return "--never-step excludes -F and -S";
  }
  options.first_step_threshold = options.step_threshold = Nanoseconds{0};
  return std::nullopt;
}

Wrong apply_offset(daemon::PhcOptions& options) {
  const bool from_system = options.source == "CLOCK_REALTIME";
  const bool to_system = options.sink == "CLOCK_REALTIME";
  if (options.automatic || options.wait_for_port) return std::nullopt;  // the port knows
  if (options.sink_ahead_s) {
    if (!options.leap_file.empty()) return "-O and --leapfile exclude each other";
    return std::nullopt;
  }
  if (!from_system && !to_system) {
    options.sink_ahead_s = 0;  // two hardware clocks keep the same timescale
  } else if (options.leap_file.empty()) {
    return "the time offset must be given: -O SECONDS (steered clock minus source), --leapfile "
           "FILE, or -w to take it from ptp4l or ftcs ptp";
  } else if (!to_system) {
    return "--leapfile: only where CLOCK_REALTIME is steered; give -O";
  }
  return std::nullopt;
}

/// -a -r and what does not go with it.
Wrong check_automatic(const PhcArguments& arguments, const daemon::PhcOptions& options) {
  if (!options.automatic) {
    const bool for_wait = options.wait_for_port && arguments.system_clock > 1;
    return arguments.system_clock > 0 && !for_wait ? Wrong("-r is of -a, and -r -r of -w")
                                                   : std::nullopt;
  }
  if (!arguments.rights.user.empty()) return "--user: not with -a, which opens clocks as it goes";
  if (arguments.system_clock == 0) return "-a needs -r: the system clock is what can follow";
  if (options.wait_for_port) return "-a and -w exclude each other";
  if (options.sink_ahead_s) return "-a and -O exclude each other";
  if (!options.source.empty() || options.sink != "CLOCK_REALTIME") {
    return "-a finds the clocks itself: without -s and -c";
  }
  return std::nullopt;
}

Wrong complete(const PhcArguments& arguments, daemon::PhcOptions& options) {
  if (auto wrong = check_automatic(arguments, options)) return wrong;
  if (options.source.empty() && !options.automatic)
    return "no source: give one with -s, for example -s eth0";
  options.system_may_lead = arguments.system_clock > 1;
  if (arguments.duration_s) options.duration = Duration::from_ns(*arguments.duration_s * 1e9);
  options.kernel_leap = !arguments.leap_by_us;
  options.epoch = epoch_rules(arguments.epoch);
  if (auto wrong = apply_offset(options)) return wrong;
  if (auto wrong = apply_servo(arguments, options)) return wrong;
  return apply_steps(arguments, options);
}

}  // namespace

void add_phc_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("phc", "a clock of this machine follows another one (flags as phc2sys's)");
  command->set_help_flag("-h,--help", "print this help and exit");
  command->set_version_flag("-v,--version", "ftcs " FTCS_VERSION, "print the version and exit");
  const auto arguments = std::make_shared<PhcArguments>();
  add_clock_flags(*command, *arguments);
  add_servo_flags(*command, *arguments);
  add_reading_flags(*command, *arguments);
  add_rights_flags(*command, arguments->rights, true);
  add_watch_flags(*command, arguments->options.watch);
  refuse_the_rest(*command);
  command->callback([arguments, &exit_code] {
    daemon::PhcOptions options = arguments->options;
    if (const auto wrong = complete(*arguments, options)) {
      fmt::print(stderr, "ftcs phc: {}\n", *wrong);
      exit_code = kUsageError;
      return;
    }
    if (const auto wrong =
            confine_to(daemon::rights_of(options), arguments->rights, &options.once_open)) {
      fmt::print(stderr, "ftcs phc: {}\n", *wrong);
      exit_code = kRuntimeError;
      return;
    }
    platform::LinuxKernel kernel;
    daemon::Log log(kernel, stdout, options.log_level);
    exit_code = daemon::run_phc(kernel, options, log);
  });
}

}  // namespace ftcs::app
