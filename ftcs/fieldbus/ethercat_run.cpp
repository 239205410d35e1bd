// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/ethercat_run.h"

#include <cerrno>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/fieldbus/main_runner.h"
#include "ftcs/fieldbus/ptp_plant_source.h"
#include "ftcs/fieldbus/run_html.h"
#include "ftcs/fieldbus/run_report.h"
#include "ftcs/platform/stop_flag.h"
#include "ftcs/report/write_file.h"

namespace ftcs::daemon {

namespace {

Result<platform::EthercatLink, platform::OsError> open_link(platform::Kernel& kernel,
                                                            const RunOptions& options) {
  return options.interface.empty()
             ? platform::EthercatLink::connect_udp(kernel, options.host, options.port)
             : platform::EthercatLink::open_raw(kernel, options.interface);
}

/// One MainDevice a wire: what is held against a second one on this host.
std::string wire_of(const RunOptions& options) {
  return options.interface.empty() ? fmt::format("udp {}:{}", options.host, options.port)
                                   : options.interface;
}

int end_with(const std::string& message, int exit_code) {
  fmt::print(stderr, "ftcs ethercat: {}\n", message);
  return exit_code;
}

int end_with(const ethercat::Failure& failure, const RunOptions& options) {
  if (!failure)
    return end_with(
        "stopped by a signal before the first cycle; the SubDevices stay in the state they had "
        "reached",
        kNotLocked);
  if (failure.kind != ethercat::FailureKind::kNoReply) {
    return end_with(describe(failure), kRuntimeError);
  }
  const std::string where =
      options.interface.empty()
          ? fmt::format("from {}:{}: does ftcs ethercat-segment run there?", options.host,
                        options.port)
          : fmt::format("on interface {}: is a SubDevice with power connected to it?",
                        options.interface);
  return end_with(fmt::format("{} {}", describe(failure), where), kRuntimeError);
}

using Body = int (*)(MainRunner& runner, const std::function<bool()>& stop);

/// What scan and run begin with: the wire held, the link open.
int with_runner(platform::Kernel& kernel, const RunOptions& options, Body body) {
  const std::string wire = wire_of(options);
  const int held = kernel.hold_name(("ftcs ethercat " + wire).c_str());
  // Whoever holds it: two that move one drive are worse than none.
  if (held == -EADDRINUSE || held == -EPERM) {
    return end_with(fmt::format("another ftcs ethercat uses {} already: stop it first", wire),
                    kRuntimeError);
  }
  const platform::Descriptor hold(kernel, held);
  auto link = open_link(kernel, options);
  if (!link) return end_with(link.error().message(), kRuntimeError);
  const platform::StopFlag stop_flag;
  const auto runner = std::make_unique<MainRunner>(options, std::move(*link));
  if (!options.plant_time.empty() && !options.bridge) {
    auto plant = open_plant_clock(options.plant_time, options.ptp, kernel);
    if (!plant) return end_with("--plant-time: " + plant.error(), kRuntimeError);
    runner->set_plant_clock(std::move(*plant));
  }
  return body(*runner, [&stop_flag] { return stop_flag.is_set(); });
}

int run_scan(MainRunner& runner, const std::function<bool()>& stop) {
  if (!runner.bring_up(stop, true)) return end_with(runner.main().failure(), runner.options());
  print_scan(runner.main());
  return kSuccess;
}

void say_setup(MainRunner& runner, const platform::RealtimeSetup& setup) {
  const RunOptions& options = runner.options();
  const auto got = [](bool obtained) { return obtained ? "obtained" : "refused"; };
  runner.say(fmt::format(
      "SCHED_FIFO {} {}, mlockall {}, pinned to a processor {}, no sleep states {}\n",
      options.priority, options.priority > 0 ? got(setup.priority_set) : "not asked for",
      got(setup.memory_locked), options.cpu >= 0 ? got(setup.pinned) : "not asked for",
      got(setup.latency_held)));
  if (options.spin > Nanoseconds{0}) {
    runner.say(fmt::format("the last {} us before each cycle keep a processor busy\n",
                           options.spin.count() / 1000));
  }
}

std::optional<WriteError> write_reports(const MainRunner& runner) {
  const RunOptions& options = runner.options();
  if (!options.json.empty()) {
    if (auto error = write_file(options.json, run_json_text(runner))) return error;
  }
  if (options.html.empty()) return std::nullopt;
  const MainRunner* const runs[] = {&runner};
  HtmlReport report("EtherCAT: a cycle that follows the distributed clock", options.servo_name);
  add_run_sections(report, runs);
  return write_file(options.html, report.render());
}

/// What is asked of a drive that is not there would be done to none.
std::optional<std::string> drive_that_is_not_there(const RunOptions& options, std::size_t count) {
  for (std::size_t n = count; n < options.drive_sync.size(); ++n) {
    if (options.drive_sync[n] == ethercat::DriveSync{}) continue;
    return fmt::format("--sync0-shift or --sync1 of drive {}: there are drives 0 to {} only", n,
                       count - 1);
  }
  return std::nullopt;
}

/// Null: nobody can ask. Another run, on another wire, may have the usual place.
Result<std::unique_ptr<RunStatus>, std::string> open_status(MainRunner& runner) {
  const RunOptions& options = runner.options();
  if (options.status_socket.empty()) return std::unique_ptr<RunStatus>{};
  auto status = RunStatus::open(options);
  if (status) return std::move(*status);
  if (options.status_socket_given) return status.error().message();
  if (!options.quiet) runner.say(fmt::format("no status socket: {}\n", status.error().message()));
  return std::unique_ptr<RunStatus>{};
}

/// The figures for a person; those of --json do not hang on whether anybody reads these. False: the
/// disk is full, or the like.
bool try_print_run(const MainRunner& runner) {
  int number = 0;
  try {
    print_run(runner);
    if (std::fflush(stdout) != 0) number = errno;
  } catch (const std::system_error& error) {
    number = error.code().value();
  }
  if (number == 0) return true;
  std::clearerr(stdout);  // said here
  if (number == EPIPE) return true;
  end_with(fmt::format("cannot write to standard output: {}", platform::write_failure(number)),
           kRuntimeError);
  return false;
}

/// Figures, records and what the run came to.
int end_run(MainRunner& runner) {
  const bool printed = runner.options().quiet || try_print_run(runner);
  // The figures are written even if a record is cut short, and whatever ended the run.
  const auto reports = write_reports(runner);
  const auto csv = runner.finish_csv();
  if (csv) end_with(csv->message + " (the run went on without it)", kRuntimeError);
  if (reports) end_with(reports->message, kRuntimeError);
  if (runner.main().failure()) return end_with(runner.main().failure(), runner.options());
  if (csv || reports || !printed) return kRuntimeError;
  const int code = exit_code_of(runner.seen());
  return code == kSuccess ? code : end_with(std::string(runner.sentence()), code);
}

int run_main(MainRunner& runner, const std::function<bool()>& stop) {
  const RunOptions& options = runner.options();
  if (const auto error = runner.open_csv()) return end_with(error->message, kRuntimeError);
  if (const auto unknown = runner.await_plant_time(stop)) return end_with(*unknown, kNotLocked);
  const auto status = open_status(runner);
  if (!status) return end_with(status.error(), kRuntimeError);
  if (*status) runner.tell(**status);
  if (const auto wrong = runner.open_watch()) return end_with(*wrong, kRuntimeError);
  if (options.watch.is_wanted()) runner.say(runner.watched_at() + "\n");
  const auto setup = platform::make_realtime(options.priority, options.cpu);
  if (!options.quiet) say_setup(runner, setup);
  if (!runner.bring_up(stop, false)) {
    // What cannot be put on plant time says so itself, in one sentence.
    const bool diagnosed = runner.main().failure() && options.plant_time.empty();
    if (diagnosed) end_with(std::string(runner.sentence()), kRuntimeError);
    return end_with(runner.main().failure(), options);
  }
  if (const auto wrong = drive_that_is_not_there(options, runner.main().network().count)) {
    return end_with(*wrong, kRuntimeError);
  }
  runner.run(stop);
  return end_run(runner);
}

}  // namespace

std::optional<std::string> check_drive_sync(const RunOptions& options) {
  const Nanoseconds cycle = options.servo.cycle;
  for (std::size_t n = 0; n < options.drive_sync.size(); ++n) {
    const ethercat::DriveSync& sync = options.drive_sync[n];
    if (sync.sync0_shift <= -cycle || sync.sync0_shift >= cycle) {
      return fmt::format("--sync0-shift: drive {}: {} ns is a cycle or more", n,
                         sync.sync0_shift.count());
    }
    if (sync.sync1_shift < Nanoseconds{0} || sync.sync1_shift >= cycle) {
      return fmt::format("--sync1: drive {}: {} ns is not from zero to below a cycle", n,
                         sync.sync1_shift.count());
    }
    if (sync.sync1_register(cycle) > std::numeric_limits<std::uint32_t>::max()) {
      return fmt::format("--sync1: drive {}: {} cycles are longer than the 4.29 s of a register", n,
                         sync.sync1_cycles);
    }
  }
  return std::nullopt;
}

std::optional<std::string> check_run(const RunOptions& options) {
  if (auto wrong = check_drive_sync(options)) return wrong;
  const node::CycleNodeConfig config = node_config(options, false);
  if (const auto wrong = validate(config.supervision)) {
    return fmt::format("--unlocked-limit: {}", describe(*wrong));
  }
  if (const auto wrong = validate(node::CycleNode::bus_config(config))) {
    return fmt::format("--plant-time: {}", describe(*wrong));
  }
  return std::nullopt;
}

int exit_code_of(const diagnosis::CycleSeen& seen) noexcept {
  if (seen.failure != ethercat::FailureKind::kNone) return kRuntimeError;
  return diagnosis::cause_of(seen) == diagnosis::Cause::kLocked ? kSuccess : kNotLocked;
}

int scan_ethercat(platform::Kernel& kernel, const RunOptions& options) {
  return with_runner(kernel, options, run_scan);
}

int run_ethercat(platform::Kernel& kernel, const RunOptions& options) {
  return with_runner(kernel, options, run_main);
}

}  // namespace ftcs::daemon
