// SPDX-License-Identifier: MIT
#include "ftcs/record/series_reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "ftcs/record/fields.h"
#include "ftcs/record/log_formats.h"
#include "ftcs/record/log_series.h"
#include "ftcs/record/time_grid.h"
#include "ftcs/record/units.h"
#include "ftcs/record/value_scale.h"

namespace ftcs {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
/// Steady, seconds-long steps are the custom of phase files without times.
constexpr double kDefaultInterval = 1.0;

/// Where a table keeps what; columns from 0.
struct TableLayout {
  char separator = ' ';
  std::vector<std::string> headings;  // empty = none
  std::size_t columns = 0;
  std::size_t value_column = 0;
  std::optional<std::size_t> time_column;
  ValueScale value_scale;
  double time_scale = 1.0;
};

bool is_comment(std::string_view line) {
  return line.empty() || line.front() == '#' || line.front() == '%' || line.front() == ';' ||
         line.starts_with("===");  // chrony rules its headings off
}

bool is_heading_of_time(std::string_view heading) {
  const std::string word = lower_case(heading);
  if (word == "t") return true;
  constexpr std::array<std::string_view, 5> kNames = {"time", "timestamp", "date", "epoch", "mjd"};
  return std::any_of(kNames.begin(), kNames.end(), [&word](std::string_view known) {
    if (!word.starts_with(known)) return false;
    return word.size() == known.size() ||
           std::isalpha(static_cast<unsigned char>(word[known.size()])) == 0;
  });
}

/// "3" or a heading, as an index from 0; npos = there is none.
std::size_t find_column(const TableLayout& layout, const std::string& wanted) {
  for (std::size_t i = 0; i < layout.headings.size(); ++i) {
    if (layout.headings[i] == wanted) return i;
  }
  std::size_t number = 0;
  const auto [end, code] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (code != std::errc() || end != wanted.data() + wanted.size()) return std::string::npos;
  return number >= 1 && number <= layout.columns ? number - 1 : std::string::npos;
}

std::string no_such_column(const TableLayout& layout, const std::string& wanted) {
  std::string message = "there is no column " + quoted_excerpt(wanted) + ": expected 1 to " +
                        std::to_string(layout.columns);
  for (std::size_t i = 0; i < layout.headings.size(); ++i) {
    message += (i == 0 ? " or " : ", ") + quoted_excerpt(layout.headings[i]);
  }
  return message;
}

class TableReader {
 public:
  TableReader(LineReader& reader, const SeriesOptions& options, Series& series)
      : reader_(reader), options_(options), series_(series) {}

  /// The first line that is no comment: heading or data.
  std::optional<ReadError> begin(std::string_view line) {
    layout_.separator = separator_of(line);
    const auto fields = split_fields(line, layout_.separator);
    layout_.columns = fields.size();
    const bool heading = std::none_of(fields.begin(), fields.end(), [](std::string_view field) {
      return parse_decimal(field).has_value();
    });
    const bool words = std::any_of(fields.begin(), fields.end(),
                                   [](std::string_view field) { return !is_missing(field); });
    if (heading && words) layout_.headings.assign(fields.begin(), fields.end());
    if (auto error = choose_columns()) return error;
    return layout_.headings.empty() ? add(line) : std::nullopt;
  }

  std::optional<ReadError> add(std::string_view line) {
    const auto fields = split_fields(line, layout_.separator);
    const std::size_t needed = std::max(layout_.value_column, layout_.time_column.value_or(0)) + 1;
    if (fields.size() < needed) {
      return reader_.error_here("expected at least " + std::to_string(needed) + " columns, got " +
                                std::to_string(fields.size()) + " (a truncated line?)");
    }
    if (layout_.time_column) {
      if (auto error = add_time(fields[*layout_.time_column])) return error;
    }
    const std::string_view field = fields[layout_.value_column];
    const auto value = parse_decimal(field);
    if (!value && !is_missing(field)) {
      return reader_.error_here("expected a finite number in column " +
                                std::to_string(layout_.value_column + 1) + ", got " +
                                quoted_excerpt(field));
    }
    raw.values.push_back(value ? (*value - layout_.value_scale.origin) * layout_.value_scale.factor
                               : kMissing);
    return std::nullopt;
  }

