// SPDX-License-Identifier: MIT
#include <cerrno>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/config_file.h"
#include "apps/ftcs/ethercat/run_html.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/units.h"
#include "ftcs/daemon/ethercat/cycle_laws.h"
#include "ftcs/daemon/ethercat/main_runner.h"
#include "ftcs/daemon/ethercat/ptp_plant_source.h"
#include "ftcs/daemon/ethercat/run_report.h"
#include "ftcs/platform/stop_flag.h"
#include "ftcs/report/write_file.h"

namespace ftcs::app {

namespace {

struct EthercatArguments {
  daemon::RunOptions options;
  std::string udp;
  std::string servo = "ftcs";
  std::string cycle = "1ms";
  std::string sync_interval = "500ms";
  std::string shift = "0";
  std::string resolution = "1ns";
  std::string band = "5us";
  std::string transit = "0";
  std::string gate = "200us";
  std::string lock = "5us";
  std::string spin = "0";
  std::string lock_policy = "recovering";
  std::string bus_mode = "follow";
  std::string bus_write = "offset";
  std::string ptp_config;
  std::vector<double> gains;
  bool slew = false;
};

using Wrong = std::optional<std::string>;
constexpr std::string_view kPtp = "ptp";

Wrong read(const char* flag, const std::string& text, std::int64_t lowest, Nanoseconds& target) {
  const auto value = parse_duration(text);
  if (!value) return fmt::format("{}: {}", flag, value.error().message);
  if (value->floor_ns() < lowest) return fmt::format("{}: '{}' is too small", flag, text);
  target = Nanoseconds{value->rounded_ns()};
  return std::nullopt;
}

Wrong read_law(EthercatArguments& arguments) {
  CycleServoConfig& servo = arguments.options.servo;
  daemon::set_cycle_law(arguments.options, arguments.servo);
  if (arguments.gains.empty()) return std::nullopt;
  if (arguments.gains.size() != 2 || arguments.gains[0] < 0.0 || arguments.gains[1] < 0.0) {
    return "--gains: two numbers, as in 1,1";
  }
  servo.proportional_gain = arguments.gains[0];
  servo.integral_gain = arguments.gains[1];
  return std::nullopt;
}

node::LockPolicy policy_of(const std::string& name) {
  if (name == "advisory") return node::LockPolicy::kAdvisory;
  return name == "fatal" ? node::LockPolicy::kFatal : node::LockPolicy::kRecovering;
}

node::BusMode mode_of(const std::string& name) {
  if (name == "lead") return node::BusMode::kLead;
  return name == "external" ? node::BusMode::kExternal : node::BusMode::kFollow;
}

node::BusWrite write_of(const std::string& name) {
  if (name == "target-time") return node::BusWrite::kTargetTime;
  return name == "read-time" ? node::BusWrite::kReadTime : node::BusWrite::kOffset;
}

Wrong read_udp(EthercatArguments& arguments) {
  if (arguments.udp.empty()) return {};
  daemon::RunOptions& options = arguments.options;
  const std::size_t colon = arguments.udp.rfind(':');
  options.host = arguments.udp.substr(0, colon);
  if (colon == std::string::npos) return {};
  const auto port = parse_integer(arguments.udp.substr(colon + 1), 1, 65535);
  if (!port) return "--udp: " + port.error().message;
  options.port = static_cast<std::uint16_t>(*port);
  return {};
}

Wrong read_times(EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  CycleServoConfig& servo = options.servo;
  Nanoseconds interval{0};
  Nanoseconds band{0};
  Nanoseconds lock{0};
  constexpr std::int64_t kShortestCycle = 50'000;
  if (auto wrong = read("--cycle", arguments.cycle, kShortestCycle, servo.cycle)) return wrong;
  if (auto wrong = read("--sync-interval", arguments.sync_interval, 1, interval)) return wrong;
  if (auto wrong = read("--shift", arguments.shift, 0, servo.shift)) return wrong;
  if (auto wrong = read("--timer-resolution", arguments.resolution, 1, servo.resolution))
    return wrong;
  if (auto wrong = read("--converged-band", arguments.band, 0, band)) return wrong;
  if (auto wrong = read("--transit", arguments.transit, 0, servo.transit)) return wrong;
  if (auto wrong = read("--gate", arguments.gate, 0, servo.largest_lateness)) return wrong;
  if (auto wrong = read("--lock-band", arguments.lock, 1, lock)) return wrong;
  if (auto wrong = read("--spin", arguments.spin, 0, options.spin)) return wrong;
  servo.largest_round_trip = servo.largest_lateness;
  servo.band = {band, band};
  constexpr std::int64_t kLeaveOverEnter = 4;
  servo.lock.band = {lock, lock * kLeaveOverEnter};
  servo.cycles_per_sync =
      static_cast<std::uint32_t>(std::max<std::int64_t>(1, interval / servo.cycle));
  servo.align_at_start = !arguments.slew;
  return {};
}

Wrong complete(EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  if (auto wrong = read_udp(arguments)) return wrong;
  if (auto wrong = read_times(arguments)) return wrong;
  options.lock_policy = policy_of(arguments.lock_policy);
  options.bus_mode = mode_of(arguments.bus_mode);
  options.bus_write = write_of(arguments.bus_write);
  if (options.bus_mode != node::BusMode::kFollow && options.plant_time.empty()) {
    return fmt::format("--bus-mode {}: needs --plant-time, the clock that is to be followed",
                       arguments.bus_mode);
  }
  return read_law(arguments);
}

Result<platform::EthercatLink, platform::OsError> open_link(const daemon::RunOptions& options) {
  return options.interface.empty() ? platform::EthercatLink::connect_udp(options.host, options.port)
                                   : platform::EthercatLink::open_raw(options.interface);
}

/// One MainDevice a wire: what is held against a second one on this host.
std::string wire_of(const daemon::RunOptions& options) {
  return options.interface.empty() ? fmt::format("udp {}:{}", options.host, options.port)
                                   : options.interface;
}

int end_with(const std::string& message, int exit_code) {
  fmt::print(stderr, "ftcs ethercat: {}\n", message);
  return exit_code;
}

int end_with(const ethercat::Failure& failure, const daemon::RunOptions& options) {
  if (!failure)
    return end_with(
        "stopped by a signal before the first cycle; the SubDevices stay in the state they had "
        "reached",
        kNotLocked);
  if (failure.kind != ethercat::FailureKind::kNoReply) {
    return end_with(daemon::describe(failure), kRuntimeError);
  }
  const std::string where =
      options.interface.empty()
          ? fmt::format("from {}:{}: does ftcs ethercat-segment run there?", options.host,
                        options.port)
          : fmt::format("on interface {}: is a SubDevice with power connected to it?",
                        options.interface);
  return end_with(fmt::format("{} {}", daemon::describe(failure), where), kRuntimeError);
}

/// "ptp:eth1", or "ptp" where a configuration file has the interface.
Result<daemon::PlantClock, std::string> open_ptp(const EthercatArguments& arguments,
                                                 platform::Kernel& kernel) {
  daemon::PtpOptions options;
  if (!arguments.ptp_config.empty()) {
    if (auto wrong = read_config_file(arguments.ptp_config, options)) return std::move(*wrong);
  }
  const std::string& name = arguments.options.plant_time;
  if (name.size() > kPtp.size()) options.interface = name.substr(kPtp.size() + 1);
  if (options.interface.empty()) {
    return std::string("on which interface? As in ptp:eth1, or by --ptp-config");
  }
  auto source = daemon::PtpPlantSource::start(kernel, options);
  if (!source) return std::move(source.error());
  return daemon::PlantClock(kernel, name, std::move(*source));
}

Result<daemon::PlantClock, std::string> open_plant(const EthercatArguments& arguments,
                                                   platform::Kernel& kernel) {
  const std::string& name = arguments.options.plant_time;
  const bool ptp = name == kPtp || name.starts_with(std::string(kPtp) + ":");
  return ptp ? open_ptp(arguments, kernel) : daemon::PlantClock::open(name, kernel);
}

using Body = int (*)(daemon::MainRunner& runner, const std::function<bool()>& stop);

/// What scan and run begin with: flags checked, link open.
int with_runner(EthercatArguments arguments, Body body) {
  if (const auto wrong = complete(arguments)) return end_with(*wrong, kUsageError);
  platform::LinuxKernel kernel;
  const std::string wire = wire_of(arguments.options);
  const int held = kernel.hold_name(("ftcs ethercat " + wire).c_str());
  if (held == -EADDRINUSE) {
    return end_with(fmt::format("another ftcs ethercat uses {} already: stop it first", wire),
                    kRuntimeError);
  }
  const platform::Descriptor hold(kernel, held);
  auto link = open_link(arguments.options);
  if (!link) return end_with(link.error().message(), kRuntimeError);
  const platform::StopFlag stop_flag;
  const auto runner = std::make_unique<daemon::MainRunner>(arguments.options, std::move(*link));
  if (!arguments.options.plant_time.empty()) {
    auto plant = open_plant(arguments, kernel);
    if (!plant) return end_with("--plant-time: " + plant.error(), kRuntimeError);
    runner->set_plant_clock(std::move(*plant));
  }
  return body(*runner, [&stop_flag] { return stop_flag.is_set(); });
}

int run_scan(daemon::MainRunner& runner, const std::function<bool()>& stop) {
  if (!runner.bring_up(stop, true)) return end_with(runner.main().failure(), runner.options());
  daemon::print_scan(runner.main());
  return kSuccess;
}

void print_setup(const platform::RealtimeSetup& setup, const daemon::RunOptions& options) {
  const auto got = [](bool obtained) { return obtained ? "obtained" : "refused"; };
  fmt::print("SCHED_FIFO {} {}, mlockall {}, pinned to a processor {}, no sleep states {}\n",
             options.priority, options.priority > 0 ? got(setup.priority_set) : "not asked for",
             got(setup.memory_locked), options.cpu >= 0 ? got(setup.pinned) : "not asked for",
             got(setup.latency_held));
  if (options.spin > Nanoseconds{0}) {
    fmt::print("the last {} us before each cycle keep a processor busy\n",
               options.spin.count() / 1000);
  }
}

std::optional<WriteError> write_reports(const daemon::MainRunner& runner) {
  const daemon::RunOptions& options = runner.options();
  if (!options.json.empty()) {
    if (auto error = write_file(options.json, dump(daemon::run_json(runner)))) return error;
  }
  if (options.html.empty()) return std::nullopt;
  const daemon::MainRunner* const runs[] = {&runner};
  HtmlReport report("EtherCAT: a cycle that follows the distributed clock", options.servo_name);
  add_run_sections(report, runs);
  return write_file(options.html, report.render());
}

int run_main(daemon::MainRunner& runner, const std::function<bool()>& stop) {
  const daemon::RunOptions& options = runner.options();
  if (!can_write_results({options.json, options.html})) return kRuntimeError;
  if (const auto error = runner.open_csv()) return end_with(error->message, kRuntimeError);
  if (const auto unknown = runner.await_plant_time(stop)) return end_with(*unknown, kNotLocked);
  const auto setup = platform::make_realtime(options.priority, options.cpu);
  if (!options.quiet) print_setup(setup, options);
  if (!runner.bring_up(stop, false)) return end_with(runner.main().failure(), options);
  if (options.bus_mode != node::BusMode::kFollow && !runner.main().network().has_reference()) {
    return end_with("no drive with a distributed clock: there is nothing to put on plant time",
                    kRuntimeError);
  }
  runner.run(stop);
  if (!options.quiet) daemon::print_run(runner);
  // The figures are written even if a record is cut short, and whatever ended the run.
  const auto reports = write_reports(runner);
  const auto csv = runner.finish_csv();
  if (csv) end_with(csv->message + " (the run went on without it)", kRuntimeError);
  if (reports) end_with(reports->message, kRuntimeError);
  if (runner.main().failure()) return end_with(runner.main().failure(), options);
  if (csv || reports) return kRuntimeError;
  if (runner.decision().state != CycleState::kLocked) return kNotLocked;
  if (runner.main().last_cycle().all_operational()) return kSuccess;
  return end_with("not every drive was in OP at the end: the lines above and --json tell which",
                  kNotLocked);
}

void add_link_flags(CLI::App& command, EthercatArguments& arguments) {
  auto* interface = command.add_option("-i,--interface", arguments.options.interface,
                                       "raw Ethernet on this interface (needs CAP_NET_RAW)");
  command.add_option("--udp", arguments.udp, "HOST[:PORT] of a segment; default 127.0.0.1:34980")
      ->excludes(interface);
  command.add_option("--drives", arguments.options.drives, "fewer than these are an error");
  command.add_flag("--take-over", arguments.options.take_over,
                   "reset SubDevices even if another MainDevice has them in OP");
}

void add_servo_flags(CLI::App& command, EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  command.add_option("--servo", arguments.servo, "ftcs (default), pics, adaptive, soem-pi or none")
      ->check(CLI::IsMember(std::vector<std::string>(daemon::cycle_law_names().begin(),
                                                     daemon::cycle_law_names().end())));
  command.add_option("--cycle", arguments.cycle, "default 1ms");
  command.add_option("--sync-interval", arguments.sync_interval,
                     "ftcs and pics act once in this time; default 500ms");
  command.add_option("--offset-gain", options.servo.offset_gain, "ftcs: p inside the band")
      ->check(CLI::Range(0.0, 1.0));
  command.add_option("--converged-band", arguments.band, "ftcs: B; default 5us");
  command.add_option("--gains", arguments.gains, "pics: k_p,k_i times the cycles per interval")
      ->delimiter(',');
  command.add_option("--shift", arguments.shift, "frames leave so long after whole cycles");
  command
      .add_option("--sync0-phase", options.sync0_phase, "SYNC0 after the frame, part of a cycle")
      ->check(CLI::Range(0.0, 1.0));
  command.add_option("--timer-resolution", arguments.resolution, "10us is the paper's timer");
  command.add_option("--transit", arguments.transit, "from the transmit stamp to the reference");
  command.add_option("--gate", arguments.gate, "largest lateness and round trip; default 200us");
  command.add_option("--lock-band", arguments.lock,
                     "locked within this phase, lost beyond four times of it; default 5us");
  command.add_flag("--slew", arguments.slew, "the servo removes the first phase, no jump");
}

/// What drives bear before they are stopped, and what becomes of them.
void add_drive_flags(CLI::App& command, EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
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
      ->check(CLI::Range(0.1, 1e6));
  command
      .add_option("--lock-policy", arguments.lock_policy,
                  "what a lost lock does: advisory (told), recovering (default: stops the drives "
                  "after --unlocked-limit) or fatal (stops them at once)")
      ->check(CLI::IsMember({"advisory", "recovering", "fatal"}));
  command
      .add_option("--await-lock", options.await_lock_s,
                  "seconds that the drives wait in SAFEOP for the first lock; default 0, for ever")
      ->check(CLI::Range(0.0, 1e6));
  command
      .add_option(
          "--reset-faults", options.fault_resets,
          "so often the fault of a drive is reset; default 0: it stays until somebody looks")
      ->check(CLI::Range(0, 1'000'000));
  command
      .add_option("--ride-through", options.ride_through_s,
                  "seconds in which drives may be out of reach before the rest is stopped")
      ->check(CLI::Range(0.0, 1e6));
  command.add_flag("!--no-motion", options.move, "leave the axes disabled");
}

void add_bus_flags(CLI::App& command, EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  command
      .add_option("--bus-mode", arguments.bus_mode,
                  "follow (default: the cycle follows the drives; master shift), lead (the cycle "
                  "runs on plant time and the drives follow; bus shift) or external (the cycle "
                  "follows the drives, and they plant time; DCX)")
      ->check(CLI::IsMember({"follow", "lead", "external"}));
  command.add_option("--plant-time", options.plant_time,
                     "ptp:INTERFACE (a PTP receiver of this process), tai (CLOCK_TAI), realtime, "
                     "aux0 to aux7 (CLOCK_AUX), or a PTP hardware clock such as /dev/ptp0");
  command.add_option("--ptp-config", arguments.ptp_config,
                     "of --plant-time ptp: a configuration file as ptp4l's");
  command
      .add_option("--bus-write", arguments.bus_write,
                  "how the drives' clock is moved: offset (default: increments of 0x0920), or as "
                  "others do, to compare: target-time or read-time to 0x0910")
      ->check(CLI::IsMember({"offset", "target-time", "read-time"}));
  command
      .add_option("--bus-limit-ppm", options.bus_limit_ppm,
                  "largest rate of the drives' clock against its crystal; default 400")
      ->check(CLI::Range(1.0, 1000.0));
  command
      .add_option("--bus-slope-ppm-s", options.bus_slope_ppm_s,
                  "largest change of that rate in a second; default 100")
      ->check(CLI::Range(0.001, 10'000.0));
  command
      .add_option("--start-at", options.start_s,
                  "the circles begin at this second of plant time (since 2000-01-01)")
      ->check(CLI::Range(0.0, 1e11));
}

void add_run_flags(CLI::App& command, EthercatArguments& arguments) {
  daemon::RunOptions& options = arguments.options;
  add_servo_flags(command, arguments);
  command.add_option("--drift-pulses", options.drift_pulses,
                     "before the first cycle; default 15000");
  command.add_option("--spin", arguments.spin, "keep the processor busy so long before a cycle");
  command.add_option("--priority", options.priority, "SCHED_FIFO, 0 for none; default 80")
      ->check(CLI::Range(0, 99));
  command.add_option("--cpu", options.cpu, "pin to this processor");
  command.add_option("--duration", options.duration_s, "seconds of cycles; default 10, 0 for ever");
  add_drive_flags(command, arguments);
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
  CLI::App* scan = command->add_subcommand("scan", "what is on the wire");
  add_link_flags(*scan, *arguments);
  scan->callback([arguments, &exit_code] { exit_code = with_runner(*arguments, run_scan); });
  CLI::App* run = command->add_subcommand("run", "drives in OP, cycle in phase with their clock");
  add_link_flags(*run, *arguments);
  add_run_flags(*run, *arguments);
  add_bus_flags(*run, *arguments);
  run->callback([arguments, &exit_code] { exit_code = with_runner(*arguments, run_main); });
}

}  // namespace ftcs::app
