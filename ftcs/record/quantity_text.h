// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "ftcs/servo/converged_band.h"
#include "ftcs/time/duration.h"
#include "ftcs/time/rate.h"
#include "ftcs/time/result.h"

namespace ftcs {

/// One sentence: what was expected and what was given.
struct ParseError {
  std::string message;
};

/// "1ms", "-2.5us", "10ns", "3s"; "0" needs no unit. Range ±146 years.
[[nodiscard]] Result<Duration, ParseError> parse_duration(std::string_view text);
/// "50ppm", "-3ppb"; "0" needs no unit. A deviation from 1 in parts per billion, |value| < 1e9.
[[nodiscard]] Result<double, ParseError> parse_ppb(std::string_view text);
/// "ENTER" or "ENTER:LEAVE", two durations, 0 <= ENTER <= LEAVE.
[[nodiscard]] Result<ConvergedBand, ParseError> parse_band(std::string_view text);
/// A decimal number without unit, or with 0x a hexadecimal integer; lowest <= value <= highest.
[[nodiscard]] Result<double, ParseError> parse_number(std::string_view text, double lowest,
                                                      double highest);
/// An integer, decimal or 0x.
[[nodiscard]] Result<std::int64_t, ParseError> parse_integer(std::string_view text,
                                                             std::int64_t lowest,
                                                             std::int64_t highest);

}  // namespace ftcs
