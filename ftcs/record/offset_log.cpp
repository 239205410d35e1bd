// SPDX-License-Identifier: MIT
#include "ftcs/record/offset_log.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ftcs/record/fields.h"

namespace ftcs {
namespace {

constexpr std::array<std::string_view, 4> kPrograms = {"ptp4l", "phc2sys", "ts2phc", "ftcs"};

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

std::string_view program_of(std::string_view line) {
  for (const std::string_view program : kPrograms) {
    if (line.find(program) != std::string_view::npos) return program;
  }
  return "ptp4l";  // the form is ptp4l's where nobody signs
}

/// The words between the time in brackets and "offset" or "rms", less those that every line has: a
/// clock's name ("CLOCK_REALTIME phc offset", "eth0 master offset") or a message tag ("[eth1]
/// master").
std::string clock_of(const std::vector<std::string_view>& words, std::size_t offset_at) {
  std::string clock;
  for (std::size_t i = offset_at; i-- > 0;) {
    const std::string_view word = words[i];
    if (word == "master" || word == "phc" || word == "sys" || word == "time") continue;
    const bool ends_the_prefix =
        word.ends_with(':') || (word.starts_with('[') && bracketed_time(word).has_value());
    if (ends_the_prefix || clock.size() > 40) break;
    clock.insert(0, " " + std::string(word));
  }
  return clock;
}

/// A clock that loses as much stands still.
constexpr double kStandstillPpb = 1e9;
constexpr const char* kDoesNotFit = "a number that is too large for a clock";

bool fits(std::optional<double> time_s, double offset_ns, double frequency_ppb) {
  return fits_duration(offset_ns) && fits_duration(time_s.value_or(0.0) * 1e9) &&
         std::abs(frequency_ppb) <= kStandstillPpb;
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
    parsed.source = std::string(program_of(line)) + clock_of(words, i);
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

std::optional<SummaryLogLine> parse_summary_log_line(std::string_view line) {
  const auto words = split_fields(line, ' ');
  for (std::size_t i = 0; i + 5 < words.size(); ++i) {
    if (words[i] != "rms" || words[i + 2] != "max" || words[i + 4] != "freq") continue;
    const auto rms = parse_decimal(words[i + 1]);
    const auto largest = parse_decimal(words[i + 3]);
    const auto frequency = parse_decimal(words[i + 5]);
    if (!rms || !largest || !frequency) continue;
    const bool spread_follows = i + 7 < words.size() && words[i + 6] == "+/-";
    const auto spread = spread_follows ? parse_decimal(words[i + 7]) : std::nullopt;
    return SummaryLogLine{std::string(program_of(line)) + clock_of(words, i),
                          bracketed_time(line),
                          *rms,
                          *largest,
                          *frequency,
                          spread};
  }
  return std::nullopt;
}

std::string OffsetLog::add(std::string_view line) {
  if (auto parsed = parse_offset_log_line(line)) {
    if (!fits(parsed->time_s, parsed->offset_ns, parsed->frequency_ppb.value_or(0.0)))
      return kDoesNotFit;
    source(parsed->source).lines.push_back(std::move(*parsed));
    return "";
  }
  if (auto parsed = parse_summary_log_line(line)) {
    if (!fits(parsed->time_s, std::max(std::abs(parsed->rms_ns), std::abs(parsed->max_ns)),
              parsed->frequency_ppb)) {
      return kDoesNotFit;
    }
    source(parsed->source).summaries.push_back(std::move(*parsed));
    return "";
  }
  return "no offset in it";
}

OffsetLog::Source& OffsetLog::source(const std::string& name) {
  const auto known = std::find_if(sources_.begin(), sources_.end(),
                                  [&](const Source& one) { return one.name == name; });
  if (known != sources_.end()) return *known;
  return sources_.emplace_back(Source{name, {}, {}});
}

const OffsetLog::Source* OffsetLog::pick(std::string_view name) const noexcept {
  const Source* best = nullptr;
  for (const Source& source : sources_) {
    if (!name.empty() && source.name != name) continue;
    const auto rank = [](const Source& one) {
      return std::pair{one.lines.size(), one.summaries.size()};
    };
    if (best == nullptr || rank(source) > rank(*best)) best = &source;
  }
  return best;
}

std::string OffsetLog::describe_sources() const {
  std::string text;
  for (const Source& source : sources_) {
    text += (text.empty() ? "" : ", ") + source.name + " (" +
            std::to_string(source.lines.size() + source.summaries.size()) +
            (source.lines.empty() ? " summaries)" : " lines)");
  }
  return text;
}

bool is_linuxptp_line(std::string_view line) {
  for (const std::string_view program : kPrograms) {
    const std::size_t at = line.find(program);
    if (at == std::string_view::npos) continue;
    const std::string_view rest = line.substr(at + program.size());
    if (!rest.empty() && (rest.front() == '[' || rest.front() == ':')) return true;
  }
  return false;
}

}  // namespace ftcs
