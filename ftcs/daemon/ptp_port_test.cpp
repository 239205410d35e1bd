// SPDX-License-Identifier: MIT
// World: a port on eth0 of a fake kernel, alone on its link.
#include "ftcs/daemon/ptp_port.h"

#include <string>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "test/support/fake_clocks.h"
#include "test/support/fake_network.h"

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
  options.protocol.delay_mechanism =
      ptp::DelayMechanism::kPeerToPeer;  // asks once a second by itself
  options.duration = Duration::from_ns(20e9);
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_ptp(kernel, options), kNotLocked);
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_GT(kernel.sent.size(), 15U);
  EXPECT_EQ(occurrences(said, "no transmit timestamp within 10 ms"), 1U) << said;
  const std::string counted = "missing_transmit_stamp ";
  const auto at = said.find(counted);
  ASSERT_NE(at, std::string::npos) << said;
  EXPECT_GE(std::stoi(said.substr(at + counted.size())), 15) << said;
}

/// A receiver with a virtual clock and a transmitter 10 us away.
struct Link {
  Link() {
    options.interface = options.socket.interface = "eth0";
    options.timestamps = platform::TimestampMode::kSoftware;
    options.clock.initial_offset = Duration::from_ns(kTai);
    options.duration = Duration::from_ns(60 * kSecond);
  }
  int run() {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = run_ptp(kernel, options);
    said = testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
    return code;
  }

  NetworkKernel kernel;
  PtpOptions options;
  std::string said;
};

TEST(PtpPort, without_a_path_delay_it_is_not_locked_and_says_why) {
  Link link;
  link.kernel.stamp_delay_ns = -1.0;
  EXPECT_EQ(link.run(), kNotLocked);
  EXPECT_EQ(occurrences(link.said, "no path delay was measured"), 2U) << "and at the end";
  EXPECT_NE(link.said.find("summary: not locked"), std::string::npos) << link.said;
}

TEST(PtpPort, transmit_stamps_that_take_longer_than_their_timeout_measure_the_path) {
  Link link;
  link.kernel.stamp_delay_ns = 60e6;
  EXPECT_EQ(link.run(), kSuccess) << link.said;
  EXPECT_NE(link.said.find("one that comes later is used"), std::string::npos) << link.said;
  EXPECT_EQ(link.said.find("no path delay"), std::string::npos) << link.said;
}

// A cable or DHCP that is late at boot: nobody starts the service again.
TEST(PtpPort, waits_for_a_late_interface_says_why_and_locks) {
  for (const bool is_up : {false, true}) {
    Link link;
    link.kernel.interface_has_address = false;
    if (!is_up) link.kernel.interface_flags = 0;
    link.kernel.on_second = [&] {
      if (link.kernel.ideal_ns < 20 * kSecond) return;
      link.kernel.interface_flags = IFF_UP | IFF_RUNNING;
      link.kernel.interface_has_address = true;
    };
    EXPECT_EQ(link.run(), kSuccess) << link.said;
    const char* const why = is_up ? "; ip address add ADDRESS/24 dev eth0 or DHCP; or -2 for "
                                    "Ethernet, -6 for IPv6"
                                  : "the interface is down; ip link set eth0 up";
    EXPECT_NE(link.said.find(why), std::string::npos) << link.said;
    EXPECT_EQ(occurrences(link.said, "link down: "), 1U) << link.said;
    EXPECT_EQ(occurrences(link.said, "LISTENING to FAULTY"), 1U) << link.said;
    EXPECT_EQ(occurrences(link.said, "FAULTY to LISTENING"), 1U) << link.said;
  }
}

TEST(PtpPort, a_missing_carrier_at_the_start_is_the_reason_unless_somebody_is_heard) {
  Link link;
  link.kernel.interface_flags = IFF_UP;
  link.kernel.is_silent = true;
  link.options.duration = Duration::from_ns(10 * kSecond);
  EXPECT_EQ(link.run(), kNotLocked) << link.said;
  EXPECT_NE(link.said.find("port 1 (eth0): the link of eth0 is down: no carrier; the cable"),
            std::string::npos)
      << link.said;
  EXPECT_NE(link.said.find("not locked: the link of eth0 is down: no carrier"), std::string::npos)
      << link.said;
  Link of_some_virtual_interface;
  of_some_virtual_interface.kernel.interface_flags = IFF_UP;
  EXPECT_EQ(of_some_virtual_interface.run(), kSuccess) << of_some_virtual_interface.said;
}

TEST(PtpPort, an_interface_that_stays_down_is_the_reason_at_the_end) {
  for (const Role role : {Role::kTimeReceiver, Role::kTimeTransmitter}) {
    Link link;
    link.kernel.interface_flags = 0;
    link.options.role = role;
    link.options.duration = Duration::from_ns(10 * kSecond);
    EXPECT_EQ(link.run(), kNotLocked) << link.said;
    EXPECT_NE(link.said.find("the interface is down; ip link set eth0 up"), std::string::npos);
    if (role == Role::kTimeReceiver) {
      EXPECT_NE(link.said.find("not locked: eth0 is down; expected "), std::string::npos)
          << link.said;
    }
  }
}

TEST(PtpPort, a_reference_that_jumps_is_followed_or_refused_as_at_the_start_and_it_says_so) {
  struct Case {
    double jump_ns;
    bool first_step;
    int code;
    const char* said;
  };
  for (const Case& expected :
       {Case{0.75 * kSecond, false, kSuccess, "starting anew; slewing the clock there takes 25."},
        Case{2 * kSecond, true, kSuccess, "starting anew; the clock is stepped there"},
        Case{2 * kSecond, false, kNotLocked, "more than 1 s is refused (--first-step"}}) {
    Link link;
    link.options.follower.first_step = expected.first_step;
    link.kernel.on_second = [&] {
      if (link.kernel.ideal_ns > 20 * kSecond) {
        link.kernel.reference_ahead = kTai + expected.jump_ns;
      }
    };
    EXPECT_EQ(link.run(), expected.code) << expected.said;
    EXPECT_EQ(occurrences(link.said, "the reference jumped by +"), 1U) << link.said;
    EXPECT_NE(link.said.find(expected.said), std::string::npos) << link.said;
  }
}

}  // namespace
}  // namespace ftcs::daemon
