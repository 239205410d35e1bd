// SPDX-License-Identifier: MIT
#include "ftcs/daemon/port_data_sets.h"

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/daemon/clock_follower.h"
#include "test/support/manual_source.h"

namespace ftcs::daemon {
namespace {

using ptp::PortState;

// phc2sys and `ftcs phc` follow the adapter's clock once its port says that it receives time.
TEST(PortDataSets, only_a_clock_that_is_steered_is_offered_to_those_who_would_follow_it) {
  platform::LinuxKernel kernel;
  Log log{kernel, stdout, 0};
  test::ManualSource source;
  VirtualClock clock{source, {}};
  struct Case {
    ClockKind clock;
    bool hardware_stamps;
    PortState state;
  };
  for (const auto& [kind, hardware, expected] :
       {Case{ClockKind::kPhc, true, PortState::kTimeReceiver},
        Case{ClockKind::kVirtual, true, PortState::kUncalibrated},
        Case{ClockKind::kVirtual, false, PortState::kTimeReceiver},
        Case{ClockKind::kSystem, false, PortState::kTimeReceiver}}) {
    PtpOptions options;
    options.interface = "eth0";
    options.clock.kind = kind;
    PortFacts facts;
    facts.hardware_stamps = hardware;
    const ClockFollower follower(options, log, clock, source.now(), hardware, "test");
    const auto sets = data_sets(options, facts, PortState::kTimeReceiver, std::nullopt,
                                follower.record(), source.now());
    EXPECT_EQ(sets.port.state, expected);
    EXPECT_EQ(sets.properties.state, expected);
    EXPECT_EQ(data_sets(options, facts, PortState::kListening, std::nullopt, follower.record(),
                        source.now())
                  .port.state,
              PortState::kListening);
  }
}

}  // namespace
}  // namespace ftcs::daemon
