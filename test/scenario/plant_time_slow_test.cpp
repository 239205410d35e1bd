// SPDX-License-Identifier: MIT
// The world of plant_time.h, a thousand starts.
#include "test/scenario/plant_time.h"

namespace ftcs::experiment {
namespace {

TEST(PlantTime, moves_no_drive_into_a_fault_in_a_thousand_starts) {
  constexpr std::uint64_t kStarts = 1000;
  for (std::uint64_t seed = 101; seed < 101 + kStarts; ++seed) {
    test::live_through_it(seed % 4 < 2 ? node::BusMode::kExternal : node::BusMode::kLead, seed);
  }
}

}  // namespace
}  // namespace ftcs::experiment
