// SPDX-License-Identifier: MIT
// World: a hardware clock 30 ppm fast and the system clock 20 ppm slow, 1 ms apart; reading the
// hardware clock takes 0.8 us over the bus. `phc - system` is the truth.
#include "ftcs/daemon/phc/phc_runner.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/platform/local_socket.h"
#include "test/support/fake_clocks.h"
#include "test/support/fake_preemption.h"

namespace ftcs::daemon {
namespace {

using platform::FakeClocks;

struct World {
  World() {
    kernel.phc.oscillator = 1.0 + 30e-6;
    kernel.system.oscillator = 1.0 - 20e-6;
    kernel.phc.time_ns = 1e6;
    options.source = "/dev/ptp0";
    options.sink_ahead_s = 0;
    options.log_level = 3;
  }
  [[nodiscard]] double difference() const { return kernel.phc.time_ns - kernel.system.time_ns; }
  int run(double seconds) {
    options.duration = Duration::from_ns(seconds * 1e9);
    auto runner = PhcRunner::open(kernel, options, log);
    EXPECT_TRUE(runner.ok()) << runner.error();
    return runner ? (*runner)->run() : -1;
  }
  /// As run(); the largest difference between the clocks after `settled_s`.
  double largest_difference(double seconds, double settled_s) {
    double largest = 0.0;
    const double start = kernel.ideal_ns;
    kernel.on_poll = [&, start] {
      if (kernel.ideal_ns - start > settled_s * 1e9) {
        largest = std::max(largest, std::abs(difference()));
      }
    };
    EXPECT_EQ(run(seconds), kSuccess);
    kernel.on_poll = nullptr;
    return largest;
  }

