// SPDX-License-Identifier: MIT
#include "ftcs/report/number_format.h"

#include <array>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

namespace ftcs {
namespace {

constexpr std::array<TimeUnit, 5> kTimeUnits = {
    {{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}, {"ps", 1e-12}}};

}  // namespace

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return kNoFigureText;
  if (value == 0.0) return "0";
  // Not fmt: its "#" form turns 1234 into "1234.0" whatever the digits.
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%#.*g", digits, value);
  std::string text(buffer.data());
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string fixed(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : kNoFigureText;
}

TimeUnit time_unit_for(double largest_seconds) {
  const double size = std::abs(largest_seconds);
  if (!(size > 0.0)) return kTimeUnits[3];
  for (const TimeUnit& unit : kTimeUnits) {
    if (size >= unit.seconds) return unit;
  }
  return kTimeUnits.back();
}

std::string seconds_text(double seconds, int digits) {
  if (!std::isfinite(seconds)) return kNoFigureText;
  const TimeUnit unit = time_unit_for(seconds);
  return fmt::format("{} {}", significant(seconds / unit.seconds, digits), unit.name);
}

std::string fraction_text(double fraction, int digits) {
  if (!std::isfinite(fraction)) return kNoFigureText;
  const double size = std::abs(fraction);
  if (size >= 1e-2) return significant(fraction, digits);
  if (size >= 1e-6) return significant(fraction * 1e6, digits) + " ppm";
  if (size >= 1e-12 || size == 0.0) return significant(fraction * 1e9, digits) + " ppb";
  return significant(fraction, digits);
}

}  // namespace ftcs
