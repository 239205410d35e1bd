// SPDX-License-Identifier: MIT
// World: CLOCK_REALTIME of a fake kernel, some seconds and 20 ppm away from TAI; a ptp4l that
// reports one Sync and one Delay_Req a second, stamped by that clock over 10 us of path, and
// answers questions; peer to peer it reports Syncs alone and tells its link delay. `error()` is the
// truth.
#include "ftcs/daemon/monitor_receiver.h"

#include <cmath>
#include <filesystem>
#include <unistd.h>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/ptp_clock.h"
#include "test/support/fake_clocks.h"
#include "test/support/monitor_fixture.h"

namespace ftcs::daemon {
namespace {

using platform::FakeClocks;
using platform::LocalSocket;

constexpr double kSecond = 1e9;

class MonitorReceiverTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "ftcs-monitor-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
    options.source = Source::kPtp4l;
    options.interface = "eth0";
    options.timestamps = platform::TimestampMode::kSoftware;
    options.clock.kind = ClockKind::kSystem;
    options.monitor.stamps = (folder / "monitor").string();
    options.monitor.management = (folder / "ptp4l").string();
    options.management.socket = "";
    options.log_level = 3;
    options.duration = Duration::from_ns(60 * kSecond);
    kernel.system.oscillator = 1.0 + 20e-6;
    ptp4l.emplace(std::move(*LocalSocket::bind(options.monitor.management)));
    kernel.on_poll = [this] {
      if (on_turn) on_turn();
      answer();
      report();
    };
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  int run() {
    auto clocks = open_ptp_clocks(kernel, options, log);
    EXPECT_TRUE(clocks.ok()) << clocks.error();
    PortFacts facts;
    const int code = MonitorReceiver(kernel, options, log, std::move(clocks->timestamps), facts,
                                     clocks->real.get())
                         .run();
    foreign_steps = clocks->real->clock().foreign_steps();
    return code;
  }
  /// Of CLOCK_REALTIME against UTC.
  [[nodiscard]] double error() const { return kernel.system.time_ns - kernel.ideal_ns; }

  void answer() {
    while (const auto datagram = ptp4l->receive()) {
      ++questions;
      if (silent) continue;
      ptp::ManagementMessage message = *ptp::decode_management(datagram->bytes);
      message.body.action = static_cast<std::uint8_t>(ptp::ManagementAction::kResponse);
      if (message.id == ptp::ManagementId::kPortDataSet) {
        ptp::PortDataSet port;
        port.state = ptp::PortState::kTimeReceiver;
        port.mean_link_delay = Duration::from_ns(told_link_delay);
        message.data = port;
      } else {
        message.data = ptp::TimePropertiesDataSet{utc_offset, 0x0C, 0xA0};
      }
      (void)ptp4l->send(datagram->sender, ptp::encode_management(message).view());
    }
  }
  // The reference is TAI: ideal time and 37 s.
  void report() {
    if (kernel.ideal_ns < next_report_ns) return;
    next_report_ns = kernel.ideal_ns + 0.9 * kSecond;
    const double tai = kernel.ideal_ns + 37 * kSecond;
    const auto stamp = [](double ns) { return FakeClocks::kEpoch + std::llround(ns); };
    const std::int64_t local = stamp(kernel.system.time_ns);
    (void)ptp4l->send(options.monitor.stamps,
                      ptp::fake::report(true, sequence, stamp(tai - path), local, transmitter));
    if (!options.protocol.peer_to_peer()) {
      (void)ptp4l->send(options.monitor.stamps,
                        ptp::fake::report(false, sequence, stamp(tai + path), local, transmitter));
    }
    ++sequence;
  }

