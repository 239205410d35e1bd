// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/port_diagnosis.h"

#include <fmt/format.h>

#include "ftcs/diagnosis/port_rules.h"

namespace ftcs::diagnosis {
namespace {

std::string figures(const PortSeen& seen) {
  return fmt::format("offset {:.0f} ns, path delay {:.0f} ns, rate {:+.0f} ppb",
                     seen.servo.offset.ns(), seen.servo.path_delay.ns(), seen.rate.ppb());
}

Finding acquiring(const PortSeen& seen) {
  if (!seen.servo.offset_known) {
    return {Cause::kAcquiring, "a time transmitter announces, the path delay is not known yet", "",
            ""};
  }
  return {Cause::kAcquiring, figures(seen), "", ""};
}

/// What keeps nobody from locking, and is worth a word.
std::vector<Finding> remarks(const PortSeen& seen) {
  std::vector<Finding> found;
  const Talkers& talkers = seen.on_wire ? *seen.on_wire : seen.at_port;
  std::string names;
  std::size_t announcers = 0;
  for (const Talker& talker : talkers.all()) {
    if (!is_for(talker, seen.settings) || !talker.announces()) continue;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", to_text(talker.port).view());
    ++announcers;
  }
  if (announcers > 1) {
    found.push_back({Cause::kTwoTransmitters,
                     fmt::format("{} ports announce in this domain: {}", announcers, names),
                     "the best of them alone announces, once the others have heard it",
                     "transmitters that do not hear each other may disagree"});
  }
  return found;
}

}  // namespace

std::vector<Finding> diagnose_all(const PortSeen& seen) {
  if (seen.locked) {
    std::vector<Finding> all{{Cause::kLocked, figures(seen), "", ""}};
    for (Finding& remark : remarks(seen)) all.push_back(std::move(remark));
    return all;
  }
  std::vector<Finding> all;
  const auto rules = seen.has_transmitter ? rules_of_measuring() : rules_of_hearing();
  for (const PortRule rule : rules) {
    if (auto found = rule(seen)) all.push_back(std::move(*found));
  }
  if (all.empty()) all.push_back(seen.has_transmitter ? acquiring(seen) : nothing_heard(seen));
  for (Finding& remark : remarks(seen)) all.push_back(std::move(remark));
  return all;
}

Finding diagnose(const PortSeen& seen) { return diagnose_all(seen).front(); }

}  // namespace ftcs::diagnosis
