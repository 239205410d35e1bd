// SPDX-License-Identifier: MIT
// The world: two modelled drives in a thread, UDP on loopback. Behaviour, not timing: the machine
// may be busy.
#include "ftcs/fieldbus/main_runner.h"

#include <optional>

#include <gtest/gtest.h>

#include "ftcs/fieldbus/cycle_laws.h"
#include "ftcs/fieldbus/local_segment.h"
#include "ftcs/fieldbus/run_histograms.h"
#include "ftcs/fieldbus/run_report.h"
#include "ftcs/report/json.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::daemon {
namespace {

class OnLoopback : public ::testing::TestWithParam<std::string> {
 protected:
  void start() {
    SegmentOptions segment;
    segment.drives = 2;
    auto started = LocalSegment::start(kernel_, segment, 0);
    ASSERT_TRUE(started);
    segment_ = std::move(*started);
    RunOptions options;
    options.port = segment_->port();
    options.drives = 2;
    options.quiet = true;
    options.trace = true;
    options.duration_s = 0.0;
    options.drift_pulses = 100;
    options.sync_error_limit = 0;
    options.lost_frame_limit = 500;  // the segment's thread may stand still for a while
    options.servo.cycle = Nanoseconds{2'000'000};
    options.servo.largest_lateness = options.servo.largest_round_trip = Nanoseconds{0};
    set_cycle_law(options, GetParam());
    auto link = platform::EthercatLink::connect_udp(kernel_, options.host, options.port);
    ASSERT_TRUE(link);
    runner_ = std::make_unique<MainRunner>(options, std::move(*link));
    ASSERT_TRUE(runner_->bring_up([] { return false; }, false))
        << describe(runner_->main().failure());
  }
  platform::LinuxKernel kernel_;
  std::unique_ptr<LocalSegment> segment_;
  std::unique_ptr<MainRunner> runner_;
};
INSTANTIATE_TEST_SUITE_P(Servos, OnLoopback, ::testing::Values("ftcs", "adaptive"));

TEST_P(OnLoopback, the_cyclic_path_touches_no_heap) {
  start();
  std::optional<test::ForbidAllocation> guard;
  int cycles = 0;
  runner_->run([&guard, &cycles] {
    if (cycles == 0) guard.emplace();
    return ++cycles > 500;
  });
  guard.reset();
  EXPECT_GE(runner_->figures().cycles, 499U);
  EXPECT_GT(runner_->figures().working_counter_right, 0U);
}

// No cycle a second after the lock, and the drives asked in turn: what was not measured is not
// said to be zero, nor under a bound.
TEST_P(OnLoopback, a_run_that_ends_at_once_judges_no_clock_of_a_drive) {
  start();
  int cycles = 0;
  runner_->run([&cycles] { return ++cycles > 1; });
  testing::internal::CaptureStdout();
  print_run(*runner_);
  std::fflush(stdout);
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_NE(said.find("|0x092C|: not judged, there was no cycle a second after the lock"),
            std::string::npos)
      << said;
  EXPECT_EQ(said.find("|0x092C| from"), std::string::npos) << said;
  const Json json = run_json(*runner_);
  EXPECT_TRUE(json.at("system_time_difference_bound_ns").is_null());
  for (const Json& drive : json.at("drives")) {
    EXPECT_TRUE(drive.at("largest_difference_ns").is_null()) << drive.dump();
  }
}

TEST(RunHistogram, counts_every_traced_cycle_and_shows_what_is_not_empty) {
  experiment::CycleFigures figures;
  for (int i = 0; i < 10'000; ++i) {
    experiment::CyclePoint point;
    point.lateness_us = static_cast<float>(i % 100);
    figures.trace.push_back(point);
  }
  figures.trace.back().lateness_us = 1e6F;  // one stall does not squeeze the rest
  const Histogram bins = run_histogram(figures, &experiment::CyclePoint::lateness_us);
  EXPECT_LE(bins.upper, 100.0);
  EXPECT_EQ(bins.above, 1U);
  std::uint64_t inside = 0;
  for (const std::uint64_t count : bins.counts) inside += count;
  EXPECT_EQ(inside + bins.below + bins.above, 10'000U);
  EXPECT_EQ(histogram_bars(bins).find(' '), std::string::npos);
  EXPECT_TRUE(run_histogram(experiment::CycleFigures{}, &experiment::CyclePoint::lateness_us)
                  .counts.empty());
  EXPECT_EQ(histogram_bars({}), "");
}

}  // namespace
}  // namespace ftcs::daemon
