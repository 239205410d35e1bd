// SPDX-License-Identifier: MIT
#include "ftcs/report/suggestion.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <numeric>

#include <fmt/core.h>

namespace ftcs {
namespace {

constexpr std::size_t kShortest = 4;  // shorter words are near to everything
constexpr std::size_t kLargestDistance = 2;

std::string letters(std::string_view word) {
  std::string result;
  for (const char c : word) {
    if (c == '-' || c == '_') continue;
    result.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  return result;
}

/// How many letters must be added, left out or changed (Levenshtein).
std::size_t distance(std::string_view one, std::string_view other) {
  std::vector<std::size_t> row(other.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char letter : one) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < other.size(); ++j) {
      const std::size_t changed = diagonal + (letter == other[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string suggestion(std::string_view word, const std::vector<std::string>& names) {
  const std::string asked = letters(word);
  if (asked.size() < kShortest) return {};
  std::string best;
  std::size_t least = kLargestDistance + 1;
  for (const std::string& name : names) {
    const std::string known = letters(name);
    const std::size_t away = known.starts_with(asked) ? 0 : distance(asked, known);
    if (away >= least || known.size() < kShortest) continue;
    best = name;
    least = away;
  }
  return best;
}

std::string did_you_mean(std::string_view suggested) {
  return suggested.empty() ? "" : fmt::format("; did you mean '{}'?", suggested);
}

}  // namespace ftcs
