// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/port_diagnosis.h"

#include <fmt/format.h>

#include "ftcs/diagnosis/port_rules.h"

namespace ftcs::diagnosis {
namespace {

std::string figures(const PortSeen& seen) {
  // Whole numbers, as there is no -0 among them.
  return fmt::format("offset {} ns, path delay {:.0f} ns, rate {:+.0f} ppb{}",
                     seen.servo.offset.rounded_ns(), seen.servo.path_delay.ns(), seen.rate.ppb(),
                     seen.settings.steers ? "" : "; it is measured alone, nothing is steered");
}

Finding acquiring(const PortSeen& seen) {
  if (!seen.servo.offset_known) {
    return {Cause::kAcquiring, "a time transmitter announces, the path delay is not known yet", "",
            ""};
  }
  return {Cause::kAcquiring, figures(seen), "", ""};
}

}  // namespace

std::optional<Finding> link_trouble(const PortSeen& seen) {
  const std::string& interface = seen.settings.interface;
  const char* const version = seen.settings.way == Way::kUdpIpv6 ? "IPv6" : "IPv4";
  switch (seen.link) {
    case Link::kUp:
      return std::nullopt;
    case Link::kNoCarrier:
      return Finding{Cause::kLinkDown, fmt::format("the link of {} is down: no carrier", interface),
                     "a cable, and a device that is on at its other end",
                     "the cable, the switch's port"};
    case Link::kDown:
      return Finding{Cause::kLinkDown, fmt::format("{} is down", interface),
                     "a cable, and the interface up", fmt::format("ip link set {} up", interface)};
    case Link::kGone:
      return Finding{Cause::kLinkDown, fmt::format("{} is not there any more", interface),
                     "the interface", "plug it in again"};
    case Link::kNoAddress:
      return Finding{
          Cause::kNoAddress, fmt::format("{} has no {} address", interface, version),
          fmt::format("one, as {} is spoken", name(seen.settings.way)),
          fmt::format("ip address add ADDRESS/24 dev {} or DHCP; or -2 for Ethernet, {}", interface,
                      seen.settings.way == Way::kUdpIpv6 ? "-4 for IPv4" : "-6 for IPv6")};
    case Link::kClosed:
      break;
  }
  return Finding{Cause::kOther, seen.closed, "sockets that can be opened", ""};
}

std::vector<Finding> diagnose_all(const PortSeen& seen) {
  std::vector<Finding> all;
  const auto add = [&all](std::vector<Finding> more) {
    for (Finding& finding : more) all.push_back(std::move(finding));
  };
  if (!seen.locked) {
    if (auto found = link_trouble(seen)) all.push_back(std::move(*found));
  }
  if (auto found = other_group(seen)) all.push_back(std::move(*found));
  // A real clock does not follow what a virtual one may.
  if (seen.steers_real_clock) add(refusals_of_time(seen));
  if (seen.locked) {
    auto steered = other_steers(seen);
    if (steered && !seen.clock.empty()) all.push_back(std::move(*steered));
    if (auto far = far_at_start(seen)) all.push_back(std::move(*far));
    if (auto twins = one_identity(seen)) all.push_back(std::move(*twins));
    if (all.empty()) all.push_back({Cause::kLocked, figures(seen), "", ""});
  } else {
    const auto rules = seen.has_transmitter ? rules_of_measuring() : rules_of_hearing();
    for (const PortRule rule : rules) {
      if (auto found = rule(seen)) all.push_back(std::move(*found));
    }
    if (all.empty()) all.push_back(seen.has_transmitter ? acquiring(seen) : nothing_heard(seen));
  }
  if (all.front().cause == Cause::kNoAnnounce) {
    if (auto found = no_peer(seen)) all.push_back(std::move(*found));
  }
  if (!seen.steers_real_clock) add(refusals_of_time(seen));
  add(remarks(seen));
  return all;
}

Finding diagnose(const PortSeen& seen) { return diagnose_all(seen).front(); }

}  // namespace ftcs::diagnosis
