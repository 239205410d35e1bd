// SPDX-License-Identifier: MIT
#include "ftcs/experiment/paper_table.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "ftcs/experiment/toml_table.h"

namespace ftcs::experiment {
namespace {

constexpr Range kFraction{-0.999, 0.999};

Nanoseconds whole(Duration duration) { return Nanoseconds{duration.rounded_ns()}; }

/// The world of a row: the file's, with what the row says differently.
void read_world(TomlTable& table, sim::OneWaySpec& world) {
  if (const auto v = table.duration("interval", {1'000.0, 1e12})) world.interval = *v;
  if (const auto v = table.duration("initial_offset", kAny)) world.initial_offset = *v;
  if (const auto v = table.ratio("skew", kFraction))
    world.oscillator.parts = {sim::ConstantSkew{*v}};
  if (const auto v = table.duration("timestamp_noise", kNotNegative))
    world.timestamp_noise_ns = v->ns();
  if (const auto v = table.duration("tick", kNotNegative)) world.tick = *v;
  if (const auto v = table.ratio("rate_limit", {1e-9, 0.999})) {
    world.limits = {Rate::from_ratio(1.0 - *v), Rate::from_ratio(1.0 + *v)};
  }
}

FtcsConfig read_ftcs(TomlTable& table, const sim::OneWaySpec& world, FtcsConfig config) {
  config.sync_interval = whole(world.interval);
  config.limits = world.limits;
  if (const auto v = table.number("offset_gain", {0.0, 1.0})) config.offset_gain = *v;
  if (const auto v = table.duration("band_enter", kNotNegative)) config.converged_band.enter = *v;
  if (const auto v = table.duration("band_leave", kNotNegative)) config.converged_band.leave = *v;
  if (const auto v = table.integer("dwell", {0.0, 1e9}))
    config.converged_dwell = static_cast<std::uint32_t>(*v);
  if (const auto error = validate(config)) table.fail_here(std::string(describe(*error)));
  return config;
}

PicsConfig read_pics(TomlTable& table, const sim::OneWaySpec& world) {
  PicsConfig config;
  config.sync_interval = whole(world.interval);
  config.limits = world.limits;
  if (const auto v = table.number("proportional_gain", {0.0, 10.0})) config.proportional_gain = *v;
  if (const auto v = table.number("integral_gain", {0.0, 10.0})) config.integral_gain = *v;
  if (const auto v = table.boolean("previous_error_starts_at_zero")) {
    config.previous_error_starts_at_zero = *v;
  }
  if (const auto error = validate(config)) table.fail_here(std::string(describe(*error)));
  return config;
}

AdaptiveConfig adaptive(const sim::OneWaySpec& world) {
  AdaptiveConfig config;
  config.sync_interval = whole(world.interval);
  config.steering.rate = world.limits;
  config.fixed_path_delay = Nanoseconds{0};
  return config;
}

double number_or_nan(TomlTable& table, std::string_view key) {
  return table.number(key, kAny).value_or(kNotGiven);
}

PaperRow read_row(TomlTable table, const sim::OneWaySpec& world) {
  PaperRow row;
  row.world = world;
  read_world(table, row.world);
  const auto name = table.text("name");
  if (!name) table.fail_here("a row needs a name");
  row.name = *name;
  row.group = table.text("group").value_or("");
  row.support = table.boolean("support").value_or(false);
  row.paper_rms_ns = number_or_nan(table, "paper_rms_ns");
  row.paper_cycles = number_or_nan(table, "paper_cycles");
  row.model_rms_ns = number_or_nan(table, "model_rms_ns");
  row.note = table.text("note").value_or("");
  const auto servo = table.word("servo", {"ftcs", "pics", "adaptive"});
  if (!servo) table.fail_here("a row needs servo = \"ftcs\", \"pics\" or \"adaptive\"");
  if (*servo == "ftcs") {
    row.servo = read_ftcs(table, row.world, FtcsConfig{});
  } else if (*servo == "pics") {
    row.servo = read_pics(table, row.world);
  } else {
    row.servo = adaptive(row.world);
  }
  table.finish();
  return row;
}

const std::vector<std::pair<std::string, CheckFigure>>& check_figures() {
  static const std::vector<std::pair<std::string, CheckFigure>> names = {
      {"rms", CheckFigure::kRms},
      {"median", CheckFigure::kMedian},
      {"true_rms", CheckFigure::kTrueRms},
      {"deviation", CheckFigure::kDeviation},
      {"cycles", CheckFigure::kCycles},
      {"seed_rms", CheckFigure::kSeedRms},
      {"seed_exact", CheckFigure::kSeedExact},
      {"ratio", CheckFigure::kRatio},
      {"median_ratio", CheckFigure::kMedianRatio},
      {"spread", CheckFigure::kSpread},
      {"probability", CheckFigure::kProbability},
      {"settling_time", CheckFigure::kSettlingTime}};
  return names;
}

CheckFigure read_figure(TomlTable& table) {
  std::vector<std::string> words;
  for (const auto& [name, figure] : check_figures()) words.push_back(name);
  const auto word = table.word("figure", words);
  if (!word) table.fail_here("a check needs a figure");
  const auto found = std::find_if(check_figures().begin(), check_figures().end(),
                                  [&](const auto& entry) { return entry.first == *word; });
  return found->second;
}

void require_rows(const TomlTable& table, std::string_view key,
                  const std::vector<std::string>& wanted, const PaperTable& paper) {
  for (const auto& name : wanted) {
    const bool known = std::any_of(paper.rows.begin(), paper.rows.end(),
                                   [&](const PaperRow& row) { return row.key() == name; });
    if (!known)
      table.fail(key, fmt::format("there is no row \"{}\"", name),
                 "a row's key is \"name\" or \"name, group\"");
  }
}

PaperCheck read_check(TomlTable table, const PaperTable& paper) {
  PaperCheck check;
  check.name = table.text("name").value_or("");
  if (check.name.empty()) table.fail_here("a check needs a name");
  check.figure = read_figure(table);
  check.against = table.word("against", {"model", "paper"}).value_or("model");
  check.rows = table.texts("rows");
  check.over = table.texts("over");
  require_rows(table, "rows", check.rows, paper);
  require_rows(table, "over", check.over, paper);
  check.expected = table.numbers("expected");
  check.expect_from_row = check.expected.empty();
  if (check.expected.size() > 1 && check.expected.size() != check.rows.size()) {
    table.fail("expected", "expected must have one value, or one for each row");
  }
  check.relative_tolerance = table.ratio("tolerance", {0.0, 10.0}).value_or(kNotGiven);
  check.least = number_or_nan(table, "least");
  check.most = number_or_nan(table, "most");
  check.minus = number_or_nan(table, "minus");
  check.plus = number_or_nan(table, "plus");
  check.demanded = table.boolean("demanded").value_or(true);
  check.note = table.text("note").value_or("");
  table.finish();
  return check;
}

}  // namespace

PaperTable parse_paper_table(std::string_view text, const std::string& file) {
  TomlTable root(parse_toml_text(text, file), file);
  PaperTable paper;
  paper.table = root.text("table").value_or("");
  paper.title = root.text("title").value_or("");
  paper.first_seed = static_cast<std::uint64_t>(root.integer("first_seed", {0, 1e18}).value_or(1));
  paper.seeds = static_cast<std::uint64_t>(root.integer("seeds", {1, 1e6}).value_or(256));
  paper.published_seed =
      static_cast<std::uint64_t>(root.integer("published_seed", {0, 1e18}).value_or(1));
  paper.measure_from =
      static_cast<std::uint64_t>(root.integer("measure_from", {0, 1e9}).value_or(60));
  paper.converged_band_ns =
      root.duration("converged_band", kPositive).value_or(Nanoseconds{500}).ns();
  paper.remarks = root.texts("remarks");
  paper.figure = root.text("figure").value_or("");
  paper.figure_rows = root.texts("figure_rows");
  sim::OneWaySpec world;
  world.samples = static_cast<std::uint64_t>(root.integer("samples", {2, 1e9}).value_or(360));
  if (auto table = root.table("world")) {
    read_world(*table, world);
    table->finish();
  }
  for (auto& table : root.tables("row")) paper.rows.push_back(read_row(std::move(table), world));
  for (auto& table : root.tables("check"))
    paper.checks.push_back(read_check(std::move(table), paper));
  for (auto& table : root.tables("choice")) {
    paper.choices.push_back({table.text("parameter").value_or(""), table.text("value").value_or(""),
                             table.text("reason").value_or("")});
    table.finish();
  }
  require_rows(root, "figure_rows", paper.figure_rows, paper);
  root.finish();
  return paper;
}

}  // namespace ftcs::experiment
