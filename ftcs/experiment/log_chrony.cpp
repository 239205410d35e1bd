// SPDX-License-Identifier: MIT
// chrony.conf(5), log directive: columns of measurements.log and tracking.log.
#include <array>
#include <charconv>
#include <chrono>
#include <vector>

#include "ftcs/experiment/log_formats.h"
#include "ftcs/record/fields.h"

namespace ftcs::experiment {
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

/// Seconds since 1970 of "2015-10-13" and "05:40:50".
std::optional<std::int64_t> parse_date(std::string_view date, std::string_view time) {
  const auto ymd = parse_numbers<3>(date, '-');
  const auto hms = parse_numbers<3>(time, ':');
  if (!ymd || !hms) return std::nullopt;
  const std::chrono::year_month_day day{std::chrono::year{(*ymd)[0]},
                                        std::chrono::month{static_cast<unsigned>((*ymd)[1])},
                                        std::chrono::day{static_cast<unsigned>((*ymd)[2])}};
  if (!day.ok()) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days{day}.time_since_epoch().count();
  return days * 86'400 + (*hms)[0] * std::int64_t{3600} + (*hms)[1] * std::int64_t{60} + (*hms)[2];
}

struct ChronyLine {
  std::int64_t time_s = 0;
  double offset_ns = 0.0;      ///< local minus reference, corrections under way taken as done
  double frequency_ppm = 0.0;  ///< local fast: positive
};

class ChronyLog final : public LogFormat {
 public:
  explicit ChronyLog(bool tracking) : tracking_(tracking) {}

  [[nodiscard]] std::string name() const override {
    return tracking_ ? "chrony tracking" : "chrony measurements";
  }
  [[nodiscard]] bool is_heading(std::string_view line) const override { return !parse(line); }

  [[nodiscard]] std::string take(std::string_view line) override {
    if (line.find("===") != std::string_view::npos ||
        line.find("Date (UTC)") != std::string_view::npos) {
      return "a heading";
    }
    const auto parsed = parse(line);
    if (!parsed) return "not the columns of this log";
    const auto fields = split_fields(line, ' ');
    if (tracking_ && fields[7] == "?") return "chrony was not synchronised";
    if (!tracking_ && (fields[5] != "111" || fields[6] != "111"))
      return "the packet failed a test of chrony";
    if (!lines_.empty() && parsed->time_s <= lines_.back().time_s)
      return "its time does not advance";
    lines_.push_back(*parsed);
    return "";
  }

  [[nodiscard]] std::string finish(RecordedLog& log, const std::string& source) override {
    if (auto complaint = no_such_source(source, name()); !complaint.empty()) return complaint;
    if (lines_.empty()) return "";
    log.steered = tracking_;
    log.notes.emplace_back(
        "chrony writes whole seconds: a frequency of f ppm is wrong by up to f us an interval");
    log.notes.emplace_back(
        tracking_ ? "the free-running clock is rebuilt from offset and frequency"
                  : "measurements of a clock that chrony steered: without its frequency the "
                    "free-running clock cannot be rebuilt; use tracking.log for that");
    const Duration start = Duration::from_whole_ns(lines_.front().time_s * 1'000'000'000);
    double x_ns = lines_.front().offset_ns;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (i > 0 && tracking_) {
        // The offset is of a clock from which all that is still being slewed has been taken
        // already: the whole offset of the line before is gone from it, whatever remains.
        const double dt_s = static_cast<double>(lines_[i].time_s - lines_[i - 1].time_s);
        x_ns += lines_[i].offset_ns + lines_[i - 1].frequency_ppm * 1e3 * dt_s;
      } else {
        x_ns = lines_[i].offset_ns;
      }
      const Duration reference = Duration::from_whole_ns(lines_[i].time_s * 1'000'000'000) - start;
      log.pairs.push_back(
          offset_pair(reference, Duration::from_ns(x_ns), lines_[i].offset_ns - x_ns));
    }
    return "";
  }

 private:
  [[nodiscard]] std::optional<ChronyLine> parse(std::string_view line) const {
    const auto fields = split_fields(line, ' ');
    const std::size_t least = tracking_ ? 11 : 12;
    if (fields.size() < least) return std::nullopt;
    const auto time = parse_date(fields[0], fields[1]);
    if (!time) return std::nullopt;
    ChronyLine result;
    result.time_s = *time;
    if (!tracking_) {
      const auto offset = parse_decimal(fields[11]);
      if (!offset) return std::nullopt;
      result.offset_ns = -*offset * 1e9;  // positive = local slow
      return result;
    }
    const auto frequency = parse_decimal(fields[4]);
    const auto offset = parse_decimal(fields[6]);
    if (!frequency || !offset) return std::nullopt;
    result.frequency_ppm = *frequency;
    result.offset_ns = *offset * 1e9;  // positive = local fast
    return result;
  }

  bool tracking_;
  std::vector<ChronyLine> lines_;
};

/// RFC 5905 tests as chrony writes them: ones and zeros.
bool is_test_word(std::string_view word, std::size_t length) {
  return word.size() == length && word.find_first_not_of("01") == std::string_view::npos;
}

}  // namespace

std::unique_ptr<LogFormat> detect_chrony(std::string_view line) {
  if (line.find("Date (UTC)") != std::string_view::npos) {
    if (line.find("Freq ppm") != std::string_view::npos) return std::make_unique<ChronyLog>(true);
    if (line.find("Peer del.") != std::string_view::npos) return std::make_unique<ChronyLog>(false);
    return nullptr;
  }
  const auto fields = split_fields(line, ' ');
  if (fields.size() < 11 || !parse_date(fields[0], fields[1])) return nullptr;
  const bool measurements =
      fields.size() > 12 && is_test_word(fields[5], 3) && is_test_word(fields[6], 3);
  if (!measurements && !parse_decimal(fields[4])) return nullptr;
  return std::make_unique<ChronyLog>(!measurements);
}

}  // namespace ftcs::experiment
