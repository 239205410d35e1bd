// SPDX-License-Identifier: MIT
// 01 again, with one servo that is chosen here: nothing of the other nine is linked.
#include <chrono>
#include <cstdio>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/basic_clock_discipline.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/two_way_servo.h"

using namespace ftcs;
using namespace std::chrono_literals;

using Servo = TwoWayServo<FtcsServo>;  // Table 1 of the paper

struct Oscillator final : FreeRunningSource {
  FreeRunningTime now() noexcept override { return reading; }
  FreeRunningTime reading{};
};

int main() {
  Oscillator oscillator;
  VirtualClock clock(oscillator, {.local = LocalTime{Duration{1ms}}});
  const auto make = [](const RateLimits& limits) {
    FtcsConfig config;
    config.limits = limits;
    return Servo(TwoWayConfig{}, config);
  };
  BasicClockDiscipline<Servo> discipline({}, {}, clock, make);
  const auto hear = [&](Direction direction, Nanoseconds reference, Nanoseconds here) {
    oscillator.reading = FreeRunningTime{scale(Duration{here}, Rate::from_ppm(50.0))};
    discipline.on_pair({direction, ReferenceTime{Duration{reference}}, oscillator.reading});
  };
  for (Nanoseconds sync = 1s; sync <= 20s; sync += 1s) {
    hear(Direction::kForward, sync, sync + 10us);
    hear(Direction::kBackward, sync + 110us, sync + 100us);
  }
  std::printf("%s\n", discipline.locked() ? "locked" : "not locked");
  return discipline.locked() ? 0 : 1;
}
