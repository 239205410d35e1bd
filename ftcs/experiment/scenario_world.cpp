// SPDX-License-Identifier: MIT
#include "ftcs/experiment/scenario_world.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "ftcs/experiment/number_file.h"

namespace ftcs::experiment {
namespace {

constexpr Range kFrequency{-0.5, 0.5};
constexpr Range kAmount{0.0, 0.5};
constexpr Range kProbability{0.0, 1.0};
constexpr Range kUtilisation{0.0, 0.99};

void read_steps_of_frequency(TomlTable& table, std::vector<sim::FrequencyPart>& parts) {
  for (auto& step : table.tables("frequency_step")) {
    const auto at = step.duration("at", kNotNegative);
    const auto size = step.ratio("size", kFrequency);
    if (!at || !size) step.fail_here("a frequency step needs at and size");
    parts.emplace_back(sim::FrequencyStep{at->seconds(), *size});
    step.finish();
  }
}

void read_periodic(TomlTable& table, std::vector<sim::FrequencyPart>& parts) {
  if (auto sine = table.table("sine")) {
    sim::FrequencySine part;
    part.amplitude = sine->ratio("amplitude", kAmount).value_or(0.0);
    part.period_seconds =
        sine->duration("period", kPositive).value_or(Nanoseconds{1'000'000'000}).seconds();
    part.random_phase = sine->boolean("random_phase").value_or(true);
    parts.emplace_back(part);
    sine->finish();
  }
  if (auto square = table.table("square")) {
    sim::FrequencySquare part;
    part.amplitude = square->ratio("amplitude", kAmount).value_or(0.0);
    part.half_period_seconds =
        square->duration("half_period", kPositive).value_or(Nanoseconds{1'000'000'000}).seconds();
    part.random_phase = square->boolean("random_phase").value_or(true);
    parts.emplace_back(part);
    square->finish();
  }
  if (auto ramp = table.table("ramp")) {
    sim::FrequencyRamp part;
    part.from_seconds = ramp->duration("from", kNotNegative).value_or(Duration{}).seconds();
    part.to_seconds =
        ramp->duration("to", kPositive).value_or(Nanoseconds{1'000'000'000}).seconds();
    part.deviation = ramp->ratio("size", kFrequency).value_or(0.0);
    if (part.to_seconds <= part.from_seconds) ramp->fail("to", "a ramp must end after it began");
    parts.emplace_back(part);
    ramp->finish();
  }
}

void read_replay(TomlTable& table, std::vector<sim::FrequencyPart>& parts) {
  auto replay = table.table("replay");
  if (!replay) return;
  const auto file = replay->text("file");
  const auto interval = replay->duration("interval", kPositive);
  const auto kind = replay->word("kind", {"phase", "frequency"});
  if (!file || !interval || !kind) replay->fail_here("a replay needs file, interval and kind");
  auto values = read_number_file(replay->beside(*file));
  if (values.size() < 2) replay->fail("file", "a replay needs at least two values");
  if (*kind == "phase") {
    parts.emplace_back(sim::replay_phase(values, interval->seconds()));
  } else {
    parts.emplace_back(sim::ReplayedFrequency{
        interval->seconds(), std::make_shared<const std::vector<double>>(std::move(values))});
  }
  replay->finish();
}

/// One column of delays, or two of delay and weight, in `unit` of [path] jitter.
struct DelayTable {
  std::vector<double> values_ns;
  std::vector<double> weights;
};

DelayTable read_delay_table(TomlTable& jitter, bool weighted) {
  const auto file = jitter.text("file");
  if (!file) jitter.fail_here("jitter from a file needs file");
  const double unit_ns = jitter.duration("unit", kPositive).value_or(Nanoseconds{1}).ns();
  const auto numbers = read_number_file(jitter.beside(*file), weighted ? 2 : 1);
  DelayTable table;
  for (std::size_t i = 0; i < numbers.size(); i += weighted ? 2 : 1) {
    table.values_ns.push_back(numbers[i] * unit_ns);
    if (weighted) table.weights.push_back(numbers[i + 1]);
  }
  if (table.values_ns.empty()) jitter.fail("file", "there are no delays in it");
  return table;
}

/// What is longer than the shortest of the record: the constant part is [path] delay.
std::vector<double> above_least(std::vector<double> values_ns) {
  const double least = *std::min_element(values_ns.begin(), values_ns.end());
  for (double& value : values_ns) value -= least;
  return values_ns;
}

sim::Jitter read_histogram(TomlTable& jitter) {
  DelayTable table = read_delay_table(jitter, true);
  double sum = 0.0;
  for (const double weight : table.weights) {
    if (weight < 0.0) jitter.fail("file", "a weight is negative");
    sum += weight;
  }
  if (!(sum > 0.0)) jitter.fail("file", "the weights are all zero");
  std::vector<double> cumulative;
  double reached = 0.0;
  for (const double weight : table.weights) cumulative.push_back((reached += weight) / sum);
  return sim::HistogramJitter{
      std::make_shared<const std::vector<double>>(above_least(std::move(table.values_ns))),
      std::make_shared<const std::vector<double>>(std::move(cumulative))};
}

sim::Jitter read_jitter(TomlTable jitter) {
  const auto kind = jitter.word("kind", {"none", "gaussian", "exponential", "gamma", "bimodal",
                                         "pareto", "file", "histogram"});
  if (!kind) jitter.fail_here("jitter needs a kind");
  const auto ns = [&](std::string_view key) {
    const auto value = jitter.duration(key, kNotNegative);
    if (!value) jitter.fail_here("jitter of this kind needs " + std::string(key));
    return value->ns();
  };
  sim::Jitter result;
  if (*kind == "gaussian") result = sim::GaussianJitter{ns("sigma")};
  if (*kind == "exponential") result = sim::ExponentialJitter{ns("mean")};
  if (*kind == "gamma") {
    const double shape = jitter.number("shape", {1e-3, 1e6}).value_or(1.0);
    result = sim::GammaJitter{shape, ns("scale")};
  }
  if (*kind == "pareto") {
    const double shape = jitter.number("shape", {0.1, 1e3}).value_or(2.0);
    result = sim::ParetoJitter{shape, ns("scale")};
  }
  if (*kind == "bimodal") {
    const double probability = jitter.ratio("probability", kProbability).value_or(0.5);
    const double extra = ns("extra");
    result = sim::BimodalJitter{probability, extra, ns("sigma")};
  }
  if (*kind == "file") {
    result = sim::RecordedJitter{std::make_shared<const std::vector<double>>(
        above_least(read_delay_table(jitter, false).values_ns))};
  }
  if (*kind == "histogram") result = read_histogram(jitter);
  jitter.finish();
  return result;
}

sim::LoadChange read_load_change(TomlTable change) {
  const auto kind = change.word("kind", {"step", "square", "ramp", "on-off"});
  const auto to = change.ratio("to", kUtilisation);
  if (!kind || !to) change.fail_here("a change of the load needs kind and to");
  sim::LoadChange result;
  result.to = *to;
  const auto seconds = [&](std::string_view key) {
    const auto value = change.duration(key, kPositive);
    if (!value) change.fail_here("a change of this kind needs " + std::string(key));
    return value->seconds();
  };
  if (*kind == "on-off") {
    result.kind = sim::LoadChange::Kind::kOnOff;
    result.mean_idle_s = seconds("mean_idle");
    result.mean_busy_s = seconds("mean_busy");
  } else {
    result.kind = *kind == "step"     ? sim::LoadChange::Kind::kStep
                  : *kind == "square" ? sim::LoadChange::Kind::kSquare
                                      : sim::LoadChange::Kind::kRamp;
    result.period_s = seconds(*kind == "step" ? "at" : "period");
  }
  change.finish();
  return result;
}

sim::QueueingLoad read_queue(TomlTable load) {
  sim::QueueingLoad queue;
  queue.utilisation = load.ratio("utilisation", kUtilisation).value_or(0.0);
  queue.service_ns = load.duration("service", kPositive).value_or(Nanoseconds{12'000}).ns();
  queue.hops = static_cast<int>(load.integer("hops", {1.0, 100.0}).value_or(1));
  const auto traffic =
      load.word("traffic", {"full-frames", "g8261-1", "g8261-2"}).value_or("full-frames");
  if (traffic == "g8261-1") queue.mix = sim::TrafficMix::kG8261Model1;
  if (traffic == "g8261-2") queue.mix = sim::TrafficMix::kG8261Model2;
  const auto scheduling =
      load.word("scheduling", {"fifo", "priority", "preemption"}).value_or("fifo");
  if (scheduling == "priority") queue.scheduling = sim::Scheduling::kPriority;
  if (scheduling == "preemption") queue.scheduling = sim::Scheduling::kPreemption;
  if (auto change = load.table("change")) queue.change = read_load_change(std::move(*change));
  load.finish();
  return queue;
}

sim::HostStalls read_stalls(TomlTable stalls) {
  sim::HostStalls result;
  const auto every = stalls.duration("every", kPositive);
  const auto length = stalls.duration("length", kPositive);
  if (!every || !length) stalls.fail_here("stalls need every and length, both means");
  result.mean_interval_s = every->seconds();
  result.mean_length_ns = length->ns();
  result.shared = stalls.boolean("shared").value_or(false);
  stalls.finish();
  return result;
}

void read_load(TomlTable& table, sim::LinkSpec& link) {
  if (auto load = table.table("load")) link.queueing = read_queue(std::move(*load));
  if (auto stalls = table.table("stalls")) link.stalls = read_stalls(std::move(*stalls));
  if (auto bursts = table.table("bursts")) {
    sim::BurstyLoad burst;
    burst.mean_idle_s =
        bursts->duration("mean_idle", kPositive).value_or(Nanoseconds{1'000'000'000}).seconds();
    burst.mean_busy_s =
        bursts->duration("mean_busy", kPositive).value_or(Nanoseconds{100'000'000}).seconds();
    burst.extra_mean_ns = bursts->duration("extra", kNotNegative).value_or(Duration{}).ns();
    link.bursts = burst;
    bursts->finish();
  }
  if (auto spikes = table.table("spikes")) {
    link.spikes.probability = spikes->ratio("probability", kProbability).value_or(0.0);
    link.spikes.extra_ns = spikes->duration("extra", kAny).value_or(Duration{}).ns();
    spikes->finish();
  }
}

sim::StampWave read_wave(TomlTable wave) {
  const auto peak_to_peak = wave.duration("peak_to_peak", kPositive);
  const auto period = wave.duration("period", kPositive);
  if (!peak_to_peak || !period) wave.fail_here("a wave needs peak_to_peak and period");
  wave.finish();
  return {peak_to_peak->ns(), period->seconds()};
}

void read_mishaps(TomlTable& table, sim::LinkSpec& link) {
  if (const auto v = table.ratio("loss", kProbability)) link.loss = *v;
  if (const auto v = table.ratio("duplication", kProbability)) link.duplication = *v;
  if (const auto v = table.ratio("reordering", kProbability)) link.reordering = *v;
  if (const auto v = table.duration("reordering_hold", kNotNegative)) link.reordering_hold = *v;
  if (const auto v = table.boolean("in_order")) link.in_order = *v;
  for (auto& step : table.tables("step")) {
    const auto at = step.duration("at", kNotNegative);
    const auto extra = step.duration("extra", kAny);
    if (!at || !extra) step.fail_here("a step of the delay needs at and extra");
    link.delay_steps.push_back({*at, *extra});
    step.finish();
  }
  for (auto& outage : table.tables("outage")) {
    const auto from = outage.duration("from", kNotNegative);
    const auto to = outage.duration("to", kNotNegative);
    if (!from || !to || *to <= *from) outage.fail_here("an outage needs from and a later to");
    link.outages.push_back({*from, *to});
    outage.finish();
  }
}

void read_link(TomlTable& table, sim::LinkSpec& link) {
  if (const auto v = table.duration("delay", kNotNegative)) link.delay = *v;
  if (auto jitter = table.table("jitter")) link.jitter = read_jitter(std::move(*jitter));
  if (auto wave = table.table("wave")) link.wave = read_wave(std::move(*wave));
  read_load(table, link);
  read_mishaps(table, link);
}

}  // namespace

void read_clock(TomlTable& table, sim::NodeSpec& node) {
  auto& parts = node.oscillator.parts;
  if (const auto v = table.duration("initial_offset", kAny)) node.initial_offset = *v;
  if (const auto v = table.ratio("skew", kFrequency)) parts.emplace_back(sim::ConstantSkew{*v});
  if (const auto v = table.ratio_per_second("ageing")) parts.emplace_back(sim::Ageing{*v});
  if (const auto v = table.ratio("white_fm", kAmount)) parts.emplace_back(sim::WhiteFm{*v});
  if (const auto v = table.ratio("flicker_fm", kAmount)) parts.emplace_back(sim::FlickerFm{*v});
  if (const auto v = table.ratio_per_root_second("random_walk_fm"))
    parts.emplace_back(sim::RandomWalkFm{*v});
  read_steps_of_frequency(table, parts);
  read_periodic(table, parts);
  read_replay(table, parts);
  if (const auto v = table.duration("tick", kNotNegative)) node.tick = *v;
  if (const auto v = table.duration("stamp_noise", kNotNegative)) node.stamp_noise_ns = v->ns();
  if (const auto v = table.duration("grid", kPositive)) node.oscillator.grid = *v;
  const double limit = table.ratio("rate_limit", {1e-9, 0.99}).value_or(0.03);
  node.limits = {Rate::from_ratio(1.0 - limit), Rate::from_ratio(1.0 + limit)};
}

void read_path(TomlTable& table, sim::NodeSpec& node) {
  sim::LinkSpec both;
  read_link(table, both);
  node.forward = both;
  node.backward = both;
  if (const auto v = table.duration("asymmetry", kAny)) {
    // delayAsymmetry, IEEE 1588-2019, 7.4.2: positive when reference to local is slower.
    node.forward.delay = both.delay + *v;
    node.backward.delay = both.delay - *v;
  }
  if (auto forward = table.table("forward")) {
    read_link(*forward, node.forward);
    forward->finish();
  }
  if (auto backward = table.table("backward")) {
    read_link(*backward, node.backward);
    backward->finish();
  }
}

}  // namespace ftcs::experiment
