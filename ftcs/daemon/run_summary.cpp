// SPDX-License-Identifier: MIT
#include "ftcs/daemon/run_summary.h"

namespace ftcs::daemon {

void RunSummary::add(const SampleRecord& record) {
  const Telemetry& telemetry = record.telemetry;
  if (telemetry.locked && telemetry.verdict == SampleVerdict::kUsed) since_lock_.add(record);
}

std::optional<std::string> RunSummary::add_recent(const SampleRecord& record,
                                                  std::uint64_t samples) {
  recent_.add(record);
  if (recent_.count() < samples) return std::nullopt;
  std::string text = recent_.text();
  recent_.reset();
  return text;
}

void RunSummary::log(Log& log, const DisciplineCounters& counters, bool locked,
                     std::string_view messages) const {
  log(LogLevel::kNotice, "summary: {}, {} {} used, {} rejected, {} steps",
      locked ? "locked" : "not locked", counters.used, messages, counters.rejected, counters.steps);
  if (since_lock_.count() > 0) {
    log(LogLevel::kNotice, "summary while locked: {}", since_lock_.text());
  }
}

}  // namespace ftcs::daemon
