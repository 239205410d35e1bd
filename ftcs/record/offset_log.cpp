// SPDX-License-Identifier: MIT
#include "ftcs/record/offset_log.h"

#include "ftcs/record/fields.h"

namespace ftcs {
namespace {

/// The number in the first pair of brackets that holds one: "ptp4l[12.345]", "ptp4l: [12.345]"; in
/// "ptp4l[991]: [12.345.678]" as syslog writes it, the pair that holds a point.
std::optional<double> bracketed_time(std::string_view line) {
  std::size_t open = line.find('[');
  while (open != std::string_view::npos) {
    const std::size_t close = line.find(']', open);
    if (close == std::string_view::npos) return std::nullopt;
    const std::string_view inside = line.substr(open + 1, close - open - 1);
    if (inside.find('.') != std::string_view::npos) {
      if (const auto time = parse_decimal(inside)) return time;
    }
    open = line.find('[', close);
  }
  return std::nullopt;
}

std::optional<int> servo_state(std::string_view word) {
  if (word.size() != 2 || word[0] != 's' || word[1] < '0' || word[1] > '3') return std::nullopt;
  return word[1] - '0';
}

}  // namespace

std::optional<OffsetLogLine> parse_offset_log_line(std::string_view line) {
  const auto words = split_fields(line, ' ');
  for (std::size_t i = 0; i + 2 < words.size(); ++i) {
    if (words[i] != "offset") continue;
    const auto offset = parse_decimal(words[i + 1]);
    const auto state = servo_state(words[i + 2]);
    if (!offset || !state) continue;
    OffsetLogLine parsed;
    parsed.time_s = bracketed_time(line);
    parsed.offset_ns = *offset;
    parsed.state = *state;
    for (std::size_t k = i + 3; k + 1 < words.size(); ++k) {
      if (words[k] == "freq") parsed.frequency_ppb = parse_decimal(words[k + 1]);
      if (words[k] == "delay") parsed.delay_ns = parse_decimal(words[k + 1]);
    }
    return parsed;
  }
  return std::nullopt;
}

bool is_linuxptp_line(std::string_view line) {
  for (const std::string_view program : {"ptp4l", "phc2sys", "ts2phc"}) {
    const std::size_t at = line.find(program);
    if (at == std::string_view::npos) continue;
    const std::string_view rest = line.substr(at + program.size());
    if (!rest.empty() && (rest.front() == '[' || rest.front() == ':')) return true;
  }
  return false;
}

}  // namespace ftcs
