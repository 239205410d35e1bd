// SPDX-License-Identifier: MIT
// World: a thousand jobs on four threads.
#include "ftcs/experiment/parallel.h"

#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace ftcs::experiment {
namespace {

TEST(RunJobs, runs_each_job_once) {
  std::vector<int> runs(1000, 0);
  JobControl control;
  control.threads = 4;
  EXPECT_EQ(run_jobs(1000, control, [&](std::size_t i) { ++runs[i]; }), 1000U);
  EXPECT_EQ(runs, std::vector<int>(1000, 1));
}

TEST(RunJobs, reports_progress_up_to_the_total) {
  std::size_t last = 0;
  JobControl control;
  control.threads = 4;
  control.progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(done, last + 1);
    EXPECT_EQ(total, 100U);
    last = done;
  };
  run_jobs(100, control, [](std::size_t) {});
  EXPECT_EQ(last, 100U);
}

TEST(RunJobs, stops_early_and_keeps_what_was_done) {
  std::atomic<bool> stop{false};
  JobControl control;
  control.threads = 1;
  control.stop = &stop;
  EXPECT_EQ(run_jobs(1000, control, [&](std::size_t i) { stop = i == 9; }), 10U);
}

TEST(RunJobs, hands_an_exception_on) {
  JobControl control;
  control.threads = 4;
  EXPECT_THROW(run_jobs(100, control,
                        [](std::size_t i) {
                          if (i == 50) throw std::runtime_error("x");
                        }),
               std::runtime_error);
}

}  // namespace
}  // namespace ftcs::experiment
