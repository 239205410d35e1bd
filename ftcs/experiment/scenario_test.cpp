// SPDX-License-Identifier: MIT
// World: a small scenario, 60 cycles of 100 ns gaussian noise at 1 s.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/experiment/scenario_error.h"
#include "ftcs/experiment/scenario_run.h"

namespace ftcs::experiment {
namespace {

const std::string kSmall = R"(
title = "small"
servos = ["ftcs", "linuxptp-pi"]

[run]
sync_interval = "1 s"
cycles = 60
measure_from = 20
converged_dwell = 5
seeds = 4

[clock]
initial_offset = "1 ms"
skew = "50 ppm"
step = "first"

[path]
delay = "10 us"
jitter = { kind = "gaussian", sigma = "100 ns" }
)";

std::string complaint(const std::string& text) {
  try {
    (void)parse_scenarios(text, "a.toml");
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "";
}

TEST(Scenario, is_read_with_its_servos_and_the_bound_last) {
  const auto scenarios = parse_scenarios(kSmall, "dir/010-small.toml");
  ASSERT_EQ(scenarios.size(), 1U);
  EXPECT_EQ(scenarios[0].name, "010-small");
  ASSERT_EQ(scenarios[0].servos.size(), 3U);
  EXPECT_EQ(scenarios[0].servos.back().name, kBoundName);
  EXPECT_EQ(scenarios[0].servos.back().config.kalman.noise.forward_ns, 100.0);
}

TEST(Scenario, mistakes_are_named_with_their_line) {
  EXPECT_NE(complaint("[run]\nsync_interval = \"1 s\"\ncycles = 10\nseed = 3\n").find("a.toml:4:"),
            std::string::npos);
  EXPECT_NE(complaint("[run]\nsync_interval = \"1 ppm\"\ncycles = 10\n").find("a.toml:2:"),
            std::string::npos);
  EXPECT_NE(complaint("[run]\nsync_interval = \"1 s\"\n").find("needs cycles"), std::string::npos);
  EXPECT_NE(complaint("title = 3\n"), "");
  EXPECT_NE(complaint(kSmall + "loss = \"130 %\"\n").find("out of range"), std::string::npos);
  EXPECT_NE(complaint(kSmall + "[[limit]]\nservo = \"nobody\"\n").find("no servo \"nobody\""),
            std::string::npos);
  const std::string limit = "[[limit]]\nservo = \"ftcs\"\n";
  EXPECT_EQ(complaint(kSmall + limit), "");
  EXPECT_NE(complaint(kSmall + limit + limit).find("has a limit already"), std::string::npos);
  EXPECT_NE(
      complaint("network = \"ptp\"\n[run]\nsync_interval = \"0.3 s\"\ncycles = 10\n").find("2^n"),
      std::string::npos);
}

TEST(Scenario, only_ports_that_exchange_octets_can_measure_the_delay_peer_to_peer) {
  EXPECT_NE(complaint("delay = \"p2p\"\n" + kSmall).find("network = \"ptp\" only"),
            std::string::npos);
  EXPECT_NE(complaint("network = \"ptp\"\ndelay = \"pdelay\"\n" + kSmall).find("p2p"),
            std::string::npos);
  const auto wanted = parse_scenarios("network = \"ptp\"\ndelay = \"p2p\"\n" + kSmall, "a.toml");
  EXPECT_TRUE(wanted[0].world.peer_to_peer);
  EXPECT_NE(wanted[0].servos.back().name, kBoundName) << "there is none to be had";
}

TEST(Scenario, times_may_be_given_in_cycles) {
  const auto scenarios = parse_scenarios(
      "[run]\nsync_interval = \"125 ms\"\ncycles = 10\n[path]\noutage = [{ from = \"4 cycles\", to "
      "= \"5 cycles\" }]\n",
      "a.toml");
  EXPECT_EQ(scenarios[0].world.nodes[0].forward.outages.at(0).from.ns(), 0.5e9);
}

TEST(Scenario, a_grid_makes_one_scenario_for_each_point) {
  const auto scenarios =
      parse_scenarios(kSmall +
                          "\n[grid]\n\"run.sync_interval\" = [\"1 s\", \"125 ms\"]\n\"clock.skew\" "
                          "= [\"1 ppm\", \"2 ppm\", \"3 ppm\"]\n",
                      "a.toml");
  ASSERT_EQ(scenarios.size(), 6U);
  EXPECT_NE(scenarios[0].name, scenarios[5].name);
}

TEST(Sweep, limits_decide_and_are_named) {
  auto scenarios = parse_scenarios(kSmall +
                                       "\n[[limit]]\nservo = \"ftcs\"\nrms_time_error = { median = "
                                       "\"1 ns\", worst = \"1 s\" }\n",
                                   "a.toml");
  SweepResult sweep = run_sweep(scenarios, {}, {});
  EXPECT_TRUE(sweep.complete);
  EXPECT_FALSE(sweep.passed());
  ASSERT_EQ(sweep.scenarios[0].servos[0].limits.size(), 2U);
  EXPECT_FALSE(sweep.scenarios[0].servos[0].limits[0].passed);
  EXPECT_TRUE(sweep.scenarios[0].servos[0].limits[1].passed);
  scenarios[0].limits[0].required = false;
  judge(scenarios[0], sweep.scenarios[0]);
  sweep.scenarios[0].servos[0].required = false;
  EXPECT_TRUE(sweep.passed());
}

TEST(Sweep, merged_shards_are_the_whole) {
  const auto scenarios = parse_scenarios(kSmall, "a.toml");
  const SweepResult whole = run_sweep(scenarios, {}, {});
  std::vector<SweepResult> parts;
  for (std::size_t i = 0; i < 3; ++i) parts.push_back(run_sweep(scenarios, {i, 3}, {}));
  const SweepResult merged = merge_sweeps(scenarios, parts);
  EXPECT_TRUE(merged.complete);
  EXPECT_FALSE(parts[0].complete);
  for (std::size_t k = 0; k < 3; ++k) {
    const ServoResult& a = whole.scenarios[0].servos[k];
    const ServoResult& b = merged.scenarios[0].servos[k];
    ASSERT_EQ(a.seeds, b.seeds);
    for (std::size_t r = 0; r < a.runs.size(); ++r) {
      EXPECT_EQ(a.runs[r].rms_time_error_ns, b.runs[r].rms_time_error_ns);
    }
  }
}

TEST(Sweep, an_interrupted_sweep_keeps_its_runs_and_is_not_passed) {
  const auto scenarios = parse_scenarios(kSmall, "a.toml");
  std::atomic<bool> stop{false};
  JobControl control;
  control.threads = 1;
  control.stop = &stop;
  control.progress = [&](std::size_t done, std::size_t) { stop = done == 5; };
  const SweepResult sweep = run_sweep(scenarios, {}, control);
  EXPECT_FALSE(sweep.passed());
  std::size_t runs = 0;
  for (const auto& servo : sweep.scenarios[0].servos) runs += servo.runs.size();
  EXPECT_EQ(runs, 5U);
}

TEST(Sweep, octets_and_stamps_agree) {
  const auto stamps = parse_scenarios(kSmall, "a.toml");
  const auto octets = parse_scenarios("network = \"ptp\"\n" + kSmall, "a.toml");
  const RunFigures a = run_scenario(stamps[0], stamps[0].servos[0], 1);
  const RunFigures b = run_scenario(octets[0], octets[0].servos[0], 1);
  EXPECT_NEAR(a.rms_time_error_ns, b.rms_time_error_ns, 0.5 * a.rms_time_error_ns);
}

TEST(Scenario, the_adaptive_servo_is_told_what_the_actuator_can_do) {
  const auto scenarios = parse_scenarios(R"(
title = "a drive that bears small steps of the rate only"
[run]
sync_interval = "125 ms"
cycles = 400
measure_from = 200
seeds = 1
[clock]
initial_offset = "1 ms"
skew = "50 ppm"
[path]
delay = "10 us"
jitter = { kind = "gaussian", sigma = "100 ns" }
[[servo]]
kind = "adaptive"
name = "gentle"
rate_change = "10 ppm"
rate_granularity = "1 ppb"
time_granularity = "1 us"
latency = "50 us"
)",
                                         "gentle.toml");
  const Scenario& scenario = scenarios.front();
  const SteeringLimits& limits = scenario.servos.front().config.adaptive.steering;
  EXPECT_DOUBLE_EQ(limits.rate_change, 1e-5);
  EXPECT_DOUBLE_EQ(limits.rate_granularity, 1e-9);
  EXPECT_EQ(limits.time_granularity, Nanoseconds{1'000});
  EXPECT_EQ(limits.latency, Nanoseconds{50'000});
  EXPECT_LT(run_scenario(scenario, scenario.servos.front(), 1).rms_time_error_ns, 100.0);
}

}  // namespace
}  // namespace ftcs::experiment