  FakeClocks kernel;
  Log log{kernel, stdout, 3};
  PhcOptions options;
};

TEST(PhcRunner, brings_the_system_clock_to_a_hardware_clock) {
  World world;
  EXPECT_LT(world.largest_difference(30.0, 5.0), 50.0);
  EXPECT_NEAR(world.kernel.phc.steering(), 1.0, 1e-15) << "the source is not touched";
}

TEST(PhcRunner, brings_a_hardware_clock_to_the_system_clock) {
  World world;
  world.options.source = "CLOCK_REALTIME";
  world.options.sink = "/dev/ptp0";
  EXPECT_LT(world.largest_difference(30.0, 5.0), 50.0);
  EXPECT_NEAR(world.kernel.system.steering(), 1.0, 1e-15);
}

TEST(PhcRunner, brings_one_hardware_clock_to_another) {
  for (const bool precise : {true, false}) {
    World world;
    world.kernel.precise_errno = precise ? 0 : EOPNOTSUPP;
    world.kernel.other_phc.time_ns = -3e6;
    world.kernel.other_phc.oscillator = 1.0 + 70e-6;
    world.options.sink = "/dev/ptp1";
    EXPECT_EQ(world.run(30.0), kSuccess);
    EXPECT_NEAR(world.kernel.other_phc.time_ns - world.kernel.phc.time_ns, 0.0, 50.0);
    EXPECT_NEAR(world.kernel.phc.steering(), 1.0, 1e-15) << "the source is not touched";
    EXPECT_NEAR(world.kernel.system.steering(), 1.0, 1e-15) << "nor what they are compared by";
  }
}

// Each takes the other's correction for the truth: on a real kernel both ran 1390 ppm fast after a
// minute, and both were locked.
TEST(PhcRunner, two_clocks_are_not_made_to_follow_each_other) {
  World world;
  world.kernel.run_folder_is_writable = false;  // its lock files are one for all hardware clocks
  world.options.sink = "/dev/ptp1";
  PhcOptions opposite = world.options;
  std::swap(opposite.source, opposite.sink);
  {
    const auto first = PhcRunner::open(world.kernel, world.options, world.log);
    ASSERT_TRUE(first.ok()) << first.error();
    const auto second = PhcRunner::open(world.kernel, opposite, world.log);
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error(),
              "/dev/ptp1 follows /dev/ptp0 already: two clocks that follow each "
              "other run away together");
    opposite.free_running = true;
    EXPECT_TRUE(PhcRunner::open(world.kernel, opposite, world.log).ok()) << "comparing is free";
    opposite.free_running = false;
  }
  EXPECT_TRUE(PhcRunner::open(world.kernel, opposite, world.log).ok()) << "once it has ended";
}

TEST(PhcRunner, keeps_a_constant_difference) {
  World world;
  world.options.sink_ahead_s = -37;
  EXPECT_EQ(world.run(20.0), kSuccess);
  EXPECT_NEAR(world.difference(), 37e9, 50.0);
}

TEST(PhcRunner, never_steps_if_told_so_and_is_there_within_two_readings) {
  World world;
  world.options.servo.limits = RateLimits::symmetric_ppb(100e6);
  world.options.first_step_threshold = Nanoseconds{0};
  double last = world.kernel.system.time_ns;
  world.kernel.on_clock_read = [&] {
    EXPECT_GE(world.kernel.system.time_ns, last) << "time never runs backward";
    last = world.kernel.system.time_ns;
  };
  EXPECT_LT(world.largest_difference(20.0, 3.0), 200.0);
}

// CLOCK_MONOTONIC goes with it, and programs take its rate for true.
TEST(PhcRunner, the_system_clock_runs_no_more_than_500_ppm_off_unless_asked_to) {
  World world;
  world.options.first_step_threshold = Nanoseconds{0};
  double largest_rate = 0.0;
  world.kernel.on_poll = [&] {
    largest_rate = std::max(largest_rate, std::abs(world.kernel.system.steering() - 1.0));
  };
  EXPECT_EQ(world.run(4.0), kNotLocked) << "a millisecond takes two seconds, a band of more";
  EXPECT_GT(largest_rate, 400e-6);
  EXPECT_LE(largest_rate, 500.1e-6);
}

TEST(PhcRunner, steps_at_any_time_above_a_threshold_if_it_is_given_one) {
  for (const bool may_step : {false, true}) {
    World world;
    world.options.servo.limits = RateLimits::symmetric_ppb(100e6);
    if (may_step) world.options.step_threshold = Nanoseconds{1'000'000};
    bool jumped = false;
    double farthest_late = 0.0;  // ten readings after the source jumped by 50 ms
    double last = 0.0;
    double largest_move = 0.0;  // in a quarter of a second at most: a slew makes 7.5 ms
    world.kernel.on_poll = [&] {
      if (!jumped && world.kernel.ideal_ns > 10e9) world.kernel.phc.time_ns += 50e6;
      jumped = jumped || world.kernel.ideal_ns > 10e9;
      if (world.kernel.ideal_ns > 20e9) {
        farthest_late = std::max(farthest_late, std::abs(world.difference()));
      }
      const double ahead = world.kernel.system.time_ns - world.kernel.raw;
      if (world.kernel.ideal_ns > 5e9)
        largest_move = std::max(largest_move, std::abs(ahead - last));
      last = ahead;
    };
    EXPECT_EQ(world.run(40.0), kSuccess) << may_step;
    EXPECT_LT(farthest_late, 100.0) << may_step;
    EXPECT_EQ(largest_move > 10e6, may_step) << largest_move;
  }
}

TEST(PhcRunner, changes_the_rate_by_no_more_at_a_time_than_it_may) {
  constexpr double kLimit = 5e-6;
  constexpr double kUnit = 2e-6 / 65536.0;  // the kernel's, at either end
  World world;
  world.options.source = "CLOCK_REALTIME";
  world.options.sink = "/dev/ptp0";
  world.options.steering = {kLimit, true};
  world.options.first_step_threshold = Nanoseconds{0};
  world.options.rate_hz = 8.0;
  world.kernel.phc.time_ns = 10e3;
  double last = 1.0;
  double largest = 0.0;
  world.kernel.on_clock_read = [&] {
    const double rate = world.kernel.phc.steering();
    largest = std::max(largest, std::abs(rate - last));
    last = rate;
  };
  EXPECT_LT(world.largest_difference(40.0, 30.0), 200.0);
  EXPECT_LE(largest, kLimit + kUnit);
}

TEST(PhcRunner, by_every_way_of_comparing_clocks) {
  for (const bool precise : {true, false}) {
    World world;
    world.kernel.precise_errno = precise ? 0 : EOPNOTSUPP;
    world.kernel.extended_errno = ENOTTY;
    EXPECT_LT(world.largest_difference(30.0, 5.0), 50.0) << (precise ? "precise" : "basic");
  }
}

// A kernel multiplies cycles by an integer (119 ppb is what Linux has on a 1 GHz counter) and makes
// good what it owes; steering against that would be noise of our own. Truth: between the readings.
TEST(PhcRunner, leaves_to_the_kernel_what_it_makes_good_by_itself) {
  struct Figures {
    double rms = 0.0;
    double left_ppb = 0.0;
  };
  const auto follow = [](double rate_hz, bool precise, ServoKind servo) {
    World world;
    world.kernel.system.multiplier_unit = 119e-9;
    world.kernel.system.oscillator = 1.0 - 20.0123e-6;
    world.kernel.precise_errno = precise ? 0 : EOPNOTSUPP;
    world.options.rate_hz = rate_hz;
    world.options.servo.kind = servo;
    double squares = 0.0;
    double count = 0.0;
    world.kernel.on_poll = [&] {
      if (world.kernel.ideal_ns < 30e9) return;
      squares += world.difference() * world.difference();
      count += 1.0;
    };
    EXPECT_EQ(world.run(60.0), kSuccess);
    const FakeClocks::Clock& clock = world.kernel.system;
    const double left = clock.steering() * clock.oscillator / world.kernel.phc.oscillator;
    return Figures{std::sqrt(squares / count), (left - 1.0) * 1e9};
  };
  for (const double rate_hz : {1.0, 8.0}) {
    for (const bool precise : {true, false}) {
      const Figures ours = follow(rate_hz, precise, ServoKind::kAdaptive);
      const Figures pi = follow(rate_hz, precise, ServoKind::kLinuxptpPi);
      EXPECT_LT(ours.rms, pi.rms) << rate_hz << " Hz" << (precise ? ", precise" : "");
      EXPECT_LT(ours.rms, rate_hz > 1.0 ? 4.5 : 9.0) << rate_hz << " Hz";
      EXPECT_LT(std::abs(ours.left_ppb), 5.0) << rate_hz << " Hz";
    }
  }
}

TEST(PhcRunner, slow_readings_count_for_less) {
  for (const int readings : {1, 5}) {
    World world;
    world.options.readings = readings;
    std::uint64_t state = 1;
    world.kernel.on_clock_read = [&] {
      // After one bus access in sixteen, or one in four, something else runs for up to 40 us.
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      const bool slow = (state >> 60) < (readings == 1 ? 1U : 4U);
      if (slow) world.kernel.run(static_cast<double>((state >> 40) % 40'000));
    };
    EXPECT_LT(world.largest_difference(300.0, 60.0), 2'000.0) << readings;
  }
}

// Preempted for up to 6 ms at random: each sample is taken for what its width says, and no reading
// for a step by another program.
TEST(PhcRunner, a_busy_machine_moves_no_clock) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const bool system_leads : {false, true}) {
      World world;
      if (system_leads) world.options.sink = "/dev/ptp0";
      if (system_leads) world.options.source = "CLOCK_REALTIME";
      world.options.rate_hz = 8.0;
      world.kernel.precise_errno = 0;
      const platform::FakePreemption preemption(world.kernel, seed);
      EXPECT_LT(world.largest_difference(60.0, 10.0), 1'000.0)
          << "seed " << seed << (system_leads ? ", system leads" : "");
    }
  }
}

TEST(PhcRunner, a_clock_that_somebody_else_steps_is_followed_again) {
  World world;
  bool stepped = false;
  world.kernel.on_poll = [&] {
    if (!stepped && world.kernel.ideal_ns > 10e9) {
      world.kernel.system.time_ns += 5e6;
      stepped = true;
    }
  };
  EXPECT_EQ(world.run(40.0), kSuccess);
  EXPECT_TRUE(stepped);
  EXPECT_NEAR(world.difference(), 0.0, 200.0);
}

TEST(PhcRunner, comparing_alone_touches_nothing) {
  World world;
  world.options.free_running = true;
  world.options.servo.kind = ServoKind::kFreeRunning;
  EXPECT_EQ(world.run(10.0), kNotLocked);
  EXPECT_EQ(world.kernel.commands, 0);
}

TEST(PhcRunner, a_source_that_is_unplugged_ends_the_run_and_the_rate_stays) {
  World world;
  world.kernel.on_poll = [&] { world.kernel.phc_gone = world.kernel.ideal_ns > 10e9; };
  EXPECT_EQ(world.run(20.0), kRuntimeError);
  EXPECT_NEAR(world.kernel.system.steering() * world.kernel.system.oscillator,
              world.kernel.phc.oscillator, 1e-7);
}

TEST(PhcRunner, incomplete_readings_are_holdover_and_no_end) {
  World world;
  world.kernel.on_poll = [&] {
    world.kernel.short_cross_reads = world.kernel.ideal_ns > 10e9 && world.kernel.ideal_ns < 20e9;
  };
  EXPECT_EQ(world.run(30.0), kSuccess);
  EXPECT_NEAR(world.difference(), 0.0, 50.0);
}

TEST(PhcRunner, a_right_that_is_taken_away_ends_the_run) {
  World world;
  world.kernel.on_poll = [&] {
    world.kernel.adjust_errno = world.kernel.ideal_ns > 5e9 ? EPERM : 0;
  };
  EXPECT_EQ(world.run(20.0), kRuntimeError);
}

TEST(PhcRunner, a_clock_that_is_busy_for_a_while_is_steered_again_and_said_once) {
  World world;
  Log log{world.kernel, stdout, 4};
  world.options.duration = Duration::from_ns(30e9);
  world.kernel.on_poll = [&] {
    const double s = world.kernel.ideal_ns / 1e9;
    world.kernel.adjust_errno = s > 10.0 && s < 15.0 ? EBUSY : 0;
  };
  auto runner = PhcRunner::open(world.kernel, world.options, log);
  ASSERT_TRUE(runner.ok());
  testing::internal::CaptureStdout();
  EXPECT_EQ((*runner)->run(), kSuccess);
  const std::string said = testing::internal::GetCapturedStdout();
  const auto first = said.find("refuses to steer it now");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("refuses to steer", first + 10), std::string::npos) << said;
  EXPECT_NEAR(world.difference(), 0.0, 50.0);
}

TEST(PhcRunner, says_which_clocks_how_and_by_what_servo) {
  World world;
  Log log{world.kernel, stdout, 6};
  world.options.servo.kind = ServoKind::kLinuxptpPi;
  world.options.duration = Duration::from_ns(1e9);
  auto runner = PhcRunner::open(world.kernel, world.options, log);
  ASSERT_TRUE(runner.ok());
  testing::internal::CaptureStdout();
  (void)(*runner)->run();
  EXPECT_NE(testing::internal::GetCapturedStdout().find(
                "CLOCK_REALTIME follows /dev/ptp0 (compared by extended; servo linuxptp-pi)"),
            std::string::npos);
}

TEST(PhcRunner, tells_the_service_manager_why_it_waits_and_when_it_is_locked) {
  auto manager = platform::LocalSocket::client();  // of this process, in systemd's place
  ASSERT_TRUE(manager.ok());
  ASSERT_EQ(setenv("NOTIFY_SOCKET", manager->path().c_str(), 1), 0);
  World world;
  EXPECT_EQ(world.run(20.0), kSuccess);
  unsetenv("NOTIFY_SOCKET");
  std::vector<std::string> heard;
  while (const auto datagram = manager->receive()) {
    heard.emplace_back(datagram->bytes.begin(), datagram->bytes.end());
  }
  const auto ready = std::find(heard.begin(), heard.end(), "READY=1");
  ASSERT_NE(ready, heard.end());
  EXPECT_TRUE(heard.front().starts_with("STATUS=not locked")) << heard.front();
  EXPECT_TRUE((ready - 1)->starts_with("STATUS=locked: CLOCK_REALTIME is ")) << *(ready - 1);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), "READY=1"), 1);
}