  RawSeries raw;

 private:
  std::optional<ReadError> choose_columns() {
    const auto& headings = layout_.headings;
    if (options_.time_column.empty()) {
      const auto known = std::find_if(headings.begin(), headings.end(), is_heading_of_time);
      if (known != headings.end()) {
        layout_.time_column = static_cast<std::size_t>(known - headings.begin());
      } else if (headings.empty() && layout_.columns > 1) {
        layout_.time_column = 0;
      }
    } else if (options_.time_column != "none") {
      layout_.time_column = find_column(layout_, options_.time_column);
      if (*layout_.time_column == std::string::npos) {
        return reader_.error_here(no_such_column(layout_, options_.time_column));
      }
    }
    if (options_.column.empty()) {
      layout_.value_column = layout_.time_column == std::size_t{0} && layout_.columns > 1 ? 1 : 0;
    } else {
      layout_.value_column = find_column(layout_, options_.column);
      if (layout_.value_column == std::string::npos) {
        return reader_.error_here(no_such_column(layout_, options_.column));
      }
    }
    if (layout_.time_column == layout_.value_column) layout_.time_column.reset();
    return choose_scales();
  }

  std::optional<ReadError> choose_scales() {
    const std::string heading =
        layout_.headings.empty() ? std::string() : layout_.headings[layout_.value_column];
    series_.kind = kind_of(options_, heading);
    series_.notes.push_back("values from column " + std::to_string(layout_.value_column + 1) +
                            (heading.empty() ? "" : " " + quoted_excerpt(heading)) + " of " +
                            std::to_string(layout_.columns));
    const auto scale = choose_scale(options_, series_.kind, heading);
    if (!scale) return reader_.error_here(scale.error());
    series_.notes.push_back(scale->note);
    layout_.value_scale = *scale;
    if (!layout_.time_column) return std::nullopt;
    std::string unit = options_.time_unit;
    if (unit.empty() && !layout_.headings.empty()) {
      unit = unit_in_heading(layout_.headings[*layout_.time_column]);
    }
    const auto seconds = seconds_of_unit(unit.empty() ? "s" : unit);
    if (!seconds) {
      return reader_.error_here("the unit of times is one of s, ms, us, ns, ps, d, got " +
                                quoted_excerpt(unit));
    }
    layout_.time_scale = *seconds;
    series_.notes.push_back("times from column " + std::to_string(*layout_.time_column + 1) +
                            " in " + (unit.empty() ? "s" : unit));
    return std::nullopt;
  }

  std::optional<ReadError> add_time(std::string_view field) {
    const auto time = parse_decimal(field);
    if (!time) {
      return reader_.error_here("expected a time in column " +
                                std::to_string(*layout_.time_column + 1) + ", got " +
                                quoted_excerpt(field));
    }
    // The origin is taken off before the unit is applied, so that epochs keep their digits.
    if (raw.times.empty()) origin_ = *time;
    const double seconds = (*time - origin_) * layout_.time_scale;
    if (!raw.times.empty() && seconds < raw.times.back()) {
      return reader_.error_here("expected ascending times in column " +
                                std::to_string(*layout_.time_column + 1) + ", got " +
                                quoted_excerpt(field) +
                                " after a later one (--time-column none ignores them)");
    }
    raw.times.push_back(seconds);
    return std::nullopt;
  }

