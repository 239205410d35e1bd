// SPDX-License-Identifier: MIT
#include "ftcs/experiment/quantity.h"

#include <charconv>
#include <cmath>

namespace ftcs::experiment {
namespace {

struct Unit {
  std::string_view name;
  double factor;
};

constexpr Unit kTimeUnits[] = {{"ns", 1.0},   {"us", 1e3},   {"ms", 1e6},    {"s", 1e9},
                               {"min", 60e9}, {"h", 3600e9}, {"d", 86'400e9}};
constexpr Unit kRatioUnits[] = {{"", 1.0}, {"ppb", 1e-9}, {"ppm", 1e-6}, {"%", 1e-2}};
/// A Julian year, as in specifications of ageing.
constexpr double kYear = 365.25 * 86'400.0;
constexpr Unit kPerTimeUnits[] = {
    {"/s", 1.0}, {"/min", 60.0}, {"/h", 3600.0}, {"/d", 86'400.0}, {"/year", kYear}};

std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

struct NumberAndUnit {
  double number;
  std::string_view unit;
};

std::optional<NumberAndUnit> split(std::string_view text) noexcept {
  text = trimmed(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || !std::isfinite(number)) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return NumberAndUnit{number, trimmed(text)};
}

template <std::size_t N>
std::optional<double> factor_of(std::string_view name, const Unit (&units)[N]) noexcept {
  for (const Unit& unit : units) {
    if (unit.name == name) return unit.factor;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Duration> parse_duration(std::string_view text) noexcept {
  const auto parts = split(text);
  if (!parts) return std::nullopt;
  if (parts->number == 0.0 && parts->unit.empty()) return Duration{};
  const auto factor = factor_of(parts->unit, kTimeUnits);
  if (!factor) return std::nullopt;
  return Duration::from_ns(parts->number * *factor);
}

std::optional<double> parse_ratio(std::string_view text) noexcept {
  const auto parts = split(text);
  if (!parts) return std::nullopt;
  const auto factor = factor_of(parts->unit, kRatioUnits);
  return factor ? std::optional(parts->number * *factor) : std::nullopt;
}

std::optional<double> parse_ratio_per_second(std::string_view text) noexcept {
  const auto slash = text.rfind('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto seconds = factor_of(trimmed(text.substr(slash)), kPerTimeUnits);
  const auto ratio = parse_ratio(text.substr(0, slash));
  if (!seconds || !ratio) return std::nullopt;
  return *ratio / *seconds;
}

std::optional<double> parse_ratio_per_root_second(std::string_view text) noexcept {
  const auto slash = text.rfind('/');
  if (slash == std::string_view::npos || trimmed(text.substr(slash)) != "/sqrt(s)")
    return std::nullopt;
  return parse_ratio(text.substr(0, slash));
}

}  // namespace ftcs::experiment
