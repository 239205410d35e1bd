// SPDX-License-Identifier: MIT
// Stamps that you recorded, one message a line ("forward|backward REFERENCE_NS HERE_NS"), through
// the adaptive servo:
//   03_replay_your_stamps < examples/stamps.txt
#include <cinttypes>
#include <cstdio>
#include <string_view>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"

using namespace ftcs;

struct Recorded final : FreeRunningSource {
  FreeRunningTime now() noexcept override { return reading; }
  FreeRunningTime reading{};
};

int main() {
  Recorded oscillator;
  VirtualClock clock(oscillator, {});
  ClockDiscipline discipline({}, clock);
  char word[9];
  std::int64_t reference = 0;
  std::int64_t here = 0;
  while (std::scanf("%8s %" SCNd64 " %" SCNd64, word, &reference, &here) == 3) {
    const bool forward = std::string_view(word) == "forward";
    oscillator.reading = FreeRunningTime::from_ns(here);
    const Telemetry seen =
        discipline.on_pair({forward ? Direction::kForward : Direction::kBackward,
                            ReferenceTime::from_ns(reference), oscillator.reading});
    std::printf("%-8s offset %10.1f ns +- %.1f  path delay %8.1f ns  %s\n", word,
                seen.servo.offset.ns(), seen.servo.offset_sigma_ns, seen.servo.path_delay.ns(),
                seen.locked ? "locked" : "");
  }
  return discipline.locked() ? 0 : 1;
}
