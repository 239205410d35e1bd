// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace ftcs {

/// What stands where there is no figure.
inline constexpr const char* kNoFigureText = "-";

/// `digits` significant digits, trailing zeros kept ("12.50"); an exponent below 1e-4 and from
/// 10^digits on, as "%g" does. Not finite: "-".
[[nodiscard]] std::string significant(double value, int digits = 4);
/// A fixed number of decimals. Not finite: "-".
[[nodiscard]] std::string fixed(double value, int decimals);
/// Seconds with the unit that suits: "12.50 ns", "1.250 us", "3.000 s". ASCII: "us", never the
/// Greek letter.
[[nodiscard]] std::string seconds_text(double seconds, int digits = 4);
/// A fractional frequency in ppm, ppb or as a plain exponent: "3.200 ppb", "-1.000 ppm".
[[nodiscard]] std::string fraction_text(double fraction, int digits = 4);

/// A unit of time for a whole plot or table column: largest unit in which `largest` is at least
/// one.
struct TimeUnit {
  const char* name;
  double seconds;
};
[[nodiscard]] TimeUnit time_unit_for(double largest_seconds);

}  // namespace ftcs
