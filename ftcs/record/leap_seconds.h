// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ftcs/time/result.h"

namespace ftcs {

/// The list of leap seconds as IERS and NIST publish it (leap-seconds.list; Debian: package tzdata,
/// /usr/share/zoneinfo/leap-seconds.list): lines "seconds-since-1900 TAI-UTC", "#@ expiry",
/// "#$ last update".
class LeapSeconds {
 public:
  /// An error names the line: "FILE:12: what is wrong".
  [[nodiscard]] static Result<LeapSeconds, std::string> parse(std::string_view text,
                                                              std::string_view name);
  [[nodiscard]] static Result<LeapSeconds, std::string> read_file(const std::string& path);

  /// Of a moment in UTC (seconds since 1970).
  struct State {
    int utc_offset = 0;  ///< TAI - UTC
    int leap = 0;        ///< at the end of this UTC day: +1, -1, 0 none
  };
  /// No value: before 1972.
  [[nodiscard]] std::optional<State> at(std::int64_t utc_s) const;
  /// After this nothing is promised; none: the file does not say.
  [[nodiscard]] std::optional<std::int64_t> expires() const { return expires_; }
  /// When the list was made ("#$"): no moment in which it is read can be earlier.
  [[nodiscard]] std::optional<std::int64_t> updated() const { return updated_; }

 private:
  struct Change {
    std::int64_t utc_s = 0;  ///< midnight from which on it holds
    int utc_offset = 0;
  };
  std::vector<Change> changes_;
  std::optional<std::int64_t> expires_;
  std::optional<std::int64_t> updated_;
};

}  // namespace ftcs
