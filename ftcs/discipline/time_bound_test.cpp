// SPDX-License-Identifier: MIT
// World: a clock that follows a reference over a noisy path, and at many instants between the
// messages the question where the truth is. FTCS_BOUND_SAMPLES: of each scenario; its least unless
// it is given.
#include "ftcs/discipline/time_bound.h"

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"
#include "test/support/manual_source.h"

namespace ftcs {
namespace {

using namespace std::chrono_literals;

constexpr double kIntervalNs = 125e6;
constexpr double kPathNs = 10'000.0;
constexpr int kQuestions = 50;  // between two Syncs
constexpr std::int64_t kEpochNs = 1'800'000'000'000'000'000;

struct Scenario {
  const char* name;
  std::function<double(std::mt19937_64&)> noise;
  double loss = 0.0;
  double wander = 0.0;            ///< of the rate, per root second
  int outage_every = 0;           ///< Syncs; each of 60 s
  int step_every = 0;             ///< Syncs; each of 20 us
  double load = 0.0;              ///< part of the messages that wait behind another, up to 120 us
  std::uint64_t least = 200'000;  ///< questions
};

class Coverage : public testing::TestWithParam<Scenario> {
 protected:
  Coverage() {
    source_.instant = FreeRunningTime::from_ns(5'000'000'000);
    VirtualClockConfig clock;
    clock.free_running = source_.instant;
    clock.local = LocalTime::from_ns(kEpochNs + 30'000);
    clock_.emplace(source_, clock);
    DisciplineConfig config;
    config.servo.kind = ServoKind::kAdaptive;
    discipline_.emplace(config, *clock_);
  }
  [[nodiscard]] double delay() {
    double waits = 0.0;
    if (unit_(random_) < GetParam().load) waits = 120e3 * unit_(random_);
    return kPathNs + waits + std::abs(GetParam().noise(random_));
  }
  [[nodiscard]] bool lost() { return unit_(random_) < GetParam().loss; }
  [[nodiscard]] FreeRunningTime oscillator(double after_ns) const {
    return at_ + Duration::from_ns(after_ns * (1.0 + rate_));
  }
  [[nodiscard]] ReferenceTime reference(double after_ns) const {
    return told_ + Duration::from_ns(after_ns);
  }
  void exchange() {
    if (!lost()) {
      const double delay_ns = delay();
      source_.instant = oscillator(delay_ns);
      discipline_->on_pair({Direction::kForward, reference(0.0), source_.instant});
    }
    if (lost()) return;
    constexpr double kAsked = 20e6;
    const double delay_ns = delay();
    source_.instant = oscillator(kAsked + 2.0 * delay_ns);
    discipline_->on_pair({Direction::kBackward, reference(kAsked + delay_ns), oscillator(kAsked)});
  }
  /// Half of an interval after the Sync, and what is stated then holds for the whole next one.
  void ask() {
    constexpr double kSaid = 60e6;
    source_.instant = oscillator(kSaid);
    const TimeBound bound = time_bound(discipline_->on_silence(), discipline_->samples());
    if (bound.state == TimeBound::State::kUnknown) return;
    for (int i = 0; i < kQuestions; ++i) {
      const double after = kSaid + kIntervalNs * unit_(random_);
      const FreeRunningTime instant = oscillator(after);
      const double error = (bound.time_at(instant) - reference(after)).ns();
      const double part = std::abs(error) / bound.half_width_ns(instant);
      worst_ = std::max(worst_, part);
      if (part > 1.0) ++outside_;
      widths_ += bound.half_width_ns(instant);
      ++asked_;
      if (bound.state == TimeBound::State::kLocked) ++locked_;
      if (bound.state == TimeBound::State::kHoldover) ++holdover_;
    }
  }
  void pass(double ns) {
    at_ = oscillator(ns);
    told_ = reference(ns);
    std::normal_distribution<double> walk(0.0, 1.0);
    rate_ += GetParam().wander * std::sqrt(ns * 1e-9) * walk(random_);
  }

  std::mt19937_64 random_{7};
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
  test::ManualSource source_;
  std::optional<VirtualClock> clock_;
  std::optional<ClockDiscipline> discipline_;
  FreeRunningTime at_ = FreeRunningTime::from_ns(5'000'000'000);
  ReferenceTime told_ = ReferenceTime::from_ns(kEpochNs);
  double rate_ = 30e-6;
  std::uint64_t asked_ = 0, outside_ = 0, locked_ = 0, holdover_ = 0;
  double worst_ = 0.0, widths_ = 0.0;
};

TEST_P(Coverage, the_truth_is_inside_what_is_stated) {
  const char* const given = std::getenv("FTCS_BOUND_SAMPLES");
  const Scenario& scenario = GetParam();
  const std::uint64_t wanted =
      given == nullptr ? scenario.least : std::strtoull(given, nullptr, 10);
  int since_step = 1'000;
  for (int n = 1; asked_ < wanted; ++n) {
    const bool outage =
        scenario.outage_every > 0 && n % scenario.outage_every < 480 && n > scenario.outage_every;
    if (!outage) exchange();
    // Nobody can know of a step before a message that shows it, nor believe the first one alone.
    if (++since_step > 3) ask();
    pass(kIntervalNs);
    if (scenario.step_every > 0 && n % scenario.step_every == 0) {
      told_ = told_ + Duration::from_ns(20e3);
      since_step = 0;
    }
  }
  std::printf(
      "%-24s %10llu asked, %4llu outside, farthest %.3f of the half width, mean half width %.0f "
      "ns, %.0f %% locked\n",
      scenario.name, static_cast<unsigned long long>(asked_),
      static_cast<unsigned long long>(outside_), worst_, widths_ / static_cast<double>(asked_),
      100.0 * static_cast<double>(locked_) / static_cast<double>(asked_));
  EXPECT_LE(static_cast<double>(outside_), 1e-6 * static_cast<double>(asked_)) << worst_;
  EXPECT_TRUE(holdover_ > 0 || scenario.outage_every == 0) << "stated in holdover too";
}

double gaussian(std::mt19937_64& random) {
  return 500.0 + std::normal_distribution<double>(0.0, 100.0)(random);
}
double exponential(std::mt19937_64& random) {
  return std::exponential_distribution<double>(1.0 / 100.0)(random);
}

INSTANTIATE_TEST_SUITE_P(
    Paths, Coverage,
    testing::Values(
        Scenario{"gaussian 100 ns", gaussian}, Scenario{"exponential 100 ns", exponential},
        Scenario{.name = "30 % lost", .noise = gaussian, .loss = 0.3},
        Scenario{.name = "wander 1e-9", .noise = gaussian, .wander = 1e-9},
        Scenario{
            .name = "outages of 60 s", .noise = gaussian, .wander = 1e-9, .outage_every = 2'000},
        // Seven hundred steps: after one of them a floor was seen that lay across it.
        Scenario{
            .name = "steps of 20 us", .noise = gaussian, .step_every = 400, .least = 14'300'000},
        Scenario{.name = "40 % wait behind others", .noise = gaussian, .load = 0.4}));

TEST(TimeBound, without_a_deviation_nothing_is_stated) {
  EXPECT_EQ(time_bound(Telemetry{}, 9).state, TimeBound::State::kUnknown);
  Telemetry telemetry;
  telemetry.servo.offset_known = true;
  telemetry.servo.offset_sigma_ns = 10.0;
  EXPECT_EQ(time_bound(telemetry, 9).state, TimeBound::State::kUnknown)
      << "nor for how long it holds";
  telemetry.servo.rate_sigma_ppb = 1.0;
  telemetry.reading.local = LocalTime::from_ns(1'000);
  telemetry.servo.offset = Nanoseconds{400};
  const TimeBound bound = time_bound(telemetry, 1'000'000'000, {.wander = 0.0, .unknown = 100ns});
  EXPECT_EQ(bound.state, TimeBound::State::kUnlocked);
  EXPECT_EQ(bound.time, ReferenceTime::from_ns(600));
  EXPECT_NEAR(bound.bound_ns, 160.0, 1e-3);
  EXPECT_GT(time_bound(telemetry, 2, {.wander = 0.0, .unknown = 100ns}).bound_ns, 500.0)
      << "few samples";
  EXPECT_NEAR(bound.half_width_ns(FreeRunningTime::from_ns(1'000'000'000)), 166.0, 1e-3);
}

}  // namespace
}  // namespace ftcs
