// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <gtest/gtest.h>

#include "ftcs/discipline/clock_discipline.h"
#include "test/support/manual_source.h"
#include "test/support/watched_clock.h"

namespace ftcs::test {

using namespace std::chrono_literals;

inline constexpr Nanoseconds kInterval = 125ms;
inline constexpr FreeRunningTime kStart = FreeRunningTime::from_ns(1'000'000'000);

/// One perfect oscillator that the test moves by hand; a reference that is an affine function of
/// it; a virtual clock on it that the discipline steers. Exact stamps, path delay known (zero)
/// unless a test says otherwise.
class ClockDisciplineTest : public ::testing::Test {
 protected:
  ClockDisciplineTest() { oscillator_.instant = kStart; }

  void start(Duration offset, const DisciplineConfig& config) {
    clock_.emplace(oscillator_, offset, RateLimits::symmetric_ppb(100e6));
    discipline_.emplace(config, *clock_);
  }
  static DisciplineConfig config_for(ServoKind kind) {
    DisciplineConfig config;
    config.servo.kind = kind;
    config.servo.sync_interval = kInterval;
    config.servo.two_way.fixed_path_delay = 0ns;
    return config;
  }

  [[nodiscard]] ReferenceTime reference() {
    const Duration elapsed = oscillator_.now() - kStart;
    return ReferenceTime::from_ns(1'000'000'000) + scale(elapsed, reference_rate_) +
           reference_jump_;
  }
  [[nodiscard]] double offset_ns() {
    return offset_from_reference(clock_->read().local, reference()).ns();
  }
  [[nodiscard]] EventPair forward() {
    return {Direction::kForward, reference(), oscillator_.now()};
  }
  void advance(Duration elapsed) { oscillator_.instant = oscillator_.instant + elapsed; }
  Telemetry sync() { return discipline_->on_pair(forward()); }
  /// One message now, then an interval without any.
  Telemetry sync_and_wait() {
    const Telemetry telemetry = sync();
    advance(kInterval);
    return telemetry;
  }

  /// Locked from 10 us, by FTCS, which believes offsets up to a second.
  void lock_within_a_second(bool may_step) {
    DisciplineConfig config = config_for(ServoKind::kFtcs);
    config.largest_offset = 1s;
    config.step.mode = may_step ? StepMode::kFirst : StepMode::kNever;
    reference_jump_ = Duration{};
    start(Nanoseconds{10us}, config);
    for (int n = 0; n < 8; ++n) sync_and_wait();
  }

  ManualSource oscillator_;
  Rate reference_rate_{};
  Duration reference_jump_{};
  std::optional<WatchedClock> clock_;
  std::optional<ClockDiscipline> discipline_;
};

}  // namespace ftcs::test
