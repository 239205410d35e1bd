// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "ftcs/record/series_reader.h"
#include "ftcs/time/result.h"

namespace ftcs {

/// From a number of a file to seconds or fractional frequency: (number - origin) * factor.
struct ValueScale {
  double origin = 0.0;  ///< the nominal frequency, in the file's unit
  double factor = 1.0;
  std::string note;  ///< how the number is understood, for people
};

/// As told, else by the heading.
[[nodiscard]] RecordKind kind_of(const SeriesOptions& options, std::string_view heading);

/// An error is one sentence: what was expected, what came.
[[nodiscard]] Result<ValueScale, std::string> choose_scale(const SeriesOptions& options,
                                                           RecordKind kind,
                                                           std::string_view heading);

/// Do the values look like a record in Hz that nobody called so? Then one sentence with what to
/// say; else empty. Asked only of what was chosen by convention: fractional frequencies beyond 0.1,
/// and phases of more than a quarter of an hour that change by less than a thousandth of
/// themselves.
[[nodiscard]] std::string suspicion_of_hertz(std::span<const double> values, RecordKind kind,
                                             const SeriesOptions& options);

}  // namespace ftcs
