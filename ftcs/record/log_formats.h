// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "ftcs/record/recorded_log.h"

namespace ftcs {

/// Name of the format whose lines are whole exchanges.
inline constexpr const char* kExchanges = "t1..t4";

/// One way to write a log. Lines go in one after the other; the pairs come out at the end.
class LogFormat {
 public:
  virtual ~LogFormat() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Does the line that told the format hold no data?
  [[nodiscard]] virtual bool is_heading(std::string_view line) const = 0;
  /// Empty, or why the line cannot be used.
  [[nodiscard]] virtual std::string take(std::string_view line) = 0;
  /// Makes the pairs. `source`: which of several programs or clocks, empty = the largest. Empty, or
  /// why that cannot be.
  [[nodiscard]] virtual std::string finish(RecordedLog& log, const std::string& source) = 0;

 protected:
  LogFormat() = default;
  LogFormat(const LogFormat&) = default;
  LogFormat& operator=(const LogFormat&) = default;
};

/// Null if the line does not tell.
[[nodiscard]] std::unique_ptr<LogFormat> detect_format(std::string_view line);

/// Is it the first line of a log that is no table of values: of linuxptp, of chrony, or of
/// exchanges t1..t4?
[[nodiscard]] bool begins_log(std::string_view line);

[[nodiscard]] std::unique_ptr<LogFormat> detect_linuxptp(std::string_view line);
[[nodiscard]] std::unique_ptr<LogFormat> detect_chrony(std::string_view line);
[[nodiscard]] std::unique_ptr<LogFormat> detect_csv(std::string_view line);

/// A pair of a clock whose offset is known: free running = reference + offset.
[[nodiscard]] RecordedPair offset_pair(Duration reference, Duration offset,
                                       double steering_ns = 0.0);

/// For formats that have one clock only: why `source` cannot be chosen, or empty.
[[nodiscard]] std::string no_such_source(const std::string& source, const std::string& format);

/// Exact reading of a decimal number of `unit_ns` nanoseconds: whole units as integers, so that
/// seconds since 1970 keep their nanoseconds. Nothing if it is no number or beyond 146 years.
[[nodiscard]] std::optional<Duration> parse_time(std::string_view text, std::int64_t unit_ns);

}  // namespace ftcs
