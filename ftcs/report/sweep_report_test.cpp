// SPDX-License-Identifier: MIT
// World: a sweep of three scenarios of two seeds, of which the first is whole, the second was cut
// short and the third did not run.
#include "ftcs/report/sweep_report.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

using experiment::LimitResult;
using experiment::ScenarioResult;
using experiment::ServoResult;
using experiment::SweepResult;

ServoResult missed(std::size_t runs) {
  ServoResult servo;
  servo.servo = "adaptive";
  servo.has_limits = servo.required = true;
  servo.passed = false;
  servo.runs.resize(runs);
  for (std::size_t i = 0; i < runs; ++i) servo.seeds.push_back(i + 1);
  const double measured = runs == 0 ? experiment::RunFigures::kNone : 5.0;
  servo.limits.push_back(LimitResult{"rms_time_error", "median", 1.0, measured, false});
  return servo;
}

SweepResult interrupted() {
  SweepResult sweep;
  sweep.scenarios.push_back({"whole", "", {missed(2)}, 2});
  sweep.scenarios.push_back({"part", "", {missed(1)}, 2});
  sweep.scenarios.push_back({"none", "", {missed(0)}, 2});
  return sweep;
}

TEST(SweepReport, what_did_not_run_to_its_end_has_missed_nothing) {
  const SweepResult sweep = interrupted();
  const auto lines = missed_limits(sweep);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines.front().rfind("whole: adaptive: median of rms_time_error is 5", 0), 0U);
  EXPECT_EQ(unjudged(sweep), "of 3 scenarios, cut short: 1, not run: 1; these are not judged");
  const std::string table = suite_table(sweep).to_csv();
  EXPECT_NE(table.find("MISSED"), std::string::npos) << table;
  EXPECT_NE(table.find("not judged"), std::string::npos) << table;
  EXPECT_NE(sweep_html(sweep, {}, {}).find("not run: 1"), std::string::npos);
}

TEST(SweepReport, nothing_is_judged_against_a_bound_that_did_not_run) {
  SweepResult sweep = interrupted();
  sweep.scenarios.resize(1);
  EXPECT_EQ(unjudged(sweep), "");
  sweep.scenarios.front().servos.emplace_back().servo = experiment::kBoundName;
  EXPECT_TRUE(missed_limits(sweep).empty());
  EXPECT_EQ(unjudged(sweep), "of 1 scenarios, cut short: 1, not run: 0; these are not judged");
}

}  // namespace
}  // namespace ftcs
