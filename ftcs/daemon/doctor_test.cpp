// SPDX-License-Identifier: MIT
// World: a transmitter that nothing stands in the way of, and a machine whose adapter has a clock
// and stamps that nobody has switched on, as before the first start of a daemon. The wire cannot be
// listened to: the interface is the fake kernel's alone.
#include "ftcs/daemon/doctor.h"

#include <algorithm>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"
#include "test/support/fake_network.h"

namespace ftcs::daemon {
namespace {

using diagnosis::Cause;

class Doctor : public testing::Test {
 protected:
  Doctor() {
    kernel.add_adapter_clock();
    kernel.phc.time_ns = kTai;
    options.interface = options.socket.interface = "nowhere0";
    options.clock.kind = ClockKind::kPhc;
    options.duration = Duration::from_ns(10 * kSecond);
  }
  Examination examined() { return examine(kernel, options); }
  /// Somebody sets the clock's frequency once a second, to another value each time.
  void steer(platform::FakeClocks::Clock& clock) {
    kernel.on_second = [&clock] { ++clock.freq; };
  }
  static const diagnosis::Finding& first(const Examination& examination) {
    return examination.findings.front();
  }

  NetworkKernel kernel;
  PtpOptions options;
};

TEST_F(Doctor, has_no_doubt_where_nobody_steers_the_clock) {
  const Examination examination = examined();
  EXPECT_EQ(first(examination).cause, Cause::kLocked) << first(examination).seen;
  EXPECT_EQ(kernel.commands, 0);
}

// The stamps of the adapter are not switched on for a look, but the clock to be looked at is the
// one that is to be steered.
TEST_F(Doctor, does_not_listen_where_the_interface_tells_what_is_wrong) {
  int listened = 0;
  const auto cause = [&] { return first(examine(kernel, options, [&] { ++listened; })).cause; };
  kernel.interface_flags = 0;
  EXPECT_EQ(cause(), Cause::kLinkDown);
  kernel.interface_exists = false;
  EXPECT_EQ(cause(), Cause::kOther);
  EXPECT_EQ(listened, 0);
  kernel.interface_exists = true;
  kernel.interface_flags = IFF_UP | IFF_RUNNING;
  kernel.interface_has_address = false;
  EXPECT_EQ(cause(), Cause::kNoAddress);
  EXPECT_EQ(listened, 1);
}

TEST_F(Doctor, names_another_program_that_steers_the_adapters_clock_though_its_stamps_are_off) {
  for (const bool stamps_are_on : {false, true}) {
    kernel.stamps_are_on = stamps_are_on;
    steer(kernel.phc);
    const Examination examination = examined();
    EXPECT_EQ(first(examination).cause, Cause::kOtherSteers) << first(examination).seen;
    EXPECT_NE(first(examination).seen.find("another program changed /dev/ptp0 "), std::string::npos)
        << first(examination).seen;
    for (const diagnosis::Finding& finding : examination.findings) {
      EXPECT_NE(finding.cause, Cause::kLocked);
    }
  }
}

TEST_F(Doctor, names_another_program_that_steers_the_system_clock) {
  options.clock.kind = ClockKind::kSystem;
  kernel.reference_ahead = kTai;
  steer(kernel.system);
  const Examination examination = examined();
  EXPECT_EQ(first(examination).cause, Cause::kOtherSteers) << first(examination).seen;
}

TEST_F(Doctor, does_not_mind_a_clock_that_is_not_to_be_steered) {
  steer(kernel.other_phc);
  const Examination examination = examined();
  EXPECT_EQ(first(examination).cause, Cause::kLocked) << first(examination).seen;
}

TEST_F(Doctor, takes_a_program_of_ours_for_no_stranger) {
  const auto ours =
      platform::ClockDevice::open_phc(kernel, "/dev/ptp0", platform::ClockAccess::kSteer);
  ASSERT_TRUE(ours.ok());
  steer(kernel.phc);
  const Examination examination = examined();
  EXPECT_EQ(first(examination).cause, Cause::kLocked) << first(examination).seen;
}

}  // namespace
}  // namespace ftcs::daemon
