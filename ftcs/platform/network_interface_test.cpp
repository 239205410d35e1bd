// SPDX-License-Identifier: MIT
// World: one interface, "eth0", of a fake kernel; the machine's own loopback.
#include "ftcs/platform/network_interface.h"

#include <gtest/gtest.h>

#include "test/support/fake_kernel.h"

namespace ftcs::platform {
namespace {

constexpr int kSocket = 3;

TEST(NetworkInterface, says_which_interface_does_not_exist) {
  FakeKernel kernel;
  kernel.interface_exists = false;
  const auto state = interface_state(kernel, kSocket, "eth7");
  ASSERT_FALSE(state.ok());
  EXPECT_EQ(state.error().kind, OsErrorKind::kNoSuchInterface);
  EXPECT_EQ(state.error().message(), "interface eth7: no such device");
}

TEST(NetworkInterface, refuses_names_that_the_kernel_would_cut_off) {
  FakeKernel kernel;
  EXPECT_FALSE(interface_state(kernel, kSocket, "").ok());
  EXPECT_FALSE(interface_state(kernel, kSocket, std::string(40, 'e')).ok());
}

TEST(NetworkInterface, knows_hardware_stamps_only_with_a_hardware_clock) {
  FakeKernel kernel;
  kernel.timestamping |= FakeKernel::kHardwareStamps;
  EXPECT_FALSE(interface_capabilities(kernel, kSocket, "eth0")->hardware_timestamps);
  kernel.phc_index = 0;
  EXPECT_TRUE(interface_capabilities(kernel, kSocket, "eth0")->hardware_timestamps);
}

TEST(NetworkInterface, reports_why_hardware_stamps_cannot_be_enabled) {
  FakeKernel kernel;
  InterfaceCapabilities capabilities;
  capabilities.receive_filters = 1U << HWTSTAMP_FILTER_PTP_V2_L4_EVENT;
  EXPECT_FALSE(enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, false));
  kernel.hardware_config_errno = EPERM;
  const auto denied = enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, false);
  ASSERT_TRUE(denied);
  EXPECT_EQ(denied->kind, OsErrorKind::kNotPermitted);
  kernel.stamps_are_on = true;
  EXPECT_FALSE(enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, false))
      << "somebody who may has switched them on";
  EXPECT_TRUE(enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, true))
      << "those of UDP are not those of IEEE 802.3";
  kernel.stamps_are_on = false;
  capabilities.receive_filters = 0;
  const auto none = enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, false);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->kind, OsErrorKind::kTimestampingUnsupported);
}

// Another program's filter may be wider than ours.
TEST(NetworkInterface, changes_no_stamps_that_are_on_already) {
  FakeKernel kernel;
  InterfaceCapabilities capabilities;
  capabilities.receive_filters = 1U << HWTSTAMP_FILTER_PTP_V2_L4_EVENT;
  EXPECT_FALSE(has_hardware_timestamps_on(kernel, "eth0", false));
  kernel.stamps_are_on = true;
  EXPECT_TRUE(has_hardware_timestamps_on(kernel, "eth0", false));
  EXPECT_FALSE(has_hardware_timestamps_on(kernel, "eth0", true));
  EXPECT_EQ(kernel.stamp_changes, 0);
  EXPECT_FALSE(enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, false));
  EXPECT_EQ(kernel.stamp_changes, 0);
  kernel.stamps_are_on = false;
  EXPECT_FALSE(enable_hardware_timestamps(kernel, kSocket, "eth0", capabilities, false));
  EXPECT_EQ(kernel.stamp_changes, 1);
}

TEST(NetworkInterface, finds_the_machines_loopback) {
  LinuxKernel kernel;
  const Descriptor socket(kernel, kernel.socket(AF_INET, SOCK_DGRAM));
  const auto state = interface_state(kernel, socket.get(), "lo");
  ASSERT_TRUE(state.ok());
  EXPECT_TRUE(state->loopback);
  EXPECT_TRUE(interface_capabilities(kernel, socket.get(), "lo")->software_timestamps);
}

}  // namespace
}  // namespace ftcs::platform
