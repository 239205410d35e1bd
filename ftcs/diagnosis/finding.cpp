// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/finding.h"

#include <array>

namespace ftcs::diagnosis {

std::string_view name(Cause cause) noexcept {
  constexpr std::array<std::string_view, kCauses> kNames{
      "locked",
      "acquiring",
      "link_down",
      "no_address",
      "vlan",
      "transport",
      "group",
      "not_delivered",
      "unicast",
      "multicast",
      "version",
      "sdo",
      "domain",
      "not_acceptable",
      "not_authentic",
      "unusable_announce",
      "alternate",
      "malformed",
      "sync_without_announce",
      "only_receivers",
      "no_announce",
      "no_peer",
      "several_peers",
      "peer_delay_limit",
      "no_sync",
      "no_follow_up",
      "no_receive_stamps",
      "no_transmit_stamps",
      "other_mechanism",
      "no_delay_resp",
      "delay_resp_for_others",
      "two_transmitters",
      "transmitters_disagree",
      "timescale",
      "first_offset",
      "other_steers",
      "samples_refused",
      "no_subdevice",
      "too_few_subdevices",
      "no_distributed_clock",
      "working_counter",
      "lost_frames",
      "host_late",
      "margin_too_small",
      "drives_not_operational",
      "axis_fault",
      "other",
  };
  return kNames[static_cast<std::size_t>(cause)];
}

std::string sentence(const Finding& finding) {
  std::string text = finding.cause == Cause::kLocked ? "locked: "
                     : finding.in_doubt              ? "in doubt: "
                                                     : "not locked: ";
  text += finding.seen;
  if (!finding.expected.empty()) text += "; expected " + finding.expected;
  if (!finding.remedy.empty()) text += "; " + finding.remedy;
  return text;
}

}  // namespace ftcs::diagnosis
