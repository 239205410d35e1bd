// SPDX-License-Identifier: MIT
#include "ftcs/experiment/scenario.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "ftcs/experiment/scenario_servos.h"
#include "ftcs/experiment/scenario_world.h"
#include "ftcs/experiment/toml_table.h"

namespace ftcs::experiment {
namespace {

/// Cells of an oscillator's frequency in one interval, unless [clock] says otherwise.
constexpr double kCellsPerInterval = 8.0;

Duration read_interval(TomlTable& root) {
  auto run = root.table("run");
  if (!run) root.fail_here("a scenario needs a [run] table", "at least sync_interval and cycles");
  const auto interval = run->duration("sync_interval", {1'000.0, 1e15});
  if (!interval) run->fail_here("[run] needs sync_interval, for example \"1 s\"");
  return *interval;
}

/// PTP tells its intervals as 2^n seconds (IEEE 1588-2019, 7.7.2.1).
void require_power_of_two(const TomlTable& root, Duration interval) {
  const double exponent = std::log2(interval.seconds());
  if (exponent == std::round(exponent) && std::abs(exponent) <= 7.0) return;
  root.fail("run", "network = \"ptp\" needs a sync_interval of 2^n seconds, -7 <= n <= 7",
            "for example \"1 s\" or \"125 ms\"");
}

void read_run(TomlTable& root, Scenario& scenario) {
  TomlTable run = *root.table("run");
  (void)run.duration("sync_interval", {1'000.0, 1e15});
  const auto cycles = run.integer("cycles", {1.0, 1e12});
  if (!cycles) run.fail_here("[run] needs cycles");
  sim::TwoWaySpec& world = scenario.world;
  MeasurementPlan& plan = scenario.plan;
  world.cycles = static_cast<std::uint64_t>(*cycles);
  world.truth_per_cycle =
      static_cast<int>(run.integer("truth_per_cycle", {1.0, 1000.0}).value_or(8));
  world.interval_spread = run.number("interval_spread", {1.0, 1e3}).value_or(1.0);
  world.random_phase = run.boolean("random_phase").value_or(true);
  if (const auto v = run.duration("response_delay", {0.0, 1e12})) world.response_delay = *v;
  const auto total = static_cast<double>(*cycles);
  plan.from_cycle = run.number("measure_from", {0.0, total}).value_or(total / 2.0);
  plan.to_cycle = run.number("measure_to", {plan.from_cycle, total}).value_or(total);
  if (const auto v = run.duration("converged_band", kPositive)) plan.converged_band_ns = v->ns();
  plan.converged_dwell_cycles =
      run.number("converged_dwell", {0.0, total}).value_or(std::min(60.0, total));
  if (const auto v = run.duration("event", {0.0, 1e18})) plan.event_s = v->seconds();
  plan.at_samples = run.word("measure", {"cycle", "samples"}).value_or("cycle") == "samples";
  scenario.first_seed =
      static_cast<std::uint64_t>(run.integer("first_seed", {0.0, 1e18}).value_or(1));
  scenario.seeds = static_cast<std::uint64_t>(run.integer("seeds", {1.0, 1e6}).value_or(20));
  scenario.fresh_seeds =
      static_cast<std::uint64_t>(run.integer("fresh_seeds", {1.0, 1e6}).value_or(0));
  run.finish();
}

void read_world(TomlTable& root, Scenario& scenario) {
  sim::NodeSpec node;
  node.oscillator.grid = Duration::from_ns(scenario.world.interval.ns() / kCellsPerInterval);
  if (auto clock = root.table("clock")) {
    read_clock(*clock, node);
    node.discipline.step = read_step_policy(*clock);
    clock->finish();
  } else {
    node.limits = {Rate::from_ratio(0.97), Rate::from_ratio(1.03)};
  }
  if (auto path = root.table("path")) {
    read_path(*path, node);
    path->finish();
  }
  std::int64_t hops = 1;
  if (auto chain = root.table("chain")) {
    hops = chain->integer("hops", {1.0, 1000.0}).value_or(1);
    chain->finish();
  }
  if (auto reference = root.table("reference")) {
    if (const auto v = reference->duration("tick", {0.0, 1e12})) scenario.world.reference_tick = *v;
    for (auto& step : reference->tables("step")) {
      const auto at = step.duration("at", {0.0, 1e18});
      const auto size = step.duration("size", kAny);
      if (!at || !size) step.fail_here("a step of the reference needs at and size");
      scenario.world.reference_steps.push_back({*at, *size});
      step.finish();
    }
    reference->finish();
  }
  scenario.world.nodes.assign(static_cast<std::size_t>(hops), node);
}

FigureLimit read_figure_limit(TomlTable bounds, const FigureName& figure) {
  FigureLimit limit;
  limit.figure = &figure;
  const auto bound = [&](std::string_view key) {
    if (figure.is_time) {
      const auto value = bounds.duration(key, kAny);
      return value ? value->ns() : FigureLimit::kNoLimit;
    }
    return bounds.number(key, kAny).value_or(FigureLimit::kNoLimit);
  };
  limit.median = bound("median");
  limit.worst = bound("worst");
  limit.within = bound("within");
  limit.least = bound("least");
  constexpr Range kFactor{1e-3, 1e6};
  limit.median_of_bound = bounds.number("median_of_bound", kFactor).value_or(FigureLimit::kNoLimit);
  limit.worst_of_bound = bounds.number("worst_of_bound", kFactor).value_or(FigureLimit::kNoLimit);
  if (bounds.has("share")) limit.share = bounds.ratio("share", {0.0, 1.0}).value_or(1.0);
  if (limit.within == limit.within && !(limit.share == limit.share)) {
    bounds.fail("within", "within needs a share", "for example share = \"95 %\"");
  }
  bounds.finish();
  return limit;
}

void read_limits(TomlTable& root, Scenario& scenario) {
  for (auto& table : root.tables("limit")) {
    ScenarioLimit limit;
    const auto servo = table.text("servo");
    if (!servo) table.fail_here("a limit needs a servo");
    limit.servo = *servo;
    const bool known = std::any_of(scenario.servos.begin(), scenario.servos.end(),
                                   [&](const ScenarioServo& s) { return s.name == *servo; });
    if (!known) table.fail("servo", fmt::format("the scenario has no servo \"{}\"", *servo));
    const bool again = std::any_of(scenario.limits.begin(), scenario.limits.end(),
                                   [&](const ScenarioLimit& l) { return l.servo == *servo; });
    if (again) {
      table.fail("servo", fmt::format("\"{}\" has a limit already", *servo),
                 "one [[limit]] holds all its figures");
    }
    const bool has_bound = std::any_of(scenario.servos.begin(), scenario.servos.end(),
                                       [](const ScenarioServo& s) { return is_bound(s.name); });
    limit.required = table.boolean("required").value_or(true);
    limit.note = table.text("note").value_or("");
    for (const FigureName& figure : figure_names()) {
      if (auto bounds = table.table(figure.name)) {
        limit.figures.push_back(read_figure_limit(std::move(*bounds), figure));
        const FigureLimit& read = limit.figures.back();
        const bool relative = read.median_of_bound == read.median_of_bound ||
                              read.worst_of_bound == read.worst_of_bound;
        if (relative && !has_bound) {
          table.fail(figure.name, "a limit of the bound needs a world that has one",
                     "[bound] sets its noise");
        }
      }
    }
    table.finish();
    scenario.limits.push_back(std::move(limit));
  }
}

Scenario read_scenario(TomlTable root, const std::string& file, const std::string& name) {
  Scenario scenario;
  scenario.file = file;
  scenario.name = name;
  scenario.title = root.text("title").value_or(name);
  scenario.network = root.word("network", {"two-way", "one-way", "ptp"}).value_or("two-way");
  const auto delay = root.word("delay", {"e2e", "p2p"});
  if (delay && scenario.network != "ptp") {
    root.fail("delay", "delay says how PTP ports measure it", "for network = \"ptp\" only");
  }
  scenario.world.peer_to_peer = delay == "p2p";
  scenario.notes = root.texts("notes");
  scenario.world.two_way = scenario.network != "one-way";
  scenario.world.interval = read_interval(root);
  root.set_cycle(scenario.world.interval);
  if (scenario.network == "ptp") require_power_of_two(root, scenario.world.interval);
  read_run(root, scenario);
  read_world(root, scenario);
  read_servos(root, scenario);
  read_limits(root, scenario);
  root.finish();
  return scenario;
}

/// One assignment of a grid: a dotted key and the value it gets.
struct GridChoice {
  std::string key;
  const toml::node* value;
};

void assign(toml::table& root, const GridChoice& choice, const TomlTable& grid) {
  toml::table* table = &root;
  std::string_view rest = choice.key;
  for (auto dot = rest.find('.'); dot != std::string_view::npos; dot = rest.find('.')) {
    const auto part = rest.substr(0, dot);
    if (!table->contains(part)) table->insert(part, toml::table{});
    table = table->get(part)->as_table();
    if (table == nullptr)
      grid.fail(choice.key, fmt::format("{} does not lead through tables", choice.key));
    rest.remove_prefix(dot + 1);
  }
  table->insert_or_assign(rest, *choice.value);
}

std::string value_text(const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) return *text;
  if (const auto whole = node.value_exact<std::int64_t>()) return fmt::format("{}", *whole);
  if (const auto number = node.value<double>()) return fmt::format("{}", *number);
  return node.value<bool>().value_or(false) ? "true" : "false";
}

}  // namespace

std::vector<Scenario> parse_scenarios(std::string_view text, const std::string& file) {
  const std::string stem = std::filesystem::path(file).stem().string();
  toml::table tree = parse_toml_text(text, file);
  const toml::table* grid = tree["grid"].as_table();
  if (grid == nullptr) return {read_scenario(TomlTable(std::move(tree), file), file, stem)};

  std::vector<std::vector<GridChoice>> points = {{}};
  const TomlTable names(tree, file);
  for (const auto& [key, values] : *grid) {
    const toml::array* array = values.as_array();
    if (array == nullptr || array->empty())
      names.fail_here(fmt::format("[grid] {} must be a list of values", key.str()));
    std::vector<std::vector<GridChoice>> next;
    for (const auto& point : points) {
      for (const toml::node& value : *array) {
        next.push_back(point);
        next.back().push_back({std::string(key.str()), &value});
      }
    }
    points = std::move(next);
  }
  std::vector<Scenario> scenarios;
  for (const auto& point : points) {
    toml::table variant = tree;
    variant.erase("grid");
    std::string name = stem;
    for (const auto& choice : point) {
      assign(variant, choice, names);
      name += fmt::format(" {}={}", choice.key, value_text(*choice.value));
    }
    scenarios.push_back(read_scenario(TomlTable(std::move(variant), file), file, name));
  }
  return scenarios;
}

std::vector<Scenario> load_scenarios(const std::string& path) {
  return parse_scenarios(read_text_file(path), path);
}

}  // namespace ftcs::experiment
