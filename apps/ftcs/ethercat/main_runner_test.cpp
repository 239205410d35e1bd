// SPDX-License-Identifier: MIT
// The world: two modelled drives in a thread, UDP on loopback. Behaviour, not timing: the machine
// may be busy.
#include "apps/ftcs/ethercat/main_runner.h"

#include <optional>

#include <gtest/gtest.h>

#include "apps/ftcs/ethercat/cycle_laws.h"
#include "apps/ftcs/ethercat/local_segment.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::app {
namespace {

class OnLoopback : public ::testing::TestWithParam<std::string> {
 protected:
  void start() {
    SegmentOptions segment;
    segment.drives = 2;
    auto started = LocalSegment::start(segment, 0);
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
    options.servo.cycle = Nanoseconds{2'000'000};
    options.servo.largest_lateness = options.servo.largest_round_trip = Nanoseconds{0};
    set_cycle_law(options, GetParam());
    auto link = platform::EthercatLink::connect_udp(options.host, options.port);
    ASSERT_TRUE(link);
    runner_ = std::make_unique<MainRunner>(options, std::move(*link));
    ASSERT_TRUE(runner_->bring_up([] { return false; }, false))
        << describe(runner_->main().failure());
  }
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

}  // namespace
}  // namespace ftcs::app