TEST(PhcRunner, says_what_cannot_be_opened_and_touches_nothing) {
  World world;
  const auto error = [&] {
    auto runner = PhcRunner::open(world.kernel, world.options, world.log);
    return runner ? std::string("opened") : runner.error();
  };
  world.options.source = "/dev/ptp5";
  EXPECT_EQ(error(), "/dev/ptp5: no such device");
  world.options.source = "CLOCK_AUX0";
  EXPECT_NE(error().find("expected here: CLOCK_REALTIME, /dev/ptpN or an interface"),
            std::string::npos)
      << error();
  world.options.source = "CLOCK_REALTIME";
  EXPECT_EQ(error(), "CLOCK_REALTIME: source and sink are the same clock");
  world.kernel.held_names.clear();
  world.options.source = "/dev/ptp0";
  for (const char* other : {"/dev/ptp_nic", "/dev/ptp_node"}) {
    world.options.sink = other;
    EXPECT_EQ(error(), "/dev/ptp0 and " + std::string(other) +
                           ": source and sink are the same clock by two names");
    world.kernel.held_names.clear();
  }
  world.options.sink = "CLOCK_REALTIME";
  world.kernel.precise_errno = world.kernel.extended_errno = world.kernel.basic_errno = ENOTTY;
  EXPECT_NE(error().find("cannot compare"), std::string::npos);
  world.kernel.held_names = {"ftcs clock realtime"};
  EXPECT_NE(error().find("already in use"), std::string::npos);
  EXPECT_EQ(world.kernel.commands, 0);
}

}  // namespace
}  // namespace ftcs::daemon
