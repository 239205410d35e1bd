// SPDX-License-Identifier: MIT
#include "ftcs/record/leap_seconds.h"

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include <fmt/core.h>

namespace ftcs {
namespace {

constexpr std::int64_t kFrom1900To1970 = 2'208'988'800;
constexpr std::int64_t kSecondsPerDay = 86'400;
constexpr std::int64_t kLatest = 4'000'000'000'000;
constexpr std::int64_t kLargestOffset = 1000;  // TAI - UTC, s

std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  std::istringstream stream{std::string(line.substr(0, line.find('#', 1)))};
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::optional<std::int64_t> integer(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::int64_t day_of(std::int64_t utc_s) {
  return (utc_s - ((utc_s % kSecondsPerDay) + kSecondsPerDay) % kSecondsPerDay) / kSecondsPerDay;
}

}  // namespace

Result<LeapSeconds, std::string> LeapSeconds::parse(std::string_view text, std::string_view name) {
  LeapSeconds result;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const bool expiry = line.starts_with("#@");
    const bool update = line.starts_with("#$");
    const bool date_alone = expiry || update;
    if (line.starts_with("#") && !date_alone) continue;
    const auto words = words_of(date_alone ? line.substr(2) : line);
    if (words.empty()) continue;
    const auto when = integer(words[0]);
    if (!when || *when < 0 || *when > kLatest || words.size() < (date_alone ? 1U : 2U)) {
      return fmt::format("{}:{}: expected seconds since 1900{}", name, number,
                         date_alone ? "" : " and TAI-UTC");
    }
    if (date_alone) {
      (expiry ? result.expires_ : result.updated_) = *when - kFrom1900To1970;
      continue;
    }
    const auto offset = integer(words[1]);
    if (!offset || std::abs(*offset) > kLargestOffset) {
      return fmt::format("{}:{}: TAI-UTC: '{}': expected an integer from {} to {}", name, number,
                         words[1], -kLargestOffset, kLargestOffset);
    }
    const Change change{*when - kFrom1900To1970, static_cast<int>(*offset)};
    if (!result.changes_.empty() && change.utc_s <= result.changes_.back().utc_s) {
      return fmt::format("{}:{}: not later than the line before", name, number);
    }
    result.changes_.push_back(change);
  }
  if (result.changes_.empty()) return fmt::format("{}: holds no leap seconds", name);
  return result;
}

Result<LeapSeconds, std::string> LeapSeconds::read_file(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  // A folder can be opened, but not read.
  if (!file || (file.peek(), file.bad())) return fmt::format("{}: {}", path, std::strerror(errno));
  if (!file.eof()) text << file.rdbuf();
  return parse(text.str(), path);
}

std::optional<LeapSeconds::State> LeapSeconds::at(std::int64_t utc_s) const {
  std::optional<State> state;
  for (const Change& change : changes_) {
    if (change.utc_s <= utc_s) {
      state = State{change.utc_offset, 0};
    } else if (state && day_of(change.utc_s - 1) == day_of(utc_s)) {
      state->leap = change.utc_offset - state->utc_offset;
    }
  }
  return state;
}

}  // namespace ftcs
