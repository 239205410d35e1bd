// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "ftcs/daemon/log.h"
#include "ftcs/daemon/sample_report.h"
#include "ftcs/discipline/telemetry.h"

namespace ftcs::daemon {

/// What `ftcs ptp` and `ftcs phc` say of many samples at once: of the last few while they run, of
/// all since the first lock at the end.
class RunSummary {
 public:
  /// Counts for the summary while locked, if it was used while locked.
  void add(const SampleRecord& record);
  /// Of used samples: ptp4l's line once `samples` have come since the last one; else none.
  [[nodiscard]] std::optional<std::string> add_recent(const SampleRecord& record,
                                                      std::uint64_t samples);
  /// The lines at the end. `messages`: what they were, "samples" or "readings".
  void log(Log& log, const DisciplineCounters& counters, bool locked,
           std::string_view messages) const;

  /// Of all used samples since the first lock.
  [[nodiscard]] double offset_rms_ns() const { return since_lock_.offset_rms(); }
  /// Empty: not locked yet.
  [[nodiscard]] std::string since_lock() const {
    return since_lock_.count() > 0 ? since_lock_.text() : std::string{};
  }

 private:
  SampleSummary recent_;
  SampleSummary since_lock_;
};

}  // namespace ftcs::daemon
