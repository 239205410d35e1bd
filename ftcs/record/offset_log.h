// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

namespace ftcs {

/// One line of ptp4l, phc2sys or ts2phc that reports an offset (linuxptp 2 to 4):
///
///   ptp4l[5197.201]: master offset        -12 s2 freq   +1234 path delay       567
///   phc2sys[5197.9]: CLOCK_REALTIME phc offset  31 s2 freq  +5 delay   468
struct OffsetLogLine {
  std::optional<double> time_s;  ///< CLOCK_MONOTONIC, in brackets; syslog may have dropped it
  double offset_ns = 0.0;        ///< local minus reference
  int state = 0;                 ///< 0 unlocked, 1 jump, 2 locked, 3 locked and stable
  std::optional<double> frequency_ppb;
  std::optional<double> delay_ns;
};

/// Nothing if the line does not report an offset.
[[nodiscard]] std::optional<OffsetLogLine> parse_offset_log_line(std::string_view line);

/// Does the line come from one of these programs?
[[nodiscard]] bool is_linuxptp_line(std::string_view line);

}  // namespace ftcs
