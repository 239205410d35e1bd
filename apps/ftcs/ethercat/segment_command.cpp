// SPDX-License-Identifier: MIT
#include <memory>
#include <sstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/number_check.h"
#include "apps/ftcs/output.h"
#include "apps/ftcs/rights.h"
#include "ftcs/fieldbus/rights.h"
#include "ftcs/fieldbus/segment_server.h"
#include "ftcs/platform/stop_flag.h"
#include "ftcs/record/quantity_text.h"

namespace ftcs::app {

namespace {

struct SegmentArguments {
  daemon::SegmentOptions options;
  RightsArguments rights;
  std::string udp;
  std::string topology = "line";
  std::string cable;
  std::string hop;
  std::vector<std::string> faults;
  int priority = 0;
  int cpu = -1;
};

/// "KIND:DRIVE@SECONDS" or "skew:DRIVE@SECONDS=PPM".
std::optional<std::string> parse_fault(const std::string& text, daemon::SegmentFault& fault) {
  const auto wrong = [&text] {
    return fmt::format(
        "--fault: '{}' is not cut, mend, restart or skew, as in cut:3@2.5 or "
        "skew:0@4=100",
        text);
  };
  const std::size_t colon = text.find(':');
  const std::size_t at = text.find('@');
  if (colon == std::string::npos || at == std::string::npos || at < colon) return wrong();
  const std::string kind = text.substr(0, colon);
  const std::size_t equals = text.find('=', at);
  const auto device = parse_integer(text.substr(colon + 1, at - colon - 1), 0, 63);
  const std::size_t end = equals == std::string::npos ? text.size() : equals;
  const auto seconds = parse_number(text.substr(at + 1, end - at - 1), 0.0, 1e9);
  if (!device || !seconds) return wrong();
  fault.device = static_cast<std::size_t>(*device);
  fault.at_s = *seconds;
  if (kind == "skew" && equals != std::string::npos) {
    const auto ppm = parse_number(text.substr(equals + 1), -1e5, 1e5);
    if (!ppm) return wrong();
    fault.kind = daemon::SegmentFault::Kind::kSkew;
    fault.ppm = *ppm;
    return std::nullopt;
  }
  if (equals != std::string::npos) return wrong();
  if (kind == "cut") {
    fault.kind = daemon::SegmentFault::Kind::kCut;
  } else if (kind == "mend") {
    fault.kind = daemon::SegmentFault::Kind::kMend;
  } else if (kind == "restart") {
    fault.kind = daemon::SegmentFault::Kind::kRestart;
  } else {
    return wrong();
  }
  return std::nullopt;
}

std::optional<std::string> complete(SegmentArguments& arguments) {
  daemon::SegmentOptions& options = arguments.options;
  options.tree = arguments.topology == "tree";
  if (!arguments.udp.empty()) {
    const std::size_t colon = arguments.udp.rfind(':');
    const std::string port =
        colon == std::string::npos ? arguments.udp : arguments.udp.substr(colon + 1);
    if (colon != std::string::npos) options.address = arguments.udp.substr(0, colon);
    const auto number = parse_integer(port, 1, 65535);
    if (!number) return "--udp: " + number.error().message;
    options.port = static_cast<std::uint16_t>(*number);
  }
  for (const auto& [text, target] :
       {std::pair{&arguments.cable, &options.cable}, std::pair{&arguments.hop, &options.hop}}) {
    if (text->empty()) continue;
    const auto value = parse_duration(*text);
    if (!value || *value < Duration{}) return fmt::format("'{}' is no delay, as in 50ns", *text);
    *target = Nanoseconds{value->floor_ns()};
  }
  if (options.bridge && *options.bridge >= options.drives) {
    return fmt::format("--bridge: {}: there are SubDevices 0 to {} only", *options.bridge,
                       options.drives - 1);
  }
  if (options.bridge && options.clock_bits != 64) {
    return "--bridge: a bridge terminal needs --clock-bits 64";
  }
  for (const std::string& text : arguments.faults) {
    daemon::SegmentFault fault;
    if (auto wrong = parse_fault(text, fault)) return wrong;
    options.faults.push_back(fault);
  }
  return std::nullopt;
}

int run_segment(SegmentArguments arguments) {
  if (const auto wrong = complete(arguments)) {
    fmt::print(stderr, "ftcs ethercat-segment: {}\n", *wrong);
    return kUsageError;
  }
  const daemon::SegmentOptions& options = arguments.options;
  const int refused = check_results({{"--json", options.json}, {"--clock-csv", options.clock_csv}});
  if (refused != kSuccess) return refused;
  platform::LinuxKernel kernel;
  auto link = options.interface.empty()
                  ? platform::EthercatLink::listen_udp(kernel, options.address, options.port)
                  : platform::EthercatLink::open_raw(kernel, options.interface);
  if (!link) {
    fmt::print(stderr, "ftcs ethercat-segment: {}\n", link.error().message());
    return kRuntimeError;
  }
  if (arguments.priority > 0) {
    static_cast<void>(platform::make_realtime(arguments.priority, arguments.cpu));
  }
  const auto rights = daemon::rights_of_segment(
      !options.interface.empty(), !options.json.empty() || !options.clock_csv.empty());
  if (const auto wrong = confine_to(rights, arguments.rights)) {
    fmt::print(stderr, "ftcs ethercat-segment: {}\n", *wrong);
    return kRuntimeError;
  }
  daemon::SegmentServer server(kernel, options, std::move(*link));
  fmt::print("{} drives in a {} on {}\n", options.drives, arguments.topology,
             options.interface.empty() ? fmt::format("UDP {}:{}", options.address, options.port)
                                       : options.interface);
  std::fflush(stdout);
  const platform::StopFlag stop;
  server.run([&stop] { return stop.is_set(); });
  const bool recorded = server.finish_records();
  const bool written = options.json.empty() || write_result(options.json, server.json());
  server.print_summary();
  return recorded && written ? kSuccess : kRuntimeError;
}

}  // namespace

void add_ethercat_segment_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "ethercat-segment", "a software EtherCAT segment of CiA 402 drives with distributed clocks");
  const auto arguments = std::make_shared<SegmentArguments>();
  daemon::SegmentOptions& options = arguments->options;
  auto* interface = command->add_option("-i,--interface", options.interface,
                                        "raw Ethernet on this interface (needs CAP_NET_RAW)");
  command->add_option("--udp", arguments->udp, "[ADDRESS:]PORT; default 127.0.0.1:34980")
      ->excludes(interface);
  command->add_option("--drives", options.drives, "how many")->check(CLI::Range(1, 64));
  command->add_option("--ppm", options.ppm, "crystal of each drive; the last two take turns")
      ->delimiter(',')
      ->check(number_from(-1e5, 1e5));
  command
      ->add_option("--random-walk-ppb", options.random_walk_ppb,
                   "random walk of the crystals, ppb per square root of a second")
      ->check(number_from(0.0, 1e6));
  command->add_option("--topology", arguments->topology, "line (default) or tree")
      ->check(CLI::IsMember({"line", "tree"}));
  command->add_option("--cable", arguments->cable, "delay of each cable; default 50ns");
  command->add_option("--hop", arguments->hop, "delay in each SubDevice; default 300ns");
  command->add_option("--drop", options.drop, "share of frames to lose")
      ->check(number_from(0.0, 1.0));
  command->add_option("--fault", arguments->faults,
                      "cut:N@S, mend:N@S, restart:N@S or skew:N@S=PPM; may be repeated");
  command->add_flag("!--sign-bit-behind", options.sign_bit_means_ahead,
                    "bit 31 of 0x092C set when the drive's copy is behind, not ahead");
  command
      ->add_option("--clock-bits", options.clock_bits,
                   "of the distributed clocks: 64 (default), 32, or 0: there are none")
      ->check(CLI::IsMember({0U, 32U, 64U}));
  command->add_option("--bridge", options.bridge,
                      "this SubDevice is a bridge terminal; its other side shows CLOCK_REALTIME");
  command->add_option("--seed", options.seed, "of crystals and losses");
  command->add_option("--duration", options.duration_s, "stop after so many seconds; 0: never")
      ->check(number_from(0.0, 1e9));
  command->add_option("--priority", arguments->priority, "SCHED_FIFO priority")
      ->check(CLI::Range(0, 99));
  command->add_option("--cpu", arguments->cpu, "pin to this processor");
  command->add_option("--json", options.json, "write what the drives saw to this file");
  command->add_option("--clock-csv", arguments->options.clock_csv,
                      "write CLOCK_MONOTONIC and the first drive's system time to this file, each "
                      "50 frames");
  add_rights_flags(*command, arguments->rights, false);
  command->callback([arguments, &exit_code] { exit_code = run_segment(*arguments); });
}

}  // namespace ftcs::app
