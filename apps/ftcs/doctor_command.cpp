// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "apps/ftcs/commands.h"
#include "apps/ftcs/ptp_arguments.h"
#include "ftcs/daemon/doctor.h"

namespace ftcs::app {
namespace {

/// Two Announce intervals of two seconds, and four Syncs after.
constexpr double kUsualSeconds = 8.0;

void print_finding(const diagnosis::Finding& finding, bool decisive) {
  if (decisive) {
    fmt::print("{}\n", diagnosis::sentence(finding));
  } else {
    fmt::print("also: {}\n", finding.seen);
  }
  const auto line = [](const char* name, const std::string& text) {
    if (!text.empty()) fmt::print("  {:<9} {}\n", name, text);
  };
  if (decisive) line("seen", finding.seen);
  line("expected", finding.expected);
  line("mend", finding.remedy);
  line("cause", std::string(diagnosis::name(finding.cause)));
}

void print_talker(const diagnosis::Talker& talker) {
  constexpr std::array<const char*, 3> kWays{"UDPv4", "UDPv6", "L2"};
  constexpr std::array<std::pair<ptp::MessageType, const char*>, 8> kTypes{{
      {ptp::MessageType::kAnnounce, "Announce"},
      {ptp::MessageType::kSync, "Sync"},
      {ptp::MessageType::kFollowUp, "Follow_Up"},
      {ptp::MessageType::kDelayReq, "Delay_Req"},
      {ptp::MessageType::kDelayResp, "Delay_Resp"},
      {ptp::MessageType::kPdelayReq, "Pdelay_Req"},
      {ptp::MessageType::kPdelayResp, "Pdelay_Resp"},
      {ptp::MessageType::kManagement, "Management"},
  }};
  std::string counted;
  for (const auto& [type, name] : kTypes) {
    if (talker.count(type) == 0) continue;
    counted += fmt::format("{}{} {}", counted.empty() ? "" : ", ", talker.count(type), name);
  }
  fmt::print("  {}  {}{}  version {}  domain {}  transportSpecific {}  {}: {}\n",
             to_text(talker.port).view(), kWays[static_cast<std::size_t>(talker.way)],
             talker.vlan == 0 ? "" : fmt::format(" VLAN {}", talker.vlan), talker.version,
             talker.domain, talker.major_sdo_id, talker.to_group ? "multicast" : "unicast",
             counted);
}

void print_heard(const daemon::Examination& result) {
  fmt::print("heard{}:{}\n", result.wire_unheard ? " at this port" : " on the wire",
             result.heard.empty() ? " nobody" : "");
  for (const diagnosis::Talker& talker : result.heard) print_talker(talker);
  if (result.wire_unheard) {
    fmt::print("the wire itself was not listened to ({}): root or CAP_NET_RAW can\n",
               *result.wire_unheard);
  }
}

int run(const PtpArguments& arguments) {
  daemon::PtpOptions options;
  if (const auto wrong = make_ptp_options(arguments, options)) {
    fmt::print(stderr, "ftcs doctor: {}\n", *wrong);
    return kUsageError;
  }
  if (options.interface.empty()) {
    fmt::print(stderr, "ftcs doctor: no interface: give one with -i, for example -i eth0\n");
    return kUsageError;
  }
  options.socket.interface = options.interface;
  if (!options.duration) options.duration = Duration::from_ns(kUsualSeconds * 1e9);
  platform::LinuxKernel kernel;
  const daemon::Examination result = daemon::examine(kernel, options, [&options] {
    fmt::print("listening on {} for {:g} s; no clock is steered\n", options.interface,
               options.duration->seconds());
    std::fflush(stdout);
  });
  bool decisive = true;
  for (const diagnosis::Finding& finding : result.findings) {
    print_finding(finding, decisive);
    decisive = false;
  }
  if (result.listened) print_heard(result);
  const bool good = result.findings.front().cause == diagnosis::Cause::kLocked;
  return good ? kSuccess : kNotLocked;
}

}  // namespace

void add_doctor_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "doctor", "why a clock is not locked, and the flag that mends it (flags as of ftcs ptp)");
  const auto arguments = std::make_shared<PtpArguments>();
  add_ptp_arguments(*command, *arguments);
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace ftcs::app
