// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "ftcs/experiment/log_formats.h"
#include "ftcs/record/fields.h"

namespace ftcs::experiment {
namespace {

struct Column {
  std::string name;
  std::int64_t unit_ns = 0;  ///< 0: the name has none
};

Column parse_heading(std::string_view text) {
  std::string name(trimmed(text));
  std::transform(name.begin(), name.end(), name.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  constexpr std::array<std::pair<std::string_view, std::int64_t>, 4> kUnits = {
      {{"_ns", 1}, {"_us", 1'000}, {"_ms", 1'000'000}, {"_s", 1'000'000'000}}};
  for (const auto& [ending, unit] : kUnits) {
    if (name.ends_with(ending)) return {name.substr(0, name.size() - ending.size()), unit};
  }
  return {name, 0};
}

/// Where a quantity stands, and its unit.
struct Place {
  std::size_t index = 0;
  std::int64_t unit_ns = 1;
};

class CsvLog final : public LogFormat {
 public:
  CsvLog(std::vector<Column> columns, char separator)
      : separator_(separator), columns_(std::move(columns)) {
    two_way_ = find("t1") && find("t2") && find("t3") && find("t4");
  }

  [[nodiscard]] bool valid() const { return two_way_ || (find("time") && find("offset")); }
  [[nodiscard]] std::string name() const override { return two_way_ ? "t1..t4" : "offsets"; }
  [[nodiscard]] bool is_heading(std::string_view) const override { return true; }

  [[nodiscard]] std::string take(std::string_view line) override {
    if (line.front() == '#') return "a comment";
    fields_ = split_fields(line, separator_);
    if (fields_.size() != columns_.size()) {
      return fmt::format("expected {} fields, got {}", columns_.size(), fields_.size());
    }
    const auto truth = value("truth");
    const std::optional<double> truth_ns = truth ? std::optional(truth->ns()) : std::nullopt;
    return two_way_ ? take_exchange(truth_ns) : take_offset(truth_ns);
  }

  void finish(RecordedLog& log) override {
    log.two_way = two_way_;
    log.pairs = std::move(pairs_);
    std::string units;
    for (const Column& column : columns_) {
      const auto place = find(column.name);
      units += fmt::format("{}{} in {}", units.empty() ? "" : ", ", column.name,
                           place->unit_ns == 1           ? "ns"
                           : place->unit_ns == 1'000     ? "us"
                           : place->unit_ns == 1'000'000 ? "ms"
                                                         : "s");
    }
    log.notes.push_back("columns: " + units);
  }

 private:
  [[nodiscard]] std::optional<Place> find(std::string_view name) const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (columns_[i].name != name) continue;
      const std::int64_t usual = name == "time" ? 1'000'000'000 : 1;
      return Place{i, columns_[i].unit_ns != 0 ? columns_[i].unit_ns : usual};
    }
    return std::nullopt;
  }
  [[nodiscard]] std::optional<Duration> value(std::string_view name) const {
    const auto place = find(name);
    return place ? parse_time(fields_[place->index], place->unit_ns) : std::nullopt;
  }

  std::string take_exchange(std::optional<double> truth_ns) {
    const auto t1 = value("t1");
    const auto t2 = value("t2");
    if (!t1 || !t2) return "t1 or t2 is no number";
    pairs_.push_back({{Direction::kForward, ReferenceTime{*t1}, FreeRunningTime{*t2}}, truth_ns});
    const auto t3 = value("t3");
    const auto t4 = value("t4");
    // A Sync without an answered Delay_Req is still a Sync.
    if (!t3 || !t4) {
      const bool empty =
          is_missing(fields_[find("t3")->index]) && is_missing(fields_[find("t4")->index]);
      return empty ? "" : "t3 or t4 is no number; t1 and t2 were used";
    }
    pairs_.push_back({{Direction::kBackward, ReferenceTime{*t4}, FreeRunningTime{*t3}}, truth_ns});
    return "";
  }

  std::string take_offset(std::optional<double> truth_ns) {
    const auto time = value("time");
    const auto offset = value("offset");
    if (!time || !offset) return "time or offset is no number";
    if (!pairs_.empty() && *time <= pairs_.back().pair.reference.since_epoch())
      return "its time does not advance";
    pairs_.push_back(offset_pair(*time, *offset, truth_ns));
    return "";
  }

  char separator_;
  std::vector<Column> columns_;
  bool two_way_ = false;
  std::vector<std::string_view> fields_;
  std::vector<RecordedPair> pairs_;
};

}  // namespace

std::unique_ptr<LogFormat> detect_csv(std::string_view line) {
  const char separator = separator_of(line);
  std::vector<Column> columns;
  for (const std::string_view field : split_fields(line, separator))
    columns.push_back(parse_heading(field));
  auto format = std::make_unique<CsvLog>(std::move(columns), separator);
  if (!format->valid()) return nullptr;
  return format;
}

}  // namespace ftcs::experiment
