// SPDX-License-Identifier: MIT
// World: the underlying oscillator is perfect and is the reference plus a constant; the servo's own
// oscillator is 50 ppm fast on it. A Sync every 125 ms, a Delay_Req 10 ms later, 1 us of path
// either way, no noise.
#include "ftcs/experiment/servo_trial.h"

#include <gtest/gtest.h>

#include "ftcs/daemon/live_view.h"
#include "test/support/manual_source.h"

namespace ftcs::app {
namespace {
using namespace std::chrono_literals;
using daemon::offset_plot;

class World {
 public:
  explicit World(ServoKind kind) : trial_(setup(kind), oscillator_) {}

  /// `error` is added to the arrival of the Sync: a message that was held up.
  void exchange(Duration error = {}) {
    source_.instant = next_ + kPath + error;
    trial_.on_pair({Direction::kForward, truth_.at(next_), oscillator_.now()});
    source_.instant = next_ + Duration{10ms};
    const FreeRunningTime sent = oscillator_.now();
    source_.instant = next_ + Duration{10ms} + kPath;
    trial_.on_pair({Direction::kBackward, truth_.at(next_ + Duration{10ms} + kPath), sent});
    next_ = next_ + kInterval;
  }
  [[nodiscard]] experiment::TrialResult result(double band_ns) const {
    return trial_.result(band_ns);
  }

 private:
  static constexpr Duration kPath{1us};
  static constexpr Duration kInterval{125ms};

  experiment::ServoTrial::Setup setup(ServoKind kind) {
    experiment::ServoTrial::Setup setup;
    setup.name = "under test";
    setup.discipline.servo.kind = kind;
    setup.discipline.servo.sync_interval = 125ms;
    setup.discipline.servo.limits = RateLimits::symmetric_ppb(1e8);
    setup.discipline.servo.linuxptp_pi.first_step_threshold = 0ns;
    setup.clock.free_running = start_;
    setup.clock.local = LocalTime{truth_.at(start_).since_epoch() + Duration{1ms}};
    setup.clock.limits = setup.discipline.servo.limits;
    setup.truth = truth_;
    return setup;
  }

  FreeRunningTime start_ = FreeRunningTime::from_ns(5'000'000'000);
  FreeRunningTime next_ = start_ + Duration{100ms};
  experiment::TrueReference truth_{Duration{37s}};
  test::ManualSource source_;
  SkewedSource oscillator_{source_, Rate::from_ppm(50.0), start_};
  experiment::ServoTrial trial_;
};

TEST(ServoTrial, counts_one_interval_for_ftcs_without_noise) {
  World world(ServoKind::kFtcs);
  for (int i = 0; i < 40; ++i) world.exchange();
  const experiment::TrialResult result = world.result(100.0);
  EXPECT_TRUE(result.locked);
  EXPECT_EQ(result.cycles_to_lock, 1U);
  EXPECT_EQ(result.locked_at_sync, 3U) << "it acted on the second";
  EXPECT_EQ(result.excursions, 0U);
  EXPECT_EQ(result.samples, 40U);
  EXPECT_LT(result.rms_time_error_ns, 1.0);
  EXPECT_LT(result.rate_error_ppb, 1.0);
}

TEST(ServoTrial, a_servo_that_never_steers_is_never_locked_however_near_it_starts) {
  World world(ServoKind::kFreeRunning);
  for (int i = 0; i < 40; ++i) world.exchange();
  const experiment::TrialResult result = world.result(1e9);
  EXPECT_FALSE(result.locked);
  EXPECT_FALSE(result.cycles_to_lock.has_value());
  EXPECT_FALSE(result.locked_at_sync.has_value());
  EXPECT_NEAR(result.final_time_error_ns, 1e6 + 50e-6 * 5e9, 2e3);
}

TEST(ServoTrial, the_slower_servo_needs_more_intervals) {
  World world(ServoKind::kLinuxptpPi);
  for (int i = 0; i < 400; ++i) world.exchange();
  const experiment::TrialResult result = world.result(1000.0);
  EXPECT_TRUE(result.locked);
  EXPECT_GT(result.cycles_to_lock.value_or(0), 10U);
}

TEST(ServoTrial, the_true_error_is_judged_not_the_offset_that_the_servo_sees) {
  World world(ServoKind::kFtcs);
  for (int i = 0; i < 40; ++i) world.exchange(i % 2 == 0 ? Duration{} : Duration{2us});
  const experiment::TrialResult result = world.result(1e5);
  EXPECT_GT(result.rms_perceived_offset_ns, 100.0);
  EXPECT_NE(result.rms_time_error_ns, result.rms_perceived_offset_ns);
  EXPECT_GT(result.rms_second_half_ns, 0.0);
  EXPECT_LT(result.rms_second_half_ns, 2.0 * result.rms_time_error_ns)
      << "nothing of the start is in it";
}

TEST(ServoTrial, half_of_a_path_longer_one_way_stays_in_the_mean) {
  World world(ServoKind::kAdaptive);
  for (int i = 0; i < 80; ++i) world.exchange(Duration{2us});
  const experiment::TrialResult result = world.result(1e5);
  EXPECT_NEAR(result.mean_second_half_ns, -1000.0, 1.0);
  EXPECT_NEAR(result.rms_second_half_ns, 1000.0, 1.0);
}

TEST(LiveView, the_plot_rises_with_the_decades_and_keeps_its_width) {
  const std::vector<double> offsets{1e6, -1e4, 10.0};
  EXPECT_EQ(offset_plot(offsets, 4), " █▅▁");
  EXPECT_EQ(offset_plot(offsets, 2), "▅▁");
}

TEST(LiveView, times_have_a_unit_that_fits) {
  EXPECT_EQ(format_time(-7.4), "-7 ns");
  EXPECT_EQ(format_time(1234.5), "1.234 us");
  EXPECT_EQ(format_time(125e6), "125.000 ms");
  EXPECT_EQ(format_time(-2.5e9), "-2.500 s");
}

}  // namespace
}  // namespace ftcs::app
