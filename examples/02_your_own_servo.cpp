// SPDX-License-Identifier: MIT
// A control law of your own: a value with three functions. TwoWayServo puts path delay and outlier
// gate in front of it.
#include <chrono>
#include <cmath>
#include <cstdio>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/servo/two_way_servo.h"

using namespace ftcs;
using namespace std::chrono_literals;

struct Integrator {  // rate(n+1) = rate(n) - offset(n) / 8 s, and an eighth of the offset goes in
                     // the next second
  struct Config {};
  explicit Integrator(const Config&) noexcept {}
  ServoUpdate update(const SyncSample& sample, const ClockReading&) noexcept {
    ppb -= sample.offset().ns() / 8.0;
    const Rate correction = Rate::from_ppb(ppb - sample.offset().ns() / 2.0);
    return {.has_command = true, .command = {correction, Duration{1s}, Rate::from_ppb(ppb), {}}};
  }
  void reset() noexcept { ppb = 0.0; }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return {}; }
  double ppb = 0.0;
};

struct Oscillator final : FreeRunningSource {  // 20 ppm fast
  FreeRunningTime now() noexcept override { return reading; }
  FreeRunningTime reading{};
};

int main() {
  Oscillator oscillator;
  VirtualClock clock(oscillator, {});
  TwoWayServo<Integrator> servo({.fixed_path_delay = 10us}, {});
  for (Nanoseconds sync = 1s; sync <= 60s; sync += 1s) {
    oscillator.reading = FreeRunningTime{scale(Duration{sync + 10us}, Rate::from_ppm(20.0))};
    const TimestampPair pair{Direction::kForward, ReferenceTime{Duration{sync}}, clock.read().local,
                             oscillator.reading};
    const ServoUpdate update = servo.update(pair, clock.read());
    if (update.has_command && !clock.apply(update.command).ok()) return 1;
  }
  const Duration error =
      offset_from_reference(clock.read().local, ReferenceTime{Duration{60s + 10us}});
  std::printf("%.3f ns after a minute\n", error.ns());
  return std::abs(error.ns()) < 100.0 ? 0 : 1;
}
