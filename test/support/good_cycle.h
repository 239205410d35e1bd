// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/diagnosis/cycle_diagnosis.h"

namespace ftcs::test {

/// A cycle of 1 ms with eight drives in which nothing is wrong.
inline diagnosis::CycleSeen good_cycle() {
  diagnosis::CycleSeen seen;
  seen.state = CycleState::kLocked;
  seen.drives = seen.expected_drives = 8;
  seen.working_counter = seen.expected_counter = 24;
  seen.cycles = 1000;
  seen.margin_ns = 400e3;
  seen.gate_ns = 200e3;
  seen.cycle_ns = 1e6;
  return seen;
}

}  // namespace ftcs::test
