// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/config_file.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/ptp_arguments.h"
#include "apps/ftcs/rights.h"
#include "apps/ftcs/watch_arguments.h"
#include "ftcs/daemon/exit_code.h"
#include "ftcs/fieldbus/cycle_laws.h"
#include "ftcs/fieldbus/ethercat_run.h"
#include "ftcs/fieldbus/rights.h"
#include "ftcs/fieldbus/run_status.h"
#include "ftcs/record/quantity_text.h"

namespace ftcs::app {
namespace {

struct EthercatArguments {
  daemon::RunOptions options;
  RightsArguments rights;
  std::string servo = "ftcs";
  Nanoseconds sync_interval{500'000'000};
  Nanoseconds band{5'000};
  Nanoseconds gate{200'000};
  Nanoseconds lock{5'000};
  std::optional<double> lock_percent;  ///< of the cycle, in the place of `lock`
  std::vector<double> gains;
  bool slew = false;
};

/// A duration with its unit, of so many nanoseconds at least.
CLI::Option* add_time(CLI::App& command, const char* flag, Nanoseconds& target, std::int64_t lowest,
                      const char* help,
                      std::int64_t highest = std::numeric_limits<std::int64_t>::max()) {
  const auto read = [flag, &target, lowest, highest](const std::string& text) {
    const auto value = parse_duration(text);
    if (!value) throw CLI::ValidationError(flag, value.error().message);
    if (value->floor_ns() < lowest) {
      throw CLI::ValidationError(flag, fmt::format("'{}' is too small", text));
    }
    if (value->floor_ns() > highest) {
      throw CLI::ValidationError(
          flag, fmt::format("'{}' is too large: at most {} ms", text, highest / 1'000'000));
    }
    target = Nanoseconds{value->rounded_ns()};
  };
  return command.add_option_function<std::string>(flag, read, help);
}

template <class Value>
CLI::Option* add_choice(CLI::App& command, const char* flag, Value& target,
                        const std::map<std::string, Value>& choices, const char* help) {
  std::vector<std::string> names;
  names.reserve(choices.size());
  for (const auto& [name, value] : choices) names.push_back(name);
  const auto read = [&target, choices](const std::string& text) { target = choices.at(text); };
  return command.add_option_function<std::string>(flag, read, help)->check(CLI::IsMember(names));
}

void read_udp(const std::string& text, daemon::RunOptions& options) {
  const std::size_t colon = text.find_last_of(':');
  options.host = text.substr(0, colon);
  if (colon == std::string::npos) return;
  const auto port = parse_integer(text.substr(colon + 1), 1, 65535);
  if (!port) throw CLI::ValidationError("--udp", port.error().message);
  options.port = static_cast<std::uint16_t>(*port);
}

/// "2=100us": the SYNC0 of drive 2 comes so much later; "2=1:250us": its SYNC1 once in so many
/// cycles, so long behind SYNC0.
void read_drive_sync(const char* flag, const std::string& text, bool sync1,
                     daemon::RunOptions& options) {
  const auto wrong = [flag, &text, sync1] {
    return CLI::ValidationError(
        flag, fmt::format("'{}': expected DRIVE={}, as in {}", text,
                          sync1 ? "CYCLES:SHIFT" : "SHIFT", sync1 ? "2=1:250us" : "2=100us"));
  };
  const std::size_t equals = text.find('=');
  const std::size_t colon = sync1 ? text.find(':') : equals;
  if (equals == std::string::npos || colon == std::string::npos || colon < equals) throw wrong();
  const auto drive = parse_integer(text.substr(0, equals), 0, ethercat::kMaxSubDevices - 1);
  const auto shift = parse_duration(text.substr(colon + 1));
  if (!drive || !shift) throw wrong();
  ethercat::DriveSync& sync = options.drive_sync[static_cast<std::size_t>(*drive)];
  (sync1 ? sync.sync1_shift : sync.sync0_shift) = Nanoseconds{shift->rounded_ns()};
  if (!sync1) return;
  const auto cycles = parse_integer(text.substr(equals + 1, colon - equals - 1), 1, 1000);
  if (!cycles) throw wrong();
  sync.sync1_cycles = static_cast<std::uint16_t>(*cycles);
}

/// "bridge" or "bridge:POSITION": plant time is not a clock of this host.
std::optional<std::string> read_bridge(daemon::RunOptions& options) {
  constexpr std::string_view kName = "bridge";
  const std::string_view source = options.plant_time;
  if (!source.starts_with(kName)) return std::nullopt;
  options.bridge = ethercat::bridge::kFirst;
  if (source.size() > kName.size()) {
    const std::string position{source.substr(kName.size() + 1)};
    const auto number = parse_integer(position, 0, ethercat::kMaxSubDevices - 1);
    if (source[kName.size()] != ':' || !number) {
      return fmt::format("--plant-time: '{}' is not bridge or bridge:POSITION, as in bridge:4",
                         source);
    }
    options.bridge = static_cast<std::size_t>(*number);
  }
  if (options.bus_write == node::BusWrite::kOffset) return std::nullopt;
  return "--bus-write: target-time and read-time write a clock of this host, which a bridge "
         "terminal is not";
}

/// "5us", or "20%" of the cycle, which is known at the end alone.
void read_in_sync_limit(const std::string& text, EthercatArguments& arguments) {
  const auto wrong = [&text] {
    return CLI::ValidationError(
        "--in-sync-limit",
        fmt::format("'{}' is neither a time above zero, as 5us, nor a part of the cycle of at most "
                    "25%, as 20%",
                    text));
  };
  if (text.ends_with('%')) {
    const auto percent = parse_number(text.substr(0, text.size() - 1), 1e-3, 25.0);
    if (!percent) throw wrong();
    arguments.lock_percent = *percent;
    return;
  }
  const auto time = parse_duration(text);
  if (!time || time->floor_ns() < 1) throw wrong();
  arguments.lock = Nanoseconds{time->rounded_ns()};
  arguments.lock_percent.reset();
}

/// What hangs on several flags.
std::optional<std::string> complete(EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  CycleServoConfig& servo = options.servo;
  servo.largest_lateness = servo.largest_round_trip = arguments.gate;
  servo.band = {arguments.band, arguments.band};
  constexpr std::int64_t kLeaveOverEnter = 4;
  if (arguments.lock_percent) {
    const double part = *arguments.lock_percent / 100.0;
    arguments.lock = Nanoseconds{std::llround(part * static_cast<double>(servo.cycle.count()))};
  }
  // A phase is at most half a cycle.
  const Nanoseconds leave =
      std::max(arguments.lock, std::min(arguments.lock * kLeaveOverEnter, servo.cycle * 9 / 20));
  servo.lock.band = {arguments.lock, leave};
  servo.cycles_per_sync =
      static_cast<std::uint32_t>(std::max<std::int64_t>(1, arguments.sync_interval / servo.cycle));
  servo.align_at_start = !arguments.slew;
  daemon::set_cycle_law(options, arguments.servo);
  if (options.bus_mode != node::BusMode::kFollow && options.plant_time.empty()) {
    return "--bus-mode: lead and external need --plant-time, the clock that is to be followed";
  }
  if (auto wrong = read_bridge(options)) return wrong;
  if (auto wrong = open_keys(options.ptp)) return "--ptp-config: " + *wrong;
  if (auto wrong = daemon::check_run(options)) return wrong;
  if (arguments.gains.empty()) return std::nullopt;
  if (arguments.gains.size() != 2 || !(arguments.gains[0] >= 0.0 && arguments.gains[1] >= 0.0)) {
    return "--gains: two numbers, as in 1,1";
  }
  servo.proportional_gain = arguments.gains[0];
  servo.integral_gain = arguments.gains[1];
  return std::nullopt;
}

using Run = int (*)(platform::Kernel& kernel, const daemon::RunOptions& options);

int with_options(EthercatArguments arguments, Run run) {
  if (const auto wrong = complete(arguments)) {
    fmt::print(stderr, "ftcs ethercat: {}\n", *wrong);
    return kUsageError;
  }
  const daemon::RunOptions& files = arguments.options;
  const int refused =
      check_results({{"--json", files.json}, {"--csv", files.csv}, {"--html", files.html}});
  if (refused != kSuccess) return refused;
  std::string& socket = arguments.options.status_socket;
  arguments.options.status_socket_given = !socket.empty();
  if (socket.empty()) socket = platform::writable_socket_path(daemon::kEthercatSocketName);
  if (const auto wrong = confine_to(daemon::rights_of(arguments.options), arguments.rights)) {
    fmt::print(stderr, "ftcs ethercat: {}\n", *wrong);
    return kRuntimeError;
  }
  platform::LinuxKernel kernel;
  return run(kernel, arguments.options);
}

void add_link_flags(CLI::App& command, daemon::RunOptions& options) {
  auto* interface = command.add_option("-i,--interface", options.interface,
                                       "raw Ethernet on this interface (needs CAP_NET_RAW)");
  command
      .add_option_function<std::string>(
          "--udp", [&options](const std::string& text) { read_udp(text, options); },
          "HOST[:PORT] of a segment; default 127.0.0.1:34980")
      ->excludes(interface);
  command.add_option("--drives", options.drives, "fewer than these are an error");
  command.add_flag("--take-over", options.take_over,
                   "reset SubDevices even if another MainDevice has them in OP");
}

void add_servo_flags(CLI::App& command, EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  CycleServoConfig& servo = options.servo;
  constexpr std::int64_t kShortestCycle = 50'000;
  constexpr std::int64_t kLongestCycle = 1'000'000'000;  // a drive's watchdog waits no longer
  command.add_option("--servo", arguments.servo, "ftcs (default), pics, adaptive, soem-pi or none")
      ->check(CLI::IsMember(std::vector<std::string>(daemon::cycle_law_names().begin(),
                                                     daemon::cycle_law_names().end())));
  add_time(command, "--cycle", servo.cycle, kShortestCycle, "default 1ms", kLongestCycle);
  add_time(command, "--sync-interval", arguments.sync_interval, 1,
           "ftcs and pics act once in this time; default 500ms");
  command.add_option("--offset-gain", servo.offset_gain, "ftcs: p inside the band")
      ->check(number_from(0.0, 1.0));
  add_time(command, "--converged-band", arguments.band, 0, "ftcs: B; default 5us");
  command.add_option("--gains", arguments.gains, "pics: k_p,k_i times the cycles per interval")
      ->delimiter(',');
  add_time(command, "--shift", servo.shift, 0, "frames leave so long after whole cycles");
  command
      .add_option("--sync0-phase", options.sync0_phase, "SYNC0 after the frame, part of a cycle")
      ->check(number_from(0.0, 1.0));
  add_time(command, "--timer-resolution", servo.resolution, 1, "10us is the paper's timer");
  add_time(command, "--transit", servo.transit, 0, "from the transmit stamp to the reference");
  add_time(command, "--gate", arguments.gate, 0, "largest lateness and round trip; default 200us");
  command.add_option_function<std::string>(
      "--in-sync-limit,--lock-band",
      [&arguments](const std::string& text) { read_in_sync_limit(text, arguments); },
      "locked within this phase, lost beyond four times of it: a time, as 5us (default), or a part "
      "of the cycle, as 20%");
  command.add_flag("--slew", arguments.slew, "the servo removes the first phase, no jump");
}

/// What drives bear before they are stopped, and what becomes of them.
void add_drive_flags(CLI::App& command, daemon::RunOptions& options) {
  command
      .add_option("--sync-error-limit", options.sync_error_limit,
                  "0x10F1:02 of the drives: a missed SYNC0 window counts 3; default 17, 0 never")
      ->check(CLI::Range(0, 0xFFFF));
  command
      .add_option("--lost-frame-limit", options.lost_frame_limit,
                  "so many frames in a row without an answer stop the drives; default 10")
      ->check(CLI::Range(1, 1'000'000));
  command
      .add_option("--unlocked-limit", options.unlocked_limit_s,
                  "seconds without the lock, once it was there, that stop the drives; default 10")
      ->check(number_from(0.1, 1e6));
  add_choice(command, "--lock-policy", options.lock_policy,
             {{"advisory", node::LockPolicy::kAdvisory},
              {"recovering", node::LockPolicy::kRecovering},
              {"fatal", node::LockPolicy::kFatal}},
             "what a lost lock does: advisory (told), recovering (default: stops the drives after "
             "--unlocked-limit) or fatal (stops them at once)");
  command
      .add_option("--await-lock", options.await_lock_s,
                  "seconds that the drives wait in SAFEOP for the first lock; default 0, for ever")
      ->check(number_from(0.0, 1e6));
  command
      .add_option(
          "--reset-faults", options.fault_resets,
          "so often the fault of a drive is reset; default 0: it stays until somebody looks")
      ->check(CLI::Range(0, 1'000'000));
  command
      .add_option("--ride-through", options.ride_through_s,
                  "seconds in which drives may be out of reach before the rest is stopped")
      ->check(number_from(0.0, 1e6));
  command.add_flag("!--no-motion", options.move, "leave the axes disabled");
}

/// SYNC signals of single drives, and how far their clocks may be off.
void add_sync_flags(CLI::App& command, daemon::RunOptions& options) {
  for (const bool sync1 : {false, true}) {
    const char* const flag = sync1 ? "--sync1" : "--sync0-shift";
    command.add_option_function<std::vector<std::string>>(
        flag,
        [flag, sync1, &options](const std::vector<std::string>& texts) {
          for (const std::string& text : texts) read_drive_sync(flag, text, sync1, options);
        },
        sync1 ? "DRIVE=CYCLES:SHIFT: SYNC1 of one drive; may be repeated"
              : "DRIVE=SHIFT: SYNC0 of one drive so much later than the others'; may be repeated");
  }
  add_time(command, "--difference-limit", options.difference_limit, 0,
           "|0x092C| above which the clock of a drive counts as off; default 1us, 0 never");
}

void add_plant_time_flags(CLI::App& command, daemon::RunOptions& options) {
  command.add_option("--plant-time", options.plant_time,
                     "ptp:INTERFACE (a PTP receiver of this process), tai (CLOCK_TAI), realtime, "
                     "aux0 to aux7 (CLOCK_AUX), a PTP hardware clock such as /dev/ptp0, or "
                     "bridge[:POSITION] (the time stamps of a bridge terminal on the wire)");
  command.add_option_function<std::string>(
      "--ptp-config",
      [&options](const std::string& file) {
        if (auto wrong = read_config_file(file, options.ptp)) {
          throw CLI::ValidationError("--ptp-config", *wrong);
        }
      },
      "of --plant-time ptp: a configuration file as ptp4l's");
  command
      .add_option("--start-at", options.start_s,
                  "the circles begin at this second of plant time (since 2000-01-01)")
      ->check(number_from(0.0, 1e11));
}

void add_bus_flags(CLI::App& command, daemon::RunOptions& options) {
  add_choice(command, "--bus-mode", options.bus_mode,
             {{"follow", node::BusMode::kFollow},
              {"lead", node::BusMode::kLead},
              {"external", node::BusMode::kExternal}},
             "follow (default: the cycle follows the drives; master shift), lead (the cycle runs "
             "on plant time and the drives follow; bus shift) or external (the cycle follows the "
             "drives, and they plant time; DCX)");
  add_choice(command, "--bus-write", options.bus_write,
             {{"offset", node::BusWrite::kOffset},
              {"target-time", node::BusWrite::kTargetTime},
              {"read-time", node::BusWrite::kReadTime}},
             "how the drives' clock is moved: offset (default: increments of 0x0920), or as "
             "others do, to compare: target-time or read-time to 0x0910");
  command
      .add_option("--bus-limit-ppm", options.bus_limit_ppm,
                  "largest rate of the drives' clock against its crystal; default 400")
      ->check(number_from(1.0, 1000.0));
  command
      .add_option("--bus-slope-ppm-s", options.bus_slope_ppm_s,
                  "largest change of that rate in a second; default 100")
      ->check(number_from(0.001, 10'000.0));
}

void add_run_flags(CLI::App& command, daemon::RunOptions& options) {
  command.add_option("--drift-pulses", options.drift_pulses,
                     "before the first cycle; default 15000");
  add_time(command, "--spin", options.spin, 0, "keep the processor busy so long before a cycle");
  command.add_option("--priority", options.priority, "SCHED_FIFO, 0 for none; default 80")
      ->check(CLI::Range(0, 99));
  command.add_option("--cpu", options.cpu, "pin to this processor");
  command.add_option("--duration", options.duration_s, "seconds of cycles; default 10, 0 for ever")
      ->check(number_from(0.0, 1e9));
  command.add_option("--uds_address", options.status_socket,
                     "where ftcs status asks; default /var/run/ftcs-ethercat or "
                     "$XDG_RUNTIME_DIR/ftcs-ethercat");
  command.add_flag("-q,--quiet", options.quiet, "no live lines");
  command.add_option("--json", options.json, "write the figures to this file");
  command.add_option("--csv", options.csv, "write each cycle to this file");
  command.add_option("--html", options.html, "write a report with plots to this file");
}

}  // namespace

void add_ethercat_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("ethercat", "EtherCAT MainDevice with a cycle servo");
  command->require_subcommand(1);
  const auto arguments = std::make_shared<EthercatArguments>();
  daemon::RunOptions& options = arguments->options;
  CLI::App* scan = command->add_subcommand("scan", "what is on the wire");
  add_link_flags(*scan, options);
  add_rights_flags(*scan, arguments->rights, false);
  scan->callback(
      [arguments, &exit_code] { exit_code = with_options(*arguments, daemon::scan_ethercat); });
  CLI::App* run = command->add_subcommand("run", "drives in OP, cycle in phase with their clock");
  add_link_flags(*run, options);
  add_rights_flags(*run, arguments->rights, false);
  add_servo_flags(*run, *arguments);
  add_run_flags(*run, options);
  add_drive_flags(*run, options);
  add_sync_flags(*run, options);
  add_plant_time_flags(*run, options);
  add_bus_flags(*run, options);
  add_watch_flags(*run, options.watch);
  run->callback(
      [arguments, &exit_code] { exit_code = with_options(*arguments, daemon::run_ethercat); });
}

}  // namespace ftcs::app
