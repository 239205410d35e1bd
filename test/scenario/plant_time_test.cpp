// SPDX-License-Identifier: MIT
// The world of plant_time.h: drives never fault by our steering, whatever plant time does.
#include "test/scenario/plant_time.h"

namespace ftcs::experiment {
namespace {

TEST(PlantTime, moves_no_drive_into_a_fault_in_external_mode) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    test::live_through_it(node::BusMode::kExternal, seed);
  }
}

TEST(PlantTime, moves_no_drive_into_a_fault_in_lead_mode) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    test::live_through_it(node::BusMode::kLead, seed);
  }
}

}  // namespace
}  // namespace ftcs::experiment
