// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "ftcs/record/fields.h"
#include "ftcs/record/log_formats.h"
#include "ftcs/record/units.h"

namespace ftcs {
namespace {

struct Column {
  std::string name;
  std::string unit;  ///< empty: the heading has none
};

/// A line in the time of the recorded clock.
struct Line {
  Duration t1{};  ///< reference
  Duration t2{};  ///< recorded clock, local
  std::optional<Duration> t3{};
  std::optional<Duration> t4{};
  std::optional<double> truth_ns{};   ///< recorded clock minus reference, at t2
  std::optional<double> frequency{};  ///< local per free running minus 1, from here on
};

/// From the time of the recorded clock to that of its oscillator: between two changes of rate the
/// oscillator advanced by (local interval) / (1 + frequency).
class Unsteered {
 public:
  explicit Unsteered(Duration start) : local_(start), free_running_(start) {}

  [[nodiscard]] Duration at(Duration local) const {
    return free_running_ + Duration::from_ns((local - local_).ns() / (1.0 + frequency_));
  }
  void change(Duration local, double frequency) {
    free_running_ = at(local);
    local_ = local;
    frequency_ = frequency;
  }

 private:
  Duration local_;
  Duration free_running_;
  double frequency_ = 0.0;
};

class CsvLog final : public LogFormat {
 public:
  CsvLog(std::vector<Column> columns, char separator)
      : separator_(separator), columns_(std::move(columns)) {
    two_way_ = find("t1") && find("t2") && find("t3") && find("t4");
    steered_ = find("freq") || find("rate") || (find("addend") && find("nominal_addend"));
  }

  [[nodiscard]] bool valid() const { return two_way_ || (find("time") && find("offset")); }
  [[nodiscard]] std::string name() const override { return two_way_ ? kExchanges : "offsets"; }
  [[nodiscard]] bool is_heading(std::string_view) const override { return true; }

  [[nodiscard]] std::string take(std::string_view text) override {
    if (text.front() == '#') return "a comment";
    fields_ = split_fields(text, separator_);
    if (fields_.size() != columns_.size())
      return fmt::format("expected {} fields, got {}", columns_.size(), fields_.size());
    Line line;
    if (const auto truth = time_in("truth")) line.truth_ns = truth->ns();
    if (steered_) {
      line.frequency = frequency();
      if (!line.frequency || !(std::abs(*line.frequency) < 0.5))
        return "its frequency is no number within +-50 %";
    }
    return two_way_ ? take_exchange(line) : take_offset(line);
  }

  [[nodiscard]] std::string finish(RecordedLog& log, const std::string& source) override {
    if (auto complaint = no_such_source(source, name()); !complaint.empty()) return complaint;
    log.two_way = two_way_;
    log.steered = steered_;
    if (lines_.empty()) return "";
    Unsteered oscillator(lines_.front().t2);
    for (const Line& line : lines_) add_pairs(line, oscillator, log);
    log.notes.push_back("columns: " + columns_text());
    if (steered_) {
      log.replay_notes.emplace_back(
          "the free-running clock is rebuilt from the applied frequency; a step of the recorded "
          "clock would be taken for one of the reference");
    }
    return "";
  }

 private:
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (columns_[i].name == name) return i;
    }
    return std::nullopt;
  }
  /// The unit of a column: by its heading, else time in s and all else in ns; frequencies in ppb.
  [[nodiscard]] std::string unit_of(std::size_t index) const {
    const Column& column = columns_[index];
    if (!column.unit.empty()) return column.unit;
    if (column.name == "time") return "s";
    return column.name == "freq" || column.name == "rate" ? "ppb" : "ns";
  }
  [[nodiscard]] std::optional<Duration> time_in(std::string_view name) const {
    const auto index = find(name);
    if (!index) return std::nullopt;
    const auto seconds = seconds_of_unit(unit_of(*index));
    if (!seconds || *seconds < 1e-9) return std::nullopt;
    return parse_time(fields_[*index], static_cast<std::int64_t>(std::llround(*seconds * 1e9)));
  }
  [[nodiscard]] std::optional<double> number_in(std::string_view name) const {
    const auto index = find(name);
    return index ? parse_decimal(fields_[*index]) : std::nullopt;
  }
  [[nodiscard]] std::optional<double> frequency() const {
    if (const auto addend = number_in("addend")) {
      const auto nominal = number_in("nominal_addend");
      return nominal && *nominal > 0.0 ? std::optional(*addend / *nominal - 1.0) : std::nullopt;
    }
    const auto index = find("freq") ? find("freq") : find("rate");
    if (!index) return std::nullopt;
    const auto value = parse_decimal(fields_[*index]);
    const auto scale = fraction_of_unit(unit_of(*index));
    return value && scale ? std::optional(*value * *scale) : std::nullopt;
  }

  std::string take_exchange(Line line) {
    const auto t1 = time_in("t1");
    const auto t2 = time_in("t2");
    if (!t1 || !t2) return "t1 or t2 is no number";
    line.t1 = *t1;
    line.t2 = *t2;
    line.t3 = time_in("t3");
    line.t4 = time_in("t4");
    lines_.push_back(line);
    if (line.t3 && line.t4) return "";
    // A Sync without an answered Delay_Req is still a Sync.
    const bool empty = is_missing(fields_[*find("t3")]) && is_missing(fields_[*find("t4")]);
    return empty ? "" : "t3 or t4 is no number; t1 and t2 were used";
  }

  std::string take_offset(Line line) {
    const auto time = time_in("time");
    const auto offset = time_in("offset");
    if (!time || !offset) return "time or offset is no number";
    if (!lines_.empty() && *time <= lines_.back().t1) return "its time does not advance";
    line.t1 = *time;
    line.t2 = *time + *offset;
    lines_.push_back(line);
    return "";
  }

  static void add_pairs(const Line& line, Unsteered& oscillator, RecordedLog& log) {
    const auto add = [&](Direction direction, Duration reference, Duration local) {
      const Duration free_running = oscillator.at(local);
      log.pairs.push_back({{direction, ReferenceTime{reference}, FreeRunningTime{free_running}},
                           std::nullopt,
                           (local - free_running).ns()});
    };
    add(Direction::kForward, line.t1, line.t2);
    RecordedPair& sync = log.pairs.back();
    if (line.truth_ns) sync.truth_ns = *line.truth_ns - sync.steering_ns;
    Duration last = line.t2;
    if (line.t3 && line.t4) {
      add(Direction::kBackward, *line.t4, *line.t3);
      last = std::max(last, *line.t3);
    }
    if (line.frequency) oscillator.change(last, *line.frequency);
  }

  [[nodiscard]] std::string columns_text() const {
    std::string text;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const bool bare = columns_[i].name.ends_with("addend");
      text += (i == 0 ? "" : ", ") + columns_[i].name + (bare ? "" : " in " + unit_of(i));
    }
    return text;
  }

  char separator_;
  std::vector<Column> columns_;
  bool two_way_ = false;
  bool steered_ = false;
  std::vector<std::string_view> fields_;
  std::vector<Line> lines_;
};

}  // namespace

std::unique_ptr<LogFormat> detect_csv(std::string_view line) {
  const char separator = separator_of(line);
  std::vector<Column> columns;
  for (const std::string_view field : split_fields(line, separator))
    columns.push_back({name_in_heading(field), unit_in_heading(field)});
  auto format = std::make_unique<CsvLog>(std::move(columns), separator);
  if (!format->valid()) return nullptr;
  return format;
}

}  // namespace ftcs
