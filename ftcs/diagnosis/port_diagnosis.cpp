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

std::vector<Finding> diagnose_all(const PortSeen& seen) {
  std::vector<Finding> all;
  const auto add = [&all](std::vector<Finding> more) {
    for (Finding& finding : more) all.push_back(std::move(finding));
  };
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
