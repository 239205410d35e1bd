// SPDX-License-Identifier: MIT
// The loop that ships, on a kernel that is none: two modelled drives behind the one socket, time
// passes only where the loop sleeps or waits. No socket, no clock of the host, the same to the bit.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/fieldbus/cycle_laws.h"
#include "ftcs/fieldbus/main_runner.h"
#include "ftcs/fieldbus/run_report.h"
#include "ftcs/sim/cycle_host.h"
#include "test/support/fake_segment.h"

namespace ftcs::daemon {
namespace {

using platform::SegmentKernel;

/// Two drives on a line, +50 and -80 ppm fast; SYNC0 windows and watchdogs as in every simulation.
struct TwoDrives {
  TwoDrives() {
    for (const double ppm : {50.0, -80.0}) {
      crystals.push_back(std::make_unique<ethercat::AffineOscillator>(Rate::from_ppm(ppm)));
      ethercat::SubDeviceConfig config;
      config.identity.serial = static_cast<std::uint32_t>(crystals.size());
      ethercat::Wiring wiring;
      wiring.cable = Nanoseconds{50};
      wiring.parent = static_cast<int>(crystals.size()) - 2;
      EXPECT_TRUE(segment.add(config, wiring, *crystals.back()));
      segment.power_cycle(crystals.size() - 1, ethercat::WireTime::from_ns(1'000'000'000));
    }
  }
  std::vector<std::unique_ptr<ethercat::AffineOscillator>> crystals;
  ethercat::Segment segment;
};

RunOptions options_of(const std::string& law) {
  RunOptions options;
  options.drives = 2;
  options.quiet = true;
  options.duration_s = 0.0;
  options.drift_pulses = 1000;
  set_cycle_law(options, law);
  return options;
}

/// A runner, its kernel and the drives behind it.
struct Loop {
  explicit Loop(const RunOptions& options) {
    auto link = platform::EthercatLink::connect_udp(kernel, options.host, options.port);
    EXPECT_TRUE(link);
    runner = std::make_unique<MainRunner>(options, std::move(*link));
  }
  void bring_up() {
    kernel.reply_ns = sim::CycleHost::kBringUpRoundTrip.count();
    ASSERT_TRUE(runner->bring_up([] { return false; }, false))
        << describe(runner->main().failure());
    kernel.reply_ns = sim::CycleHost::kReplyTime.count();
  }
  /// So many cycles; `after` each of them is called with its number.
  template <class After>
  void run(int cycles, const After& after) {
    int number = 0;
    runner->run([&] {
      if (number > 0) after(number);
      return number++ == cycles;
    });
  }
  [[nodiscard]] bool locked() const { return runner->decision().state == CycleState::kLocked; }

  TwoDrives drives;
  SegmentKernel kernel{drives.segment};
  std::unique_ptr<MainRunner> runner;
};

class CyclicLoop : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Laws, CyclicLoop, ::testing::Values("ftcs", "pics", "adaptive"));

/// What is simulated is what ships: the simulator's host and the loop of the program command the
/// same triggers, from the same frames.
TEST_P(CyclicLoop, commands_what_the_simulator_commands) {
  constexpr int kCycles = 5'000;
  const RunOptions options = options_of(GetParam());
  Loop loop(options);
  loop.bring_up();
  std::vector<CycleDecision> shipped;
  loop.run(kCycles, [&](int) { shipped.push_back(loop.runner->decision()); });

  TwoDrives drives;
  const auto host = std::make_unique<sim::CycleHost>(node_config(options, false), drives.segment,
                                                     ethercat::WireTime::from_ns(1'000'000'000));
  ASSERT_TRUE(host->bring_up());
  for (int i = 0; i < kCycles; ++i) {
    // Who sleeps on a real kernel wakes at a whole nanosecond.
    const FreeRunningTime wake = host->node().decision().wake;
    const auto whole = FreeRunningTime::from_ns(wake.since_epoch().floor_ns());
    const CycleDecision simulated = host->cycle(whole - wake);
    const CycleDecision& live = shipped[static_cast<std::size_t>(i)];
    ASSERT_EQ(live.wake, simulated.wake) << "cycle " << i;
    ASSERT_EQ(live.phase_error, simulated.phase_error) << "cycle " << i;
    ASSERT_EQ(live.rate.ratio(), simulated.rate.ratio()) << "cycle " << i;
    ASSERT_EQ(live.state, simulated.state) << "cycle " << i;
  }
  EXPECT_EQ(shipped.back().state, CycleState::kLocked);
  EXPECT_EQ(loop.runner->servo_counters().late, 0U);
}

TEST_P(CyclicLoop, keeps_its_phase_when_it_is_woken_late) {
  Loop loop(options_of(GetParam()));
  loop.bring_up();
  std::uint64_t random = 1;
  double worst_ns = 0.0;
  loop.run(10'000, [&](int n) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    loop.kernel.late_ns = 20'000 + static_cast<std::int64_t>(random >> 47);  // up to 151 us
    if (n > 5'000)
      worst_ns = std::max(worst_ns, std::abs(loop.runner->decision().phase_error.ns()));
  });
  EXPECT_TRUE(loop.locked());
  EXPECT_LT(worst_ns, 1'000.0);
  EXPECT_TRUE(loop.runner->main().last_cycle().all_operational());
}

TEST_P(CyclicLoop, an_adapter_without_transmit_stamps_is_followed_by_the_reading_before_the_frame) {
  Loop loop(options_of(GetParam()));
  loop.kernel.gives_tx_stamps = loop.kernel.gives_rx_stamps = false;
  loop.bring_up();
  loop.run(5'000, [](int) {});
  EXPECT_TRUE(loop.locked());
}

/// CLOCK_REALTIME is set, which kernel stamps are of: the cycle is one of CLOCK_MONOTONIC.
TEST_P(CyclicLoop, a_step_of_the_hosts_date_moves_no_drive) {
  for (const double step_s :
       {37.0, -37.0, 0.5, 1e-3, -1e-3, 4e-4, -4e-4, 1e-4, -1e-4, 5e-5, -5e-5, 1e-5, -1e-5}) {
    Loop loop(options_of(GetParam()));
    loop.bring_up();
    std::uint64_t missed = 0;  // windows of SYNC0
    int unlocked = 0;
    loop.run(12'000, [&](int n) {
      if (n == 6'300) loop.kernel.realtime_ns += static_cast<std::int64_t>(step_s * 1e9);
      if (n <= 6'000) return;
      const std::uint64_t now = loop.drives.segment[0].drive().statistics().missed;
      if (n == 6'001) missed = now;
      EXPECT_EQ(now, missed) << step_s;
      unlocked += loop.locked() ? 0 : 1;
    });
    EXPECT_EQ(unlocked, 0) << step_s;
    EXPECT_TRUE(loop.runner->main().last_cycle().all_operational()) << step_s;
  }
}

TEST_P(CyclicLoop,
       a_cable_that_loses_frames_and_an_interface_that_is_down_for_a_while_are_ridden_out) {
  Loop loop(options_of(GetParam()));
  loop.bring_up();
  std::uint64_t random = 7;
  loop.kernel.swallows = [&random] {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    return (random >> 33) % 100 == 0;
  };
  loop.run(10'000, [&](int n) { loop.kernel.send_errno = n >= 5'000 && n < 5'005 ? ENETDOWN : 0; });
  EXPECT_GT(loop.kernel.lost, 50U);
  EXPECT_TRUE(loop.locked());
  EXPECT_FALSE(loop.runner->main().failure()) << describe(loop.runner->main().failure());
  EXPECT_TRUE(loop.runner->main().last_cycle().all_operational());
}

/// An interface that stays down: the run ends in a sentence, and does not wait for ever.
TEST(CyclicLoopOnce, ends_when_no_frame_can_be_sent_any_more) {
  Loop loop(options_of("ftcs"));
  loop.bring_up();
  const std::int64_t before = loop.kernel.raw_ns;
  loop.run(20'000, [&](int n) { loop.kernel.send_errno = n >= 3'000 ? ENETDOWN : 0; });
  EXPECT_TRUE(loop.runner->main().failure());
  EXPECT_LT(loop.kernel.raw_ns - before, 10'000'000'000);
}

TEST(CyclicLoopOnce, a_second_run_is_the_same_to_the_bit) {
  std::vector<CycleDecision> runs[2];
  for (auto& decisions : runs) {
    Loop loop(options_of("adaptive"));
    loop.bring_up();
    loop.run(3'000, [&](int n) {
      loop.kernel.late_ns = 1'000 * (n % 90);
      decisions.push_back(loop.runner->decision());
    });
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    ASSERT_EQ(runs[0][i].wake, runs[1][i].wake);
    ASSERT_EQ(runs[0][i].phase_error, runs[1][i].phase_error);
  }
}

}  // namespace
}  // namespace ftcs::daemon
