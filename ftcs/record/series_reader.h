// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/record/line_reader.h"

namespace ftcs {

enum class RecordKind : std::uint8_t {
  kPhase,      ///< time error of a clock, as a counter measures it
  kFrequency,  ///< fractional frequency deviation
  kOffset,     ///< time error of a steered clock, local minus reference
};

[[nodiscard]] const char* name(RecordKind kind) noexcept;

/// What the reader is told; what is left open it takes from headings and conventions, and says so
/// in `notes`.
struct SeriesOptions {
  std::string
      column;  ///< of the values: number from 1, or heading; empty = the first that is not time
  std::string time_column;  ///< likewise; "none" = no times; empty = a heading that says so, else
                            ///< column 1 of several
  std::string time_unit;    ///< empty = s
  std::string unit;         ///< of the values; empty = by heading (offset_ns), else by kind
  std::optional<RecordKind> kind;
  std::optional<double> nominal_hz;  ///< of values in Hz: what they should be
  std::optional<double> interval_s;  ///< tau_0; else that of the times (time_grid.h), else 1 s
  std::string source;  ///< of a log with several: "phc2sys CLOCK_REALTIME"; empty = most lines
};

/// A record on a grid of equal intervals: what analysis takes.
struct Series {
  RecordKind kind = RecordKind::kPhase;
  std::vector<double> values;  ///< seconds, or fractional frequency; missing = not a number
  double interval_s = 1.0;
  std::size_t samples = 0;         ///< values that are present
  std::size_t missing = 0;         ///< places without one
  std::size_t lines_left_out = 0;  ///< of a log: lines that report no offset
  std::vector<std::string> notes;  ///< how the file was understood
};

/// Reads a table (comma, semicolon or space; "#", "%" and ";" start comments; a first line of words
/// is a heading) or a log of linuxptp. Plain or gzip.
///
/// Times put the values on a grid of the interval: places without a value are gaps. Two values
/// nearer than half an interval keep their order and take two places (counted in the notes). From
/// the first locked state (s2) of a log on, all its offsets are taken; a log that never locks is
/// taken whole. Of several programs or clocks in one log one is taken, never a mixture.
///
/// Errors: no such column, a field that is no number, a short line, times that go backwards, an
/// unknown unit, a record in Hz without its nominal frequency, no numbers at all, a gap that is
/// larger than the record could explain; everything that LineReader finds.
[[nodiscard]] Result<Series, ReadError> read_series(const std::string& path,
                                                    const SeriesOptions& options);

}  // namespace ftcs
