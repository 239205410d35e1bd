// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

#include "ftcs/time/duration.h"

namespace ftcs::experiment {

// A quantity in a file is a text with its unit ("100 us", "50 ppm", "1e-9 /sqrt(s)"), so that a
// wrong unit is an error instead of a factor of a thousand.

/// Units: ns, us, ms, s, min, h, d. "0" needs no unit.
[[nodiscard]] std::optional<Duration> parse_duration(std::string_view text) noexcept;
/// A fraction. Units: ppb, ppm, %; a plain number is the fraction itself.
[[nodiscard]] std::optional<double> parse_ratio(std::string_view text) noexcept;
/// A fraction per second. Units: a ratio's unit, then /s, /min, /h, /d, /year.
[[nodiscard]] std::optional<double> parse_ratio_per_second(std::string_view text) noexcept;
/// Random-walk FM: a fraction, then /sqrt(s).
[[nodiscard]] std::optional<double> parse_ratio_per_root_second(std::string_view text) noexcept;

}  // namespace ftcs::experiment
