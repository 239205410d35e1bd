// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "ftcs/analysis/statistics.h"
#include "ftcs/discipline/telemetry.h"
#include "ftcs/time/duration.h"

namespace ftcs::daemon {

/// One Sync as users see it.
struct SampleRecord {
  double time_s = 0.0;        ///< since the start
  Duration offset{};          ///< perceived, local minus reference, also of a rejected sample
  bool offset_known = false;  ///< a path delay is known
  Telemetry telemetry{};
};

/// "used", "rejected", "duplicate", "implausible".
[[nodiscard]] const char* verdict_name(SampleVerdict verdict) noexcept;
/// "unlocked", "jump", "locked", "holdover".
[[nodiscard]] const char* state_name(ServoState state) noexcept;

/// "master offset ... s2 freq ... path delay ...", as ptp4l prints it. Its freq is how fast the
/// local clock was found to be: minus the adjustment that is applied, in ppb. A rejected sample has
/// its verdict at the end.
[[nodiscard]] std::string ptp4l_line(const SampleRecord& record);
/// "CLOCK_REALTIME phc offset ... s2 freq ... delay ...", as phc2sys prints it; `source`: "phc" or
/// "sys".
[[nodiscard]] std::string phc2sys_line(const SampleRecord& record, const std::string& clock,
                                       const char* source);
/// One JSON object; docs/ptp.md lists the fields. What is not known is null.
[[nodiscard]] std::string json_line(const SampleRecord& record);
[[nodiscard]] std::string csv_header();
[[nodiscard]] std::string csv_line(const SampleRecord& record);

/// ptp4l's summary: "rms ... max ... freq ... +/- ... delay ... +/- ...".
class SampleSummary {
 public:
  void add(const SampleRecord& record) noexcept;
  void reset() noexcept { *this = {}; }
  [[nodiscard]] std::uint64_t count() const noexcept { return offset_.count(); }
  /// 0 before the first sample.
  [[nodiscard]] double offset_rms() const noexcept { return count() == 0 ? 0.0 : offset_.rms(); }
  [[nodiscard]] std::string text() const;

 private:
  RunningStatistics offset_;
  RunningStatistics frequency_;
  RunningStatistics delay_;
};

}  // namespace ftcs::daemon
