// SPDX-License-Identifier: MIT
// World: the paper's Section IV as experiments/paper describes it; 256 seeds a row. Oracles: the
// paper's print and the independent model's figures, which stand in the files.
#include "ftcs/experiment/paper_run.h"

#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace ftcs::experiment {
namespace {

constexpr std::uint64_t kSeeds = 256;

PaperTable load(const std::string& name) {
  const std::string path = "experiments/paper/" + name + ".toml";
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  PaperTable table = parse_paper_table(text.str(), path);
  table.seeds = kSeeds;
  return table;
}

void expect_all_demands_met(const std::string& name) {
  const PaperResult result = run_paper_table(load(name), {});
  EXPECT_TRUE(result.complete);
  int demanded = 0;
  for (const auto& check : result.checks) {
    demanded += check.demanded ? 1 : 0;
    EXPECT_TRUE(check.passed) << check.name << ": " << check.subject << " (" << check.against
                              << ") measured " << check.measured << ", permitted " << check.least
                              << " to " << check.most;
  }
  EXPECT_GT(demanded, 10);
  EXPECT_EQ(result.passed(), !testing::Test::HasFailure());
}

TEST(PaperRun, table_2_holds) { expect_all_demands_met("table2"); }
TEST(PaperRun, tables_3_and_4_hold) { expect_all_demands_met("table4"); }
TEST(PaperRun, table_5_holds) { expect_all_demands_met("table5"); }

TEST(PaperRun, a_wrong_servo_is_found_out) {
  PaperTable table = load("table2");
  table.seeds = 32;
  std::get<FtcsConfig>(table.rows[0].servo).offset_gain = 0.9;
  EXPECT_FALSE(run_paper_table(table, {}).passed());
}

TEST(PaperRun, does_not_depend_on_the_number_of_threads) {
  PaperTable table = load("table5");
  table.seeds = 16;
  JobControl one;
  one.threads = 1;
  JobControl four;
  four.threads = 4;
  const PaperResult a = run_paper_table(table, one);
  const PaperResult b = run_paper_table(table, four);
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    EXPECT_EQ(a.rows[i].rms_perceived_ns, b.rows[i].rms_perceived_ns);
  }
}

TEST(PaperRun, an_interrupted_table_is_not_passed_but_keeps_its_runs) {
  PaperTable table = load("table2");
  std::atomic<bool> stop{false};
  JobControl control;
  control.threads = 1;
  control.stop = &stop;
  control.progress = [&](std::size_t done, std::size_t) { stop = done >= 120; };
  const PaperResult result = run_paper_table(table, control);
  EXPECT_FALSE(result.complete);
  EXPECT_FALSE(result.passed());
  EXPECT_NEAR(result.rows[0].rms_perceived_ns, 126.0, 20.0);
}

}  // namespace
}  // namespace ftcs::experiment
