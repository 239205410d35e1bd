// SPDX-License-Identifier: MIT
#include "ftcs/record/fields.h"

#include <charconv>
#include <cmath>
#include <string>

namespace ftcs {
namespace {

constexpr std::string_view kSpaces = " \t\f";

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kSpaces);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpaces) - first + 1);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& letter : lower) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return lower;
}

char separator_of(std::string_view line) {
  for (const char candidate : {',', ';'}) {
    if (line.find(candidate) != std::string_view::npos) return candidate;
  }
  return ' ';
}

std::vector<std::string_view> split_fields(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  line = trimmed(line);
  while (true) {
    const auto end = separator == ' ' ? line.find_first_of(kSpaces) : line.find(separator);
    std::string_view field = trimmed(line.substr(0, end));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"') {
      field = trimmed(field.substr(1, field.size() - 2));
    }
    fields.push_back(field);
    if (end == std::string_view::npos) return fields;
    line = line.substr(end + 1);
    if (separator == ' ') line = trimmed(line);
  }
}

std::optional<double> parse_decimal(std::string_view text) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

bool fits_duration(double ns) {
  constexpr double kLargest = 4.6e18;
  return std::abs(ns) <= kLargest;
}

bool is_missing(std::string_view text) {
  const std::string lower = lower_case(text);
  return lower.empty() || lower == "-" || lower == "nan" || lower == "na" || lower == "null";
}

}  // namespace ftcs