  LineReader& reader_;
  const SeriesOptions& options_;
  Series& series_;
  TableLayout layout_;
  double origin_ = 0.0;
};

/// What is set for tables alone, by its flag; empty: nothing.
std::string without_effect(const SeriesOptions& options) {
  if (!options.column.empty()) return "--column";
  if (!options.time_column.empty()) return "--time-column";
  if (!options.time_unit.empty()) return "--time-unit";
  if (!options.unit.empty()) return "--unit";
  if (options.nominal_hz) return "--nominal";
  return options.kind == RecordKind::kFrequency ? "--kind frequency" : "";
}

/// The offsets of the clock that a log is about; empty if no line has any. Or what is wrong with
/// the whole.
Result<RawSeries, std::string> read_log(LogReader& reader, const SeriesOptions& options,
                                        Series& series) {
  series.kind = options.kind.value_or(RecordKind::kOffset);
  if (reader.empty()) return RawSeries{};
  const auto log = reader.finish(options.source);
  if (!log) return log.error();
  if (const std::string flag = without_effect(options); !flag.empty()) {
    return flag + " is for tables: a log of " + log->format +
           " has columns and units of its own, and gives offsets";
  }
  if (!log->summaries.empty()) {
    return log->source +
           " wrote summaries alone (rms, max), which hold no single offsets: its summary interval "
           "must be that of Sync";
  }
  series.lines_left_out = log->unusable;
  series.notes.push_back("a log of " + log->format +
                         ": offsets of the recorded clock, local minus reference");
  series.notes.insert(series.notes.end(), log->notes.begin(), log->notes.end());
  if (log->locked_from > 0) {
    series.notes.push_back(std::to_string(log->locked_from) +
                           " offsets before the servo locked (s2) are left out");
  }
  return offsets_of(*log);
}

/// From raw values to the grid, and the last checks.
std::optional<ReadError> finish(RawSeries raw, const SeriesOptions& options,
                                const LineReader& reader, Series& series) {
  ReadError whole = reader.error_here("");
  whole.line = 0;
  const bool any = std::any_of(raw.values.begin(), raw.values.end(),
                               [](double value) { return std::isfinite(value); });
  if (!any) {
    whole.message = reader.line_number() == 0
                        ? "the file is empty: expected numbers or a log of linuxptp"
                        : "expected numbers or offsets of a log, got none in " +
                              std::to_string(reader.line_number()) + " lines";
    return whole;
  }
  whole.message = suspicion_of_hertz(raw.values, series.kind, options);
  if (!whole.message.empty()) return whole;
  if (raw.times.size() == raw.values.size()) {
    auto grid = place_on_grid(raw.values, raw.times, options.interval_s);
    if (!grid) {
      whole.message = grid.error().message;
      return whole;
    }
    series.values = std::move(grid->values);
    series.interval_s = grid->interval_s;
    if (grid->crowded > 0) {
      series.notes.push_back(std::to_string(grid->crowded) +
                             " values came less than half an interval after the one before");
    }
  } else {
    series.values = std::move(raw.values);
    series.interval_s = options.interval_s.value_or(kDefaultInterval);
    if (!options.interval_s)
      series.notes.emplace_back("no times: an interval of 1 s is assumed; --interval sets it");
  }
  series.samples =
      static_cast<std::size_t>(std::count_if(series.values.begin(), series.values.end(),
                                             [](double value) { return std::isfinite(value); }));
  series.missing = series.values.size() - series.samples;
  return std::nullopt;
}

}  // namespace

const char* name(RecordKind kind) noexcept {
  switch (kind) {
    case RecordKind::kPhase:
      return "phase";
    case RecordKind::kFrequency:
      return "frequency";
    case RecordKind::kOffset:
      return "offset";
  }
  return "unknown";
}

Result<Series, ReadError> read_series(const std::string& path, const SeriesOptions& options) {
  auto opened = LineReader::open(path);
  if (!opened) return opened.error();
  LineReader& reader = *opened;
  Series series;
  TableReader table(reader, options, series);
  LogReader log;
  enum class Format { kUnknown, kTable, kLog } format = Format::kUnknown;
  while (const auto line = reader.next()) {
    const std::string_view text = trimmed(*line);
    if (is_comment(text)) continue;
    std::optional<ReadError> error;
    if (format == Format::kUnknown) {
      // A column that is asked for by name is one of a table, also of a table of stamps.
      const bool from_log = begins_log(text) && options.column.empty();
      format = from_log ? Format::kLog : Format::kTable;
      if (!from_log) error = table.begin(text);
    } else if (format == Format::kTable) {
      error = table.add(text);
    }
    if (format == Format::kLog) log.add(text, reader.line_number());
    if (error) return *error;
  }
  if (reader.error()) return *reader.error();
  RawSeries raw = std::move(table.raw);
  if (format == Format::kLog) {
    auto read = read_log(log, options, series);
    if (!read) return ReadError{path, 0, read.error()};
    raw = std::move(*read);
  }
  if (auto error = finish(std::move(raw), options, reader, series)) return *error;
  return series;
}

}  // namespace ftcs
