// SPDX-License-Identifier: MIT
#include "ftcs/record/units.h"

#include <algorithm>
#include <array>
#include <utility>

#include "ftcs/record/fields.h"

namespace ftcs {
namespace {

/// What may stand around a unit in a heading.
constexpr std::string_view kAround = "_/()[] ";

using Unit = std::pair<std::string_view, double>;
constexpr std::array<Unit, 6> kTimeUnits = {
    {{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}, {"ps", 1e-12}, {"d", 86400.0}}};
constexpr std::array<Unit, 4> kFractionUnits = {
    {{"1", 1.0}, {"ppm", 1e-6}, {"ppb", 1e-9}, {"ppt", 1e-12}}};

constexpr std::array<Unit, 4> kFrequencyUnits = {
    {{"Hz", 1.0}, {"kHz", 1e3}, {"MHz", 1e6}, {"GHz", 1e9}}};

template <std::size_t N>
std::optional<double> find(const std::array<Unit, N>& units, std::string_view name) {
  for (const auto& [unit, factor] : units) {
    if (unit == name) return factor;
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> seconds_of_unit(std::string_view unit) { return find(kTimeUnits, unit); }

std::optional<double> fraction_of_unit(std::string_view unit) { return find(kFractionUnits, unit); }

std::optional<double> hertz_of_unit(std::string_view unit) { return find(kFrequencyUnits, unit); }

std::string unit_in_heading(std::string_view heading) {
  const auto last = heading.find_last_not_of(kAround);
  if (last == std::string_view::npos) return {};
  const auto before = heading.find_last_of(kAround, last);
  if (before == std::string_view::npos) return {};  // the heading is one word: no unit behind it
  const std::string_view word = heading.substr(before + 1, last - before);
  // "column 1" is no unit.
  const bool known =
      word != "1" && (seconds_of_unit(word) || fraction_of_unit(word) || hertz_of_unit(word));
  return known ? std::string(word) : std::string();
}

std::string name_in_heading(std::string_view heading) {
  const std::string unit = unit_in_heading(heading);
  std::string name(heading.substr(0, unit.empty() ? heading.size() : heading.rfind(unit)));
  name.erase(std::find_if_not(name.rbegin(), name.rend(),
                              [](char c) { return kAround.find(c) != std::string_view::npos; })
                 .base(),
             name.end());
  return lower_case(name);
}

}  // namespace ftcs
