// SPDX-License-Identifier: MIT
// World: a clock 30 ppm fast follows a reference, Sync every 125 ms, over a path of which one
// direction may take all of the time: what no protocol can see. The true error is known at every
// message.
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/daemon/watch/follower_watch.h"
#include "test/support/manual_source.h"

namespace ftcs::daemon {
namespace {

constexpr double kIntervalNs = 125e6;
constexpr double kMeanDelayNs = 5'000.0;

struct Path {
  double forward_share;  ///< of the time there and back
  double waits_ns;       ///< the most that a message waits behind others
};

class OffsetBound : public testing::TestWithParam<Path> {
 protected:
  OffsetBound() {
    source_.instant = FreeRunningTime::from_ns(5'000'000'000);
    clock_.emplace(source_, VirtualClockConfig{.free_running = source_.instant,
                                               .local = LocalTime::from_ns(1'000'000)});
    DisciplineConfig config;
    config.servo.kind = ServoKind::kAdaptive;
    discipline_.emplace(config, *clock_);
  }
  [[nodiscard]] double delay(double share) {
    const double waits = unit_(random_) < 0.2 ? GetParam().waits_ns * unit_(random_) : 0.0;
    return 2.0 * kMeanDelayNs * share + std::abs(noise_(random_)) + waits;
  }
  [[nodiscard]] FreeRunningTime oscillator(double reference_ns) const {
    return FreeRunningTime::from_ns(5'000'000'000) +
           Duration::from_ns(reference_ns * (1.0 + 30e-6));
  }
  /// The clock's true error at that instant.
  [[nodiscard]] double error_ns(double reference_ns) {
    source_.instant = oscillator(reference_ns);
    return clock_->local_at(source_.instant).since_epoch().ns() - reference_ns;
  }
  void exchange(double at_ns) {
    const double there = delay(GetParam().forward_share);
    source_.instant = oscillator(at_ns + there);
    discipline_->on_pair(
        {Direction::kForward, ReferenceTime{Duration::from_ns(at_ns)}, source_.instant});
    const double back = delay(1.0 - GetParam().forward_share);
    const double asked = at_ns + 20e6;
    source_.instant = oscillator(asked + 2.0 * back);
    discipline_->on_pair(
        {Direction::kBackward, ReferenceTime{Duration::from_ns(asked + back)}, oscillator(asked)});
  }

  std::mt19937_64 random_{3};
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
  std::normal_distribution<double> noise_{0.0, 100.0};
  test::ManualSource source_;
  std::optional<VirtualClock> clock_;
  std::optional<ClockDiscipline> discipline_;
};

TEST_P(OffsetBound, the_true_error_is_within_what_the_metric_states) {
  int asked = 0;
  int outside = 0;
  int outside_without_delay = 0;
  double largest_ns = 0.0;
  for (int n = 0; n < 40'000; ++n) {
    const double at_ns = kIntervalNs * n;
    exchange(at_ns);
    WatchState state = watch_state(*discipline_, "adaptive", {});
    if (state.mode != WatchMode::kLocked) continue;
    const double error = std::abs(error_ns(at_ns + 60e6));
    largest_ns = std::max(largest_ns, error);
    ++asked;
    if (error > offset_bound_ns(state)) ++outside;
    state.delay_ns = 0.0;
    if (error > offset_bound_ns(state)) ++outside_without_delay;
  }
  ASSERT_GT(asked, 39'000) << "locked";
  EXPECT_LE(outside, asked / 300) << "three sigma; the largest error was " << largest_ns << " ns";
  if (GetParam().forward_share > 0.5) {
    EXPECT_GT(outside_without_delay, asked / 2) << "it is the path delay that holds the bound";
  }
}

INSTANTIATE_TEST_SUITE_P(Paths, OffsetBound,
                         testing::Values(Path{0.5, 0.0}, Path{0.8, 0.0}, Path{1.0, 0.0},
                                         Path{0.0, 0.0}, Path{1.0, 50e3}));

}  // namespace
}  // namespace ftcs::daemon
