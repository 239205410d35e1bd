// SPDX-License-Identifier: MIT
#include "ftcs/record/log_formats.h"

#include <charconv>

#include "ftcs/record/fields.h"
#include "ftcs/record/offset_log.h"

namespace ftcs {

std::unique_ptr<LogFormat> detect_format(std::string_view line) {
  if (auto format = detect_linuxptp(line)) return format;
  if (auto format = detect_chrony(line)) return format;
  return detect_csv(line);
}

bool begins_log(std::string_view line) {
  if (is_linuxptp_line(line) || detect_linuxptp(line) || detect_chrony(line)) return true;
  const auto table = detect_csv(line);
  return table && table->name() == kExchanges;
}

RecordedPair offset_pair(Duration reference, Duration offset, double steering_ns) {
  return {{Direction::kForward, ReferenceTime{reference}, FreeRunningTime{reference + offset}},
          std::nullopt,
          steering_ns};
}

std::string no_such_source(const std::string& source, const std::string& format) {
  if (source.empty()) return "";
  return "no source '" + source + "': a file of " + format + " is about one clock";
}

std::optional<Duration> parse_time(std::string_view text, std::int64_t unit_ns) {
  text = trimmed(text);
  if (text.find_first_of("eE") != std::string_view::npos) {
    const auto value = parse_decimal(text);
    if (!value || !fits_duration(*value * static_cast<double>(unit_ns))) return std::nullopt;
    return Duration::from_ns(*value * static_cast<double>(unit_ns));
  }
  const bool negative = !text.empty() && text.front() == '-';
  if (negative || (!text.empty() && text.front() == '+')) text.remove_prefix(1);
  const auto point = text.find('.');
  const std::string_view digits = text.substr(0, point);
  std::int64_t whole = 0;
  if (!digits.empty()) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), whole);
    if (error != std::errc{} || end != digits.data() + digits.size() || whole < 0)
      return std::nullopt;
  }
  constexpr std::int64_t kLargest = std::int64_t{1} << 62;
  if (whole > kLargest / unit_ns) return std::nullopt;
  Duration value = Duration::from_whole_ns(whole * unit_ns);
  if (point != std::string_view::npos) {
    const std::string fraction = "0" + std::string(text.substr(point));
    const auto part = parse_decimal(fraction == "0." ? "0" : fraction);
    if (!part) return std::nullopt;
    value += Duration::from_ns(*part * static_cast<double>(unit_ns));
  } else if (digits.empty()) {
    return std::nullopt;
  }
  return negative ? -value : value;
}

}  // namespace ftcs