  FakeClocks kernel;
  Log log{kernel, stdout, 3};
  PtpOptions options;
  std::filesystem::path folder;
  std::optional<LocalSocket> ptp4l;
  std::uint64_t foreign_steps = 0;
  std::function<void()> on_turn;
  std::uint16_t sequence = 0;
  double next_report_ns = 0.0;
  std::int16_t utc_offset = 37;
  std::uint8_t transmitter = 0xA;
  double path = 10e3;
  double told_link_delay = 0.0;  ///< 0: not measured yet
  bool silent = false;
  int questions = 0;
};

TEST_F(MonitorReceiverTest, a_first_step_of_the_clock_is_no_jump_of_the_reference) {
  kernel.system.time_ns = -100 * kSecond;
  options.follower.first_step = true;
  double settled_at_s = 0.0;
  on_turn = [&] {
    if (std::abs(error()) > 1'000.0) settled_at_s = kernel.ideal_ns / kSecond;
  };
  EXPECT_EQ(run(), kSuccess);
  EXPECT_NEAR(error(), 0.0, 100.0);
  EXPECT_LT(settled_at_s, 10.0);
}

TEST_F(MonitorReceiverTest, an_offset_of_seconds_is_not_followed_where_no_step_is_allowed) {
  kernel.system.time_ns = 5 * kSecond;
  EXPECT_EQ(run(), kNotLocked);
  EXPECT_NEAR(kernel.system.steering(), 1.0, 1e-15) << "and touches nothing";
}

TEST_F(MonitorReceiverTest, a_utc_offset_that_is_put_right_is_slewed_and_never_stepped) {
  options.follower.first_step = true;
  utc_offset = 36;
  double last = 0.0;
  double largest_move = 0.0;  // in a turn, after the start
  on_turn = [&] {
    if (kernel.ideal_ns > 20 * kSecond) utc_offset = 37;
    if (kernel.ideal_ns > 19 * kSecond) {
      largest_move = std::max(largest_move, std::abs(error() - last));
    }
    last = error();
  };
  options.duration = Duration::from_ns(120 * kSecond);
  options.follower.servo.limits =
      RateLimits::symmetric_ppb(100e6);  // else a second takes half an hour
  EXPECT_EQ(run(), kSuccess);
  EXPECT_NEAR(error(), 0.0, 100.0);
  EXPECT_LT(largest_move, 0.1 * kSecond);
}

TEST_F(MonitorReceiverTest, a_utc_offset_that_cannot_be_true_changes_nothing) {
  on_turn = [&] {
    if (kernel.ideal_ns > 20 * kSecond) utc_offset = 34;
  };
  options.duration = Duration::from_ns(100 * kSecond);
  EXPECT_EQ(run(), kSuccess);
  EXPECT_NEAR(error(), 0.0, 100.0);
}

TEST_F(MonitorReceiverTest, steers_nothing_before_the_timescale_is_known) {
  silent = true;
  on_turn = [&] { silent = kernel.ideal_ns < 1.5 * kSecond; };
  EXPECT_EQ(run(), kSuccess) << "asked again every second";
  EXPECT_NEAR(error(), 0.0, 100.0);
  silent = true;
  on_turn = nullptr;
  sequence = 0;
  kernel.held_names.clear();
  const double steering = kernel.system.steering();
  EXPECT_EQ(run(), kRuntimeError) << "nobody tells";
  EXPECT_EQ(kernel.system.steering(), steering);
}

TEST_F(MonitorReceiverTest, a_step_by_somebody_else_is_counted_and_followed) {
  bool stepped = false;
  on_turn = [&] {
    if (!std::exchange(stepped, stepped || kernel.ideal_ns > 20 * kSecond) && stepped) {
      kernel.system.time_ns += 5e6;
    }
  };
  EXPECT_EQ(run(), kSuccess);
  EXPECT_TRUE(stepped);
  EXPECT_EQ(foreign_steps, 1U);
  EXPECT_NEAR(error(), 0.0, 200.0);
}

TEST_F(MonitorReceiverTest, peer_to_peer_nothing_is_steered_before_ptp4l_knows_its_link_delay) {
  options.protocol.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;
  kernel.system.time_ns = 1e6;
  double error_before = 0.0;
  on_turn = [&] {
    if (kernel.ideal_ns < 20 * kSecond) {
      error_before = error();
    } else {
      told_link_delay = path;
    }
  };
  EXPECT_EQ(run(), kSuccess);
  EXPECT_NEAR(error_before, 1e6 + 20e-6 * 20 * kSecond, 20e3);
  EXPECT_NEAR(error(), 0.0, 100.0);
}

TEST_F(MonitorReceiverTest, peer_to_peer_another_transmitter_is_at_the_end_of_another_link) {
  options.protocol.delay_mechanism = ptp::DelayMechanism::kPeerToPeer;
  told_link_delay = path;
  double largest = 0.0;
  on_turn = [&] {
    if (kernel.ideal_ns > 30 * kSecond) {
      transmitter = 0xB;
      told_link_delay = path = 50e3;
    }
    if (kernel.ideal_ns > 20 * kSecond) largest = std::max(largest, std::abs(error()));
  };
  EXPECT_EQ(run(), kSuccess);
  EXPECT_LT(largest, 1e3);
}

}  // namespace
}  // namespace ftcs::daemon
