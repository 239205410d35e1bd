// SPDX-License-Identifier: MIT
// World: an interface eth0 that stamps in hardware, by the clock of /dev/ptp0, to which a second
// node leads.
#include "ftcs/daemon/ptp_clock.h"

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"

namespace ftcs::daemon {
namespace {

struct World {
  World() {
    kernel.add_adapter_clock();
    options.interface = "eth0";
    options.clock.kind = ClockKind::kPhc;
  }
  std::string steered(const char* device) {
    options.clock.device = device;
    const auto clocks = open_ptp_clocks(kernel, options, log);
    kernel.held_names.clear();
    return clocks ? clocks->real->name() : clocks.error();
  }

  platform::FakeClocks kernel;
  Log log{kernel, stdout, 3};
  PtpOptions options;
};

TEST(PtpClock, the_adapters_clock_may_be_named_by_any_of_its_nodes) {
  World world;
  for (const char* device : {"", "/dev/ptp0", "/dev/ptp_nic", "/dev/ptp_node"}) {
    EXPECT_EQ(world.steered(device), "/dev/ptp0") << device;
  }
  EXPECT_EQ(world.steered("/dev/ptp5"), "/dev/ptp5: no such device");
  world.kernel.device_numbers_known = false;
  EXPECT_EQ(world.steered("/dev/ptp0"), "/dev/ptp0");
  EXPECT_EQ(world.steered("/dev/ptp_node"),
            "/dev/ptp_node: hardware timestamps of eth0 are of /dev/ptp0");
}

}  // namespace
}  // namespace ftcs::daemon
