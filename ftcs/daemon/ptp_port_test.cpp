// SPDX-License-Identifier: MIT
// World: a port on eth0 of a fake kernel, alone on its link.
#include "ftcs/daemon/ptp_port.h"

#include <string>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/platform/fake_clocks.h"

namespace ftcs::daemon {
namespace {

std::size_t occurrences(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(PtpPort, missing_transmit_stamps_are_said_once_and_counted) {
  platform::FakeClocks kernel;
  kernel.gives_tx_stamps = false;
  PtpOptions options;
  options.interface = options.socket.interface = "eth0";
  options.timestamps = platform::TimestampMode::kSoftware;
  options.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;  // asks once a second by itself
  options.duration = Duration::from_ns(20e9);
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_ptp(kernel, options), kNotLocked);
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_GT(kernel.sent.size(), 15U);
  EXPECT_EQ(occurrences(said, "no transmit timestamp within 10 ms"), 1U) << said;
  EXPECT_NE(said.find("missing_transmit_stamp 1"), std::string::npos) << "15 and more: " << said;
}

}  // namespace
}  // namespace ftcs::daemon
