// SPDX-License-Identifier: MIT
// A project elsewhere, in C++: headers and layers as they were installed. A PTP receiver node
// starts; a clock is locked.
#include <cstdio>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/node/receiver_node.h"

struct Oscillator final : ftcs::FreeRunningSource {
  ftcs::FreeRunningTime now() noexcept override { return reading; }
  ftcs::FreeRunningTime reading{};
};

int main() {
  Oscillator oscillator;
  ftcs::VirtualClock clock(oscillator, {});
  ftcs::node::ReceiverNode node({}, clock);
  node.start(oscillator.now());
  if (node.port().state() != ftcs::ptp::PortState::kListening) return 1;

  ftcs::ClockDiscipline discipline({}, clock);
  for (std::int64_t second = 1; second <= 10; ++second) {
    for (const std::int64_t back_ns : {0, 100'000}) {
      const std::int64_t true_ns = second * 1'000'000'000 + 10'000 + back_ns;
      oscillator.reading = ftcs::FreeRunningTime::from_ns(true_ns + true_ns / 50'000);
      const bool forward = back_ns == 0;
      discipline.on_pair(
          {forward ? ftcs::Direction::kForward : ftcs::Direction::kBackward,
           ftcs::ReferenceTime::from_ns(forward ? true_ns - 10'000 : true_ns + 10'000),
           oscillator.reading});
    }
  }
  std::printf("%s, %.3f ppm\n", discipline.locked() ? "locked" : "not locked",
              discipline.latest().tracking_rate.ppm());
  return discipline.locked() ? 0 : 1;
}
