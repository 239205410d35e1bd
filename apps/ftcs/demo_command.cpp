// SPDX-License-Identifier: MIT
#include <unistd.h>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/output.h"
#include "ftcs/fieldbus/demo_report.h"
#include "ftcs/fieldbus/ptp_demo.h"
#include "ftcs/record/quantity_text.h"

namespace ftcs::app {
namespace {

using daemon::DemoOptions;
using daemon::DemoResult;

/// Where the figures go; empty: nowhere.
struct DemoFiles {
  std::string json;
  std::string html;
};

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
  const int refused = check_results({{"--json", files.json}, {"--html", files.html}});
  if (refused != kSuccess) return refused;
  platform::LinuxKernel kernel;
  DemoResult result;
  if (demo.ptp) {
    if (const int code = daemon::run_ptp_demo(kernel, demo, result); code != kSuccess) return code;
  }
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
