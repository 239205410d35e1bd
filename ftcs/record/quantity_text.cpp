// SPDX-License-Identifier: MIT
#include "ftcs/record/quantity_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/core.h>

namespace ftcs {
namespace {

struct Unit {
  std::string_view suffix;
  double factor;
};

struct Quantity {
  double value = 0.0;
  std::string_view suffix;
};

// from_chars: no locale, and nothing but a number is a number.
std::optional<Quantity> split(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  Quantity quantity;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), quantity.value);
  if (error != std::errc{} || !std::isfinite(quantity.value)) return std::nullopt;
  quantity.suffix = text.substr(static_cast<std::size_t>(end - text.data()));
  return quantity;
}

template <std::size_t kUnits>
std::optional<double> scaled(std::string_view text, const std::array<Unit, kUnits>& units) {
  const auto quantity = split(text);
  if (!quantity) return std::nullopt;
  if (quantity->suffix.empty() && quantity->value == 0.0) return 0.0;
  for (const Unit& unit : units) {
    if (quantity->suffix == unit.suffix) return quantity->value * unit.factor;
  }
  return std::nullopt;
}

constexpr std::array kTimeUnits{Unit{"ns", 1.0}, Unit{"us", 1e3}, Unit{"ms", 1e6}, Unit{"s", 1e9}};
constexpr std::array kRateUnits{Unit{"ppb", 1.0}, Unit{"ppm", 1e3}};

}  // namespace

Result<Duration, ParseError> parse_duration(std::string_view text) {
  constexpr double kLongestNs = 4.6e18;
  const auto ns = scaled(text, kTimeUnits);
  if (!ns || std::abs(*ns) > kLongestNs) {
    return ParseError{fmt::format("'{}' is no time: expected a number and ns, us, ms or s", text)};
  }
  return Duration::from_ns(*ns);
}

Result<double, ParseError> parse_ppb(std::string_view text) {
  constexpr double kStandstillPpb = 1e9;
  const auto ppb = scaled(text, kRateUnits);
  if (!ppb || std::abs(*ppb) >= kStandstillPpb) {
    return ParseError{fmt::format("'{}' is no rate: expected a number and ppb or ppm", text)};
  }
  return *ppb;
}

Result<ConvergedBand, ParseError> parse_band(std::string_view text) {
  const std::size_t colon = text.find(':');
  const auto enter = parse_duration(text.substr(0, colon));
  if (!enter) return enter.error();
  const auto leave =
      colon == std::string_view::npos ? enter : parse_duration(text.substr(colon + 1));
  if (!leave) return leave.error();
  const ConvergedBand band{*enter, *leave};
  if (band.valid()) return band;
  return ParseError{fmt::format("'{}' is no band: expected 0 <= ENTER <= LEAVE", text)};
}

Result<double, ParseError> parse_number(std::string_view text, double lowest, double highest) {
  const auto quantity = split(text);
  if (quantity && quantity->suffix.empty() && quantity->value >= lowest &&
      quantity->value <= highest) {
    return quantity->value;
  }
  return ParseError{
      fmt::format("'{}': expected a number from {:g} to {:g}", text, lowest, highest)};
}

Result<std::int64_t, ParseError> parse_integer(std::string_view text, std::int64_t lowest,
                                               std::int64_t highest) {
  std::string_view digits = text;
  int base = 10;
  if (digits.starts_with("0x") || digits.starts_with("0X")) {
    digits.remove_prefix(2);
    base = 16;
  }
  if (base == 10 && digits.starts_with("+")) digits.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), value, base);
  if (error == std::errc{} && end == digits.data() + digits.size() && value >= lowest &&
      value <= highest) {
    return value;
  }
  return ParseError{fmt::format("'{}': expected an integer from {} to {}", text, lowest, highest)};
}

}  // namespace ftcs
