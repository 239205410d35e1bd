// SPDX-License-Identifier: MIT
#include "ftcs/experiment/scenario_servos.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "ftcs/analysis/statistics.h"
#include "ftcs/experiment/servo_library.h"

namespace ftcs::experiment {
namespace {

constexpr Range kGain{0.0, 10.0};

/// linuxptp's turn-around is measured on the steered clock, and no delay is refused.
void behave_as_linuxptp(TwoWayConfig& two_way) {
  two_way.path_delay.rate_compensated = false;
  two_way.path_delay.lowest = Nanoseconds{-100'000'000};
  two_way.gate_enabled = false;
}

ServoConfig default_config(ServoKind kind, const Scenario& scenario) {
  const sim::NodeSpec& node = scenario.world.nodes.front();
  ServoConfig config;
  config.kind = kind;
  config.limits = node.limits;
  if (scenario.world.interval_spread == 1.0) {
    config.sync_interval = Nanoseconds{scenario.world.interval.rounded_ns()};
  }
  if (scenario.network == "one-way") {
    config.two_way.fixed_path_delay = Nanoseconds{node.forward.delay.rounded_ns()};
  }
  config.adaptive.steering.rate = node.limits;
  config.adaptive.steering.first_step_allowed = node.discipline.step.mode != StepMode::kNever;
  config.kalman.limits = node.limits;
  if (kind == ServoKind::kLinuxptpPi) {
    behave_as_linuxptp(config.two_way);
    const bool may_step = node.discipline.step.mode != StepMode::kNever;
    config.linuxptp_pi.first_step_threshold =
        may_step ? node.discipline.step.threshold : Nanoseconds{0};
  }
  return config;
}

/// Names that stand for a servo with a parameter of its own.
std::optional<ScenarioServo> named_servo(const std::string& name, const Scenario& scenario) {
  if (name == "ftcs-p1") {  // plain FTCS, paper eq. (18)
    ScenarioServo servo{name, default_config(ServoKind::kFtcs, scenario)};
    servo.config.ftcs.offset_gain = 1.0;
    return servo;
  }
  if (name == "minimum-window") {
    ScenarioServo servo{name, default_config(ServoKind::kMinimumDelay, scenario)};
    servo.config.minimum_delay.selection = DelaySelection::kWindow;
    return servo;
  }
  const auto kind = servo_kind_from_name(name);
  if (!kind) return std::nullopt;
  return ScenarioServo{name, default_config(*kind, scenario)};
}

const std::vector<std::string>& all_servos() {
  static const std::vector<std::string> names = {
      "adaptive",    "ftcs",       "ftcs-p1", "pics",
      "linuxptp-pi", "regression", "pid",     "frequency-compensated",
      "kalman"};
  return names;
}

std::string known_names() {
  std::string names = "ftcs-p1, minimum-window";
  for (const ServoKindName& entry : kServoKinds) names += ", " + std::string(entry.name);
  return names;
}

void read_kalman_noise(TomlTable& table, baseline::KalmanNoise& noise) {
  if (const auto v = table.duration("timestamp_noise", kNotNegative))
    noise.forward_ns = noise.backward_ns = v->ns();
  if (const auto v = table.duration("backward_noise", kNotNegative)) noise.backward_ns = v->ns();
  if (const auto v = table.ratio("white_fm", {0.0, 0.5})) noise.white_fm_1s = *v;
  if (const auto v = table.ratio_per_root_second("random_walk_fm")) noise.random_walk_fm_1s = *v;
}

/// What the actuator can do and its users bear, as far as the adaptive servo is to know it.
void read_actuator(TomlTable& table, SteeringLimits& steering) {
  if (const auto v = table.ratio("rate_change", {0.0, 1.0})) steering.rate_change = *v;
  if (const auto v = table.ratio("rate_granularity", {0.0, 0.1})) steering.rate_granularity = *v;
  if (const auto v = table.duration("time_granularity", kNotNegative)) {
    steering.time_granularity = Nanoseconds{v->rounded_ns()};
  }
  if (const auto v = table.duration("latency", kNotNegative)) {
    steering.latency = Nanoseconds{v->rounded_ns()};
  }
}

void read_parameters(TomlTable& table, ServoConfig& config) {
  read_actuator(table, config.adaptive.steering);
  if (const auto v = table.number("offset_gain", {0.0, 1.0})) config.ftcs.offset_gain = *v;
  if (const auto v = table.duration("band_enter", kNotNegative))
    config.ftcs.converged_band.enter = *v;
  if (const auto v = table.duration("band_leave", kNotNegative))
    config.ftcs.converged_band.leave = *v;
  if (const auto v = table.duration("correction_time", kNotNegative)) {
    config.ftcs.correction_time = Nanoseconds{v->rounded_ns()};
  }
  if (const auto v = table.number("proportional_gain", kGain)) {
    config.pics.proportional_gain = *v;
    config.pid.proportional_gain = *v;
  }
  if (const auto v = table.number("integral_gain", kGain)) {
    config.pics.integral_gain = *v;
    config.pid.integral_gain = *v;
  }
  if (const auto v = table.number("derivative_gain", kGain)) config.pid.derivative_gain = *v;
  if (const auto v = table.boolean("gate")) config.two_way.gate_enabled = *v;
  if (const auto v = table.integer("window", {1.0, 4096.0}))
    config.minimum_delay.window = static_cast<std::uint32_t>(*v);
  if (const auto v = table.word("selection", {"weights", "window"})) {
    config.minimum_delay.selection =
        *v == "window" ? DelaySelection::kWindow : DelaySelection::kWeights;
  }
  read_kalman_noise(table, config.kalman.noise);
}

ScenarioServo read_servo(TomlTable table, const Scenario& scenario) {
  const auto kind_name = table.text("kind");
  const auto kind = kind_name ? servo_kind_from_name(*kind_name) : std::nullopt;
  if (!kind) table.fail("kind", "a servo needs a known kind", known_names());
  ScenarioServo servo{table.text("name").value_or(*kind_name), default_config(*kind, scenario)};
  read_parameters(table, servo.config);
  if (const auto error = validate(servo.config)) table.fail_here(std::string(describe(*error)));
  table.finish();
  return servo;
}

double spread_of(const std::vector<double>& values) {
  RunningStatistics statistics;
  for (const double value : values) statistics.add(value);
  return statistics.standard_deviation();
}

/// Standard deviation of a link's noise, as the linear bound takes it.
double jitter_sigma_ns(const sim::LinkSpec& link) {
  struct Sigma {
    double operator()(const sim::NoJitter&) const { return 0.0; }
    double operator()(const sim::GaussianJitter& j) const { return j.sigma_ns; }
    double operator()(const sim::ExponentialJitter& j) const { return j.mean_ns; }
    double operator()(const sim::GammaJitter& j) const { return j.scale_ns * std::sqrt(j.shape); }
    double operator()(const sim::BimodalJitter& j) const {
      const double spread = j.extra_ns * std::sqrt(j.probability * (1.0 - j.probability));
      return std::hypot(j.sigma_ns, spread);
    }
    double operator()(const sim::ParetoJitter& j) const {
      // Infinite up to shape 2: there is no linear bound, and the scale is as good as anything.
      if (j.shape <= 2.0) return j.scale_ns;
      return j.scale_ns * std::sqrt(j.shape / (j.shape - 2.0)) / (j.shape - 1.0);
    }
    double operator()(const sim::RecordedJitter& j) const { return spread_of(*j.values_ns); }
    double operator()(const sim::HistogramJitter& j) const {
      double mean = 0.0;
      double squares = 0.0;
      double before = 0.0;
      for (std::size_t i = 0; i < j.values_ns->size(); ++i) {
        const double weight = (*j.cumulative)[i] - before;
        before = (*j.cumulative)[i];
        mean += weight * (*j.values_ns)[i];
        squares += weight * (*j.values_ns)[i] * (*j.values_ns)[i];
      }
      return std::sqrt(std::max(squares - mean * mean, 0.0));
    }
  };
  return std::visit(Sigma{}, link.jitter);
}

baseline::KalmanNoise true_noise(const Scenario& scenario) {
  const sim::NodeSpec& node = scenario.world.nodes.front();
  // A tick is a uniform error, tick / sqrt(12), of each of the two stamps of a message.
  const double ticks =
      std::hypot(node.tick.ns(), scenario.world.reference_tick.ns()) / std::sqrt(12.0);
  const double stamps = std::hypot(node.stamp_noise_ns, ticks);
  // A filter needs some noise: a picosecond is below what a timestamp can hold.
  constexpr double kLeastNoiseNs = 1e-3;
  baseline::KalmanNoise noise;
  const auto link_ns = [&](const sim::LinkSpec& link) {
    const double wave = link.wave ? link.wave->peak_to_peak_ns / 2.0 : 0.0;
    return std::max(std::hypot(jitter_sigma_ns(link), wave, stamps), kLeastNoiseNs);
  };
  noise.forward_ns = link_ns(node.forward);
  noise.backward_ns = link_ns(node.backward);
  noise.white_fm_1s = 0.0;
  noise.random_walk_fm_1s = 0.0;
  for (const auto& part : node.oscillator.parts) {
    if (const auto* white = std::get_if<sim::WhiteFm>(&part)) {
      noise.white_fm_1s = std::hypot(noise.white_fm_1s, white->adev_1s);
    }
    if (const auto* walk = std::get_if<sim::RandomWalkFm>(&part)) {
      noise.random_walk_fm_1s = std::hypot(noise.random_walk_fm_1s, walk->step_1s);
    }
  }
  return noise;
}

/// Is the world one whose noise the filter can be told: white and random-walk FM of one clock, and
/// constants?
bool has_linear_bound(const Scenario& scenario) {
  const auto known = [](const sim::FrequencyPart& part) {
    return std::holds_alternative<sim::ConstantSkew>(part) ||
           std::holds_alternative<sim::WhiteFm>(part) ||
           std::holds_alternative<sim::RandomWalkFm>(part);
  };
  const auto& nodes = scenario.world.nodes;
  const auto& parts = nodes.front().oscillator.parts;
  return nodes.size() == 1 && std::all_of(parts.begin(), parts.end(), known);
}

/// Do some messages meet nothing but jitter, and others more?
bool has_clean_messages(const Scenario& scenario) {
  const sim::NodeSpec& node = scenario.world.nodes.front();
  const auto waits = [](const sim::LinkSpec& link) { return link.queueing || link.stalls; };
  return scenario.network == "two-way" && (waits(node.forward) || waits(node.backward));
}

void add_bound(TomlTable& root, Scenario& scenario) {
  const bool oracle = has_clean_messages(scenario);
  ScenarioServo bound{std::string(oracle ? kOracleName : kBoundName),
                      default_config(ServoKind::kKalman, scenario), oracle};
  bound.config.kalman.noise = true_noise(scenario);
  if (auto table = root.table("bound")) {
    const bool wanted = table->boolean("enabled").value_or(true);
    read_kalman_noise(*table, bound.config.kalman.noise);
    table->finish();
    if (!wanted) return;
  } else if (scenario.world.peer_to_peer) {
    scenario.notes.emplace_back(
        "No known-noise bound here: the filter would be given the Syncs and a mean link delay, and "
        "not the peer delay messages. The end-to-end row has it.");
    return;
  } else if (!has_linear_bound(scenario)) {
    scenario.notes.emplace_back(
        "No known-noise bound here: this clock is no linear noise process. [bound] sets one.");
    return;
  }
  scenario.servos.push_back(std::move(bound));
}

}  // namespace

StepPolicy read_step_policy(TomlTable& clock) {
  StepPolicy policy;
  const auto mode = clock.word("step", {"never", "first", "always"}).value_or("never");
  if (mode == "first") policy.mode = StepMode::kFirst;
  if (mode == "always") policy.mode = StepMode::kAlways;
  if (const auto v = clock.duration("step_threshold", kNotNegative)) {
    policy.threshold = Nanoseconds{v->rounded_ns()};
  }
  return policy;
}

ScenarioServo external_servo(std::shared_ptr<const ServoLibrary> library,
                             const Scenario& scenario) {
  ScenarioServo servo{library->name(), default_config(ServoKind::kExternal, scenario)};
  servo.plugin = std::move(library);
  return servo;
}

void read_servos(TomlTable& root, Scenario& scenario) {
  auto names = root.texts("servos");
  auto own = root.tables("servo");
  if (names.empty() && own.empty()) names = all_servos();
  for (const auto& name : names) {
    auto servo = named_servo(name, scenario);
    if (!servo) root.fail("servos", fmt::format("unknown servo \"{}\"", name), known_names());
    scenario.servos.push_back(std::move(*servo));
  }
  for (auto& table : own) scenario.servos.push_back(read_servo(std::move(table), scenario));
  add_bound(root, scenario);
}

}  // namespace ftcs::experiment
