// SPDX-License-Identifier: MIT
// A clock that is 1 ms ahead and whose oscillator is 50 ppm fast follows a reference over a link of
// 10 us.
#include <chrono>
#include <cstdio>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"

using namespace ftcs;
using namespace std::chrono_literals;

struct Oscillator final : FreeRunningSource {  // yours: CLOCK_MONOTONIC_RAW, a hardware counter
  FreeRunningTime now() noexcept override { return reading; }
  FreeRunningTime reading{};
};

int main() {
  // [README
  Oscillator oscillator;
  VirtualClock clock(oscillator, {.local = LocalTime{Duration{1ms}}});
  ClockDiscipline discipline({}, clock);  // with the adaptive servo
  const auto hear = [&](Direction direction, Nanoseconds reference, Nanoseconds here) {
    oscillator.reading = FreeRunningTime{scale(Duration{here}, Rate::from_ppm(50.0))};
    return discipline.on_pair({direction, ReferenceTime{Duration{reference}}, oscillator.reading});
  };
  for (Nanoseconds sync = 1s; sync <= 10s; sync += 1s) {
    hear(Direction::kForward, sync, sync + 10us);                              // Sync: t1, t2
    const auto seen = hear(Direction::kBackward, sync + 110us, sync + 100us);  // Delay_Req: t4, t3
    std::printf("offset %12.1f ns  rate %+9.3f ppm  %s\n", seen.servo.offset.ns(),
                seen.tracking_rate.ppm(), seen.locked ? "locked" : "");
  }
  // README]
  return discipline.locked() ? 0 : 1;
}
