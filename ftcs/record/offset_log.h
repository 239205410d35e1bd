// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ftcs {

/// One line of ptp4l, phc2sys, ts2phc (linuxptp 2 to 4) or ftcs that reports an offset:
///
///   ptp4l[5197.201]: master offset        -12 s2 freq   +1234 path delay       567
///   phc2sys[5197.9]: CLOCK_REALTIME phc offset  31 s2 freq  +5 delay   468
struct OffsetLogLine {
  /// Who wrote it, and of which clock: "ptp4l", "phc2sys CLOCK_REALTIME", "ts2phc eth0", "ptp4l
  /// [tag]".
  std::string source;
  std::optional<double> time_s;  ///< CLOCK_MONOTONIC, in brackets; syslog may have dropped it
  double offset_ns = 0.0;        ///< local minus reference
  int state = 0;                 ///< 0 unlocked, 1 jump, 2 locked, 3 locked and stable
  std::optional<double> frequency_ppb;
  std::optional<double> delay_ns;
};

/// Nothing if the line does not report an offset.
[[nodiscard]] std::optional<OffsetLogLine> parse_offset_log_line(std::string_view line);

/// One line that tells of all offsets since the line before, as ptp4l and phc2sys write with a
/// summary interval:
///
///   ptp4l[5197.201]: rms   12 max   30 freq  +1234 +/-   3 delay   567 +/-   1
///   phc2sys[5197.9]: CLOCK_REALTIME rms   12 max   30 freq  +1234 +/-   3 delay   567 +/-   1
struct SummaryLogLine {
  std::string source;
  std::optional<double> time_s;                  ///< as above: of the end of what is summarized
  double rms_ns = 0.0;                           ///< of the offsets
  double max_ns = 0.0;                           ///< the largest |offset|
  double frequency_ppb = 0.0;                    ///< mean of the applied ones
  std::optional<double> frequency_spread_ppb{};  ///< their standard deviation
};

/// Nothing if the line is no summary.
[[nodiscard]] std::optional<SummaryLogLine> parse_summary_log_line(std::string_view line);

/// The lines of a log, told apart by the program that wrote them and the clock they are about. A
/// journal holds those of several: their offsets are of different clocks and never one series.
class OffsetLog {
 public:
  struct Source {
    std::string name;
    std::vector<OffsetLogLine> lines;
    std::vector<SummaryLogLine> summaries;
  };

  /// Why the line is not used, or empty.
  [[nodiscard]] std::string add(std::string_view line);
  /// In the order in which they first appear.
  [[nodiscard]] const std::vector<Source>& sources() const noexcept { return sources_; }
  /// The source of that name; without a name the one with the most offsets, or where there are none
  /// the most summaries (the first of equals). Null: there is none.
  [[nodiscard]] const Source* pick(std::string_view name) const noexcept;
  /// "ptp4l (62 lines), phc2sys CLOCK_REALTIME (61 summaries)".
  [[nodiscard]] std::string describe_sources() const;

 private:
  [[nodiscard]] Source& source(const std::string& name);

  std::vector<Source> sources_;
};

/// Does the line come from one of these programs?
[[nodiscard]] bool is_linuxptp_line(std::string_view line);

}  // namespace ftcs
