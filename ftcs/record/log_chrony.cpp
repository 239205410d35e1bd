// SPDX-License-Identifier: MIT
// chrony.conf(5), log directive: columns of tracking, measurements, statistics and refclocks.log.
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "ftcs/record/fields.h"
#include "ftcs/record/log_formats.h"
#include "ftcs/time/duration.h"

namespace ftcs {
namespace {

template <std::size_t N>
std::optional<std::array<int, N>> parse_numbers(std::string_view text, char separator) {
  std::array<int, N> numbers{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto end = i + 1 < N ? text.find(separator) : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + end, numbers[i]);
    if (error != std::errc{} || stop != text.data() + end) return std::nullopt;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return numbers;
}

/// Since 1970 of "2015-10-13" and "05:40:50" or "05:40:50.000123".
std::optional<Duration> parse_date(std::string_view date, std::string_view time) {
  const auto point = std::min(time.find('.'), time.size());
  const auto ymd = parse_numbers<3>(date, '-');
  const auto hms = parse_numbers<3>(time.substr(0, point), ':');
  const auto fraction =
      point == time.size() ? Duration{} : parse_time(time.substr(point), kNsPerSecond);
  if (!ymd || !hms || !fraction) return std::nullopt;
  const std::chrono::year_month_day day{std::chrono::year{(*ymd)[0]},
                                        std::chrono::month{static_cast<unsigned>((*ymd)[1])},
                                        std::chrono::day{static_cast<unsigned>((*ymd)[2])}};
  if (!day.ok()) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days{day}.time_since_epoch().count();
  const std::int64_t seconds =
      days * 86'400 + (*hms)[0] * std::int64_t{3600} + (*hms)[1] * std::int64_t{60} + (*hms)[2];
  return Duration::from_whole_ns(seconds * kNsPerSecond) + *fraction;
}

enum class Kind : std::uint8_t { kTracking, kMeasurements, kStatistics, kRefclocks };

/// Columns of each log (from 0). Its offset is positive if the local clock is fast, or slow.
struct Layout {
  Kind kind;
  const char* name;
  const char* heading;  ///< a word of its heading that no other one has
  std::size_t columns;
  std::size_t offset;
  double offset_sign;  ///< of a clock that is fast
};
constexpr std::array<Layout, 4> kLayouts{{
    {Kind::kTracking, "chrony tracking", "Freq ppm", 11, 6, 1.0},
    {Kind::kMeasurements, "chrony measurements", "Peer del.", 12, 11, -1.0},
    {Kind::kStatistics, "chrony statistics", "Est offset", 12, 4, 1.0},
    {Kind::kRefclocks, "chrony refclocks", "Raw offset", 9, 7, -1.0},
}};
const Layout& layout_of(Kind kind) { return kLayouts[static_cast<std::size_t>(kind)]; }

struct ChronyLine {
  Duration time{};             ///< since 1970
  double offset_ns = 0.0;      ///< local minus reference, corrections under way taken as done
  double frequency_ppm = 0.0;  ///< tracking: local fast is positive
};

/// Measurements of one server or reference clock.
struct Measured {
  std::string name;
  std::vector<ChronyLine> lines;
};

class ChronyLog final : public LogFormat {
 public:
  explicit ChronyLog(Kind kind) : layout_(layout_of(kind)) {}

  [[nodiscard]] std::string name() const override { return layout_.name; }
  [[nodiscard]] bool is_heading(std::string_view line) const override {
    return !parse(split_fields(line, ' '));
  }

  [[nodiscard]] std::string take(std::string_view line) override {
    if (line.find("===") != std::string_view::npos ||
        line.find("Date (UTC)") != std::string_view::npos) {
      return "a heading";
    }
    const auto fields = split_fields(line, ' ');
    const auto parsed = parse(fields);
    if (!parsed) return "not the columns of this log";
    if (auto complaint = doubt(fields); !complaint.empty()) return complaint;
    // The steered clock is one, whatever chrony followed; measurements are of one server each.
    Measured& source = is(Kind::kTracking) ? of("") : of(fields[2]);
    if (!source.lines.empty() && parsed->time <= source.lines.back().time)
      return "its time does not advance";
    source.lines.push_back(*parsed);
    return "";
  }

  [[nodiscard]] std::string finish(RecordedLog& log, const std::string& source) override {
    if (is(Kind::kTracking)) {
      if (auto complaint = no_such_source(source, name()); !complaint.empty()) return complaint;
    }
    const Measured* const picked = pick(source);
    if (picked == nullptr)
      return fmt::format("no measurements of '{}': the log has {}", source, describe());
    log.steered = is(Kind::kTracking);
    log.source = picked->name;
    log.used = picked->lines.size();
    if (sources_.size() > 1) {
      log.notes.push_back(
          fmt::format("the log has {}: {} is taken; --source chooses", describe(), picked->name));
    }
    add_notes(log);
    add_pairs(picked->lines, log);
    return "";
  }

 private:
  [[nodiscard]] bool is(Kind kind) const { return layout_.kind == kind; }

