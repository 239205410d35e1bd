// SPDX-License-Identifier: MIT
// A cyclic task of 1 ms keeps in phase with the distributed clock that its EtherCAT frames read, 20
// ppm fast.
#include <chrono>
#include <cstdio>

#include "ftcs/discipline/cycle_servo.h"

using namespace ftcs;
using namespace std::chrono_literals;

// What the reference SubDevice latches (register 0x0910) from a frame that is sent at an instant of
// the host.
ReferenceTime latch(FreeRunningTime sent) {
  return ReferenceTime{Duration{5s} + scale(sent.since_epoch(), Rate::from_ppm(20.0))};
}

int main() {
  CycleServo servo({.law = CycleLaw::kAdaptive, .cycle = 1ms, .shift = 250us});
  CycleDecision next = servo.start(FreeRunningTime::from_ns(0));
  for (int cycle = 0; cycle < 1000; ++cycle) {
    // Here your task sleeps until next.wake, sends its frame and receives it: 30 us late in this
    // example.
    CycleSample frame;
    frame.sent = next.wake + Duration{30us};
    frame.reference = latch(frame.sent);
    frame.has_reference = true;
    frame.received = frame.sent + Duration{20us};
    frame.has_received = true;
    next = servo.update(frame, frame.received);
  }
  const double phase_ns =
      static_cast<double>(latch(next.wake).since_epoch().floor_ns() % 1'000'000);
  std::printf("wakes %.0f ns after each whole millisecond of the drives, rate %+.3f ppm\n",
              phase_ns, next.rate.ppm());
  return next.state == CycleState::kLocked ? 0 : 1;
}
