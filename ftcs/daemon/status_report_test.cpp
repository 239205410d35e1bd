// SPDX-License-Identifier: MIT
//
// World: status objects as they come over the management socket, from this and other versions, and
// what is none.
#include "ftcs/daemon/status_report.h"

#include <gtest/gtest.h>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/daemon/clock_follower.h"
#include "ftcs/daemon/exit_code.h"
#include "test/support/manual_source.h"

namespace ftcs::daemon {
namespace {

TEST(StatusReport, WhatIsNoStatusIsNone) {
  for (const char* text : {"", "hello", "[1, 2]", "{\"locked\": ", "\xff\xfe", "7"}) {
    EXPECT_FALSE(read_status(text).has_value()) << text;
  }
}

TEST(StatusReport, ExitCodesTellTheLock) {
  EXPECT_EQ(read_status(R"({"locked": true})")->exit_code, kSuccess);
  EXPECT_EQ(read_status(R"({"locked": false})")->exit_code, kNotLocked);
  EXPECT_EQ(read_status(R"({"locked": "yes"})")->exit_code, kNotLocked);
  EXPECT_EQ(read_status(R"({"port_state": "MASTER"})")->exit_code, kSuccess);
  EXPECT_EQ(read_status(R"({"port_state": "FAULTY"})")->exit_code, kNotLocked);
  EXPECT_EQ(read_status("{}")->exit_code, kNotLocked);
}

TEST(StatusReport, FieldsOfAnotherTypeAreNotKnown) {
  const auto status =
      read_status(R"({"locked": true, "offset_ns": "a", "samples": 3, "refusals": [1, {}]})");
  ASSERT_TRUE(status.has_value());
  EXPECT_NE(status->text.find("offset          - +/- -"), std::string::npos) << status->text;
  EXPECT_NE(status->text.find("samples         -"), std::string::npos);
}

TEST(StatusReport, ShowsOffsetsAndRefusals) {
  const auto status = read_status(R"({"locked": true, "locked_for_s": 2.5, "offset_ns": -1500.0,
      "offset_sigma_ns": 20.0, "samples": {"used": 7, "rejected": 1, "steps": 0},
      "refusals": [{"time_s": 2.0, "message": "Sync", "verdict": "rejected", "reason": "taken for an outlier",
                    "offset_ns": 9000.0}]})");
  ASSERT_TRUE(status.has_value());
  for (const char* line :
       {"locked          yes, for 2.5 s\n", "offset          -1.500 us +/- 20.00 ns\n",
        "samples         used 7, rejected 1\n",
        "  at            2.000 s: Sync rejected, offset 9.000 us: taken for an outlier\n"}) {
    EXPECT_NE(status->text.find(line), std::string::npos) << line << status->text;
  }
}

TEST(StatusReport, ATimeReceiverThatHearsNobodyKnowsNoOffset) {
  PtpOptions options;
  options.interface = "eth0";
  platform::LinuxKernel kernel;
  Log log(kernel, stdout, 0);
  test::ManualSource source;
  VirtualClock clock(source, {});
  const ClockFollower follower(options, log, clock, source.now(), false, "port 1 (eth0)");
  ptp::TimeReceiver core({});
  const PortFacts facts{};
  const ptp::ManagementCounters management{};
  diagnosis::PortSeen seen;
  seen.settings.interface = "eth0";
  seen.seconds = 10.0;
  const auto json = receiver_status({options, facts, 1.0, management}, core, follower.record(),
                                    seen, source.now());
  EXPECT_NE(json.find("\"offset_ns\": null"), std::string::npos) << json;
  EXPECT_NE(json.find("\"transmitter\": null"), std::string::npos);
  const auto status = read_status(json);
  ASSERT_TRUE(status.has_value());
  EXPECT_EQ(status->exit_code, kNotLocked);
  EXPECT_NE(status->text.find("in a sentence   not locked: no time transmitter was heard on eth0"),
            std::string::npos)
      << status->text;

  const auto sets = data_sets(options, facts, core, follower.record(), source.now());
  EXPECT_EQ(sets.current, ptp::CurrentDataSet{});
  EXPECT_EQ(sets.default_set.quality.clock_class, 255);
  EXPECT_EQ(sets.parent.parent, (ptp::PortIdentity{facts.identity.clock, 0}));
  EXPECT_EQ(sets.time_status.grandmaster_present, 0);
}

TEST(StatusReport, PeerToPeerThePathDelayIsThatOfTheLink) {
  PtpOptions options;
  options.interface = "eth0";
  options.protocol.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;
  platform::LinuxKernel kernel;
  Log log(kernel, stdout, 0);
  test::ManualSource source;
  VirtualClock clock(source, {});
  ClockFollower follower(options, log, clock, source.now(), false, "port 1 (eth0)");
  const Duration link = Duration::from_whole_ns(1500);
  EXPECT_FALSE(follower.on_link_delay({link, {}, true, {}}, source.now(), std::nullopt));
  for (int i = 1; i < 10; ++i) {
    const std::int64_t sent = i * std::int64_t{125'000'000};
    source.instant = FreeRunningTime::from_ns(sent) + link;
    EXPECT_FALSE(
        follower.on_pair({Direction::kForward, ReferenceTime::from_ns(sent), source.instant},
                         source.now(), std::nullopt));
    follower.on_silence();
  }
  const ptp::MonitorSource reports;
  const PortFacts facts{};
  const ptp::ManagementCounters management{};
  const auto json = monitor_status(
      {options, facts, 1.0, management}, reports, ptp::PortState::kTimeReceiver, follower.record(),
      {diagnosis::Cause::kLocked, "offset 3 ns", "", ""}, source.now());
  EXPECT_NE(json.find("\"cause\": \"locked\""), std::string::npos) << json;
  EXPECT_NE(json.find("\"path_delay_ns\": 1500.0"), std::string::npos) << json;
}

}  // namespace
}  // namespace ftcs::daemon