  /// Why a line of the right form is not used, or empty.
  [[nodiscard]] std::string doubt(const std::vector<std::string_view>& fields) const {
    if (is(Kind::kTracking) && fields[7] == "?") return "chrony was not synchronised";
    if (is(Kind::kMeasurements) && (fields[5] != "111" || fields[6] != "111"))
      return "the packet failed a test of chrony";
    if (is(Kind::kRefclocks) && fields[3] == "-") return "a filtered sample: the raw ones are used";
    return "";
  }

  [[nodiscard]] std::optional<ChronyLine> parse(const std::vector<std::string_view>& fields) const {
    if (fields.size() < layout_.columns) return std::nullopt;
    const auto time = parse_date(fields[0], fields[1]);
    const auto offset = parse_decimal(fields[layout_.offset]);
    if (!time || !offset || !fits_duration(*offset * 1e9)) return std::nullopt;
    ChronyLine line{*time, layout_.offset_sign * *offset * 1e9, 0.0};
    if (!is(Kind::kTracking)) return line;
    const auto frequency = parse_decimal(fields[4]);
    constexpr double kStandstillPpm = 1e6;
    if (!frequency || std::abs(*frequency) > kStandstillPpm) return std::nullopt;
    line.frequency_ppm = *frequency;
    return line;
  }

  Measured& of(std::string_view name) {
    const auto known = std::find_if(sources_.begin(), sources_.end(),
                                    [&](const Measured& one) { return one.name == name; });
    if (known != sources_.end()) return *known;
    return sources_.emplace_back(Measured{std::string(name), {}});
  }

  [[nodiscard]] const Measured* pick(const std::string& name) const {
    const Measured* best = nullptr;
    for (const Measured& source : sources_) {
      if (!name.empty() && source.name != name) continue;
      if (best == nullptr || source.lines.size() > best->lines.size()) best = &source;
    }
    return best;
  }

  [[nodiscard]] std::string describe() const {
    std::string text;
    for (const Measured& source : sources_) {
      text += fmt::format("{}{} ({} lines)", text.empty() ? "" : ", ", source.name,
                          source.lines.size());
    }
    return text;
  }

  void add_notes(RecordedLog& log) const {
    if (!is(Kind::kRefclocks)) {
      log.replay_notes.emplace_back(
          "chrony writes whole seconds: a frequency of f ppm is wrong by up to f us an interval");
    }
    if (is(Kind::kTracking)) {
      log.replay_notes.emplace_back("the free-running clock is rebuilt from offset and frequency");
      return;
    }
    log.replay_notes.push_back(fmt::format(
        "{} of a clock that chrony steered: without its frequency the free-running clock cannot be "
        "rebuilt; use tracking.log for that",
        is(Kind::kStatistics) ? "estimates" : "measurements"));
  }

  void add_pairs(const std::vector<ChronyLine>& lines, RecordedLog& log) const {
    const Duration start = lines.front().time;
    double x_ns = lines.front().offset_ns;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (i > 0 && is(Kind::kTracking)) {
        // The offset is of a clock from which all that is still being slewed has been taken
        // already: the whole offset of the line before is gone from it, whatever remains.
        const double dt_s = (lines[i].time - lines[i - 1].time).seconds();
        x_ns += lines[i].offset_ns + lines[i - 1].frequency_ppm * 1e3 * dt_s;
      } else {
        x_ns = lines[i].offset_ns;
      }
      log.pairs.push_back(
          offset_pair(lines[i].time - start, Duration::from_ns(x_ns), lines[i].offset_ns - x_ns));
    }
  }

  const Layout& layout_;
  std::vector<Measured> sources_;
};

/// RFC 5905 tests as chrony writes them: ones and zeros.
bool is_test_word(std::string_view word, std::size_t length) {
  return word.size() == length && word.find_first_not_of("01") == std::string_view::npos;
}

}  // namespace

std::unique_ptr<LogFormat> detect_chrony(std::string_view line) {
  if (line.find("Date (UTC)") != std::string_view::npos) {
    for (const Layout& layout : kLayouts) {
      if (line.find(layout.heading) != std::string_view::npos)
        return std::make_unique<ChronyLog>(layout.kind);
    }
    return nullptr;
  }
  const auto fields = split_fields(line, ' ');
  if (fields.size() < 9 || !parse_date(fields[0], fields[1])) return nullptr;
  const auto is_number = [&](std::size_t i) { return parse_decimal(fields[i]).has_value(); };
  if (fields.size() == 9 && is_number(7)) return std::make_unique<ChronyLog>(Kind::kRefclocks);
  if (fields.size() < 11) return nullptr;
  if (fields.size() > 12 && is_test_word(fields[5], 3) && is_test_word(fields[6], 3))
    return std::make_unique<ChronyLog>(Kind::kMeasurements);
  if (!is_number(4)) return nullptr;
  // The eighth column of tracking.log is the leap status, a letter or a sign.
  return std::make_unique<ChronyLog>(is_number(7) ? Kind::kStatistics : Kind::kTracking);
}

}  // namespace ftcs
