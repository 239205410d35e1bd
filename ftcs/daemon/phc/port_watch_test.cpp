// SPDX-License-Identifier: MIT
// World: a PTP program on this machine that answers at its management socket, and a hardware clock
// 1 ms ahead of CLOCK_REALTIME plus 37 s.
#include "ftcs/daemon/phc/port_watch.h"

#include <cmath>
#include <filesystem>
#include <unistd.h>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/phc/phc_runner.h"
#include "test/support/fake_clocks.h"

namespace ftcs::daemon {
namespace {

using ptp::PortState;

/// Answers what is asked, as ptp4l does.
struct FakePtpProgram {
  FakePtpProgram() : socket(std::move(*platform::LocalSocket::bind(path))) {}
  ~FakePtpProgram() { std::filesystem::remove(path); }

  void serve() {
    if (silent) return;
    while (const auto datagram = socket.receive()) {
      const auto question = ptp::decode_management(datagram->bytes);
      ASSERT_TRUE(question.ok());
      ptp::ManagementMessage answer = *question;
      answer.body.action = static_cast<std::uint8_t>(ptp::ManagementAction::kResponse);
      if (question->id == ptp::ManagementId::kPortPropertiesNp) {
        ptp::PortPropertiesNp properties;
        properties.state = state;
        properties.port.port = port;
        properties.timestamping = hardware ? 1 : 0;
        properties.interface = ptp::PtpText<32>(interface);
        answer.data = properties;
      } else {
        answer.data = ptp::TimePropertiesDataSet{utc_offset, flags, 0xA0};
      }
      (void)socket.send(datagram->sender, ptp::encode_management(answer).view());
    }
  }

  std::string path =
      (std::filesystem::temp_directory_path() / ("ftcs_port_watch_" + std::to_string(::getpid())))
          .string();
  platform::LocalSocket socket;
  PortState state = PortState::kUncalibrated;
  bool hardware = true;
  std::uint16_t port = 1;
  std::string interface = "eth0";
  std::int16_t utc_offset = 37;
  std::uint8_t flags = 0x0C;  // PTP timescale, offset valid
  bool silent = false;
};

struct World {
  World() {
    kernel.phc.time_ns = 37e9 + 1e6;
    kernel.add_adapter_clock();
    options.automatic = true;
    options.port.socket = program.path;
    options.duration = Duration::from_ns(30e9);
    kernel.on_poll = [this] {
      program.serve();
      if (on_turn) on_turn();
    };
  }
  /// As -w does: one clock follows the other while the port receives time.
  void wait(bool to_system) {
    options.automatic = false;
    options.wait_for_port = true;
    options.source = to_system ? "/dev/ptp0" : "CLOCK_REALTIME";
    options.sink = to_system ? "CLOCK_REALTIME" : "/dev/ptp0";
    program.state = PortState::kTimeReceiver;
  }
  [[nodiscard]] double difference() const {
    return kernel.phc.time_ns - kernel.system.time_ns - 37e9;
  }

  platform::FakeClocks kernel;
  Log log{kernel, stdout, 3};
  PhcOptions options;
  FakePtpProgram program;
  std::function<void()> on_turn;
};

TEST(PortWatch, the_system_clock_follows_the_clock_of_the_port_once_it_receives_time) {
  World world;
  bool touched_early = false;
  world.on_turn = [&] {
    if (world.kernel.ideal_ns > 5e9) {
      world.program.state = PortState::kTimeReceiver;
    } else {
      touched_early = touched_early || world.kernel.commands > 0;
    }
  };
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
  EXPECT_FALSE(touched_early);
  EXPECT_NEAR(world.difference(), 0.0, 50.0) << "UTC by the port's own offset";
}

TEST(PortWatch, a_utc_offset_that_cannot_be_true_changes_nothing) {
  for (const bool to_system : {true, false}) {
    World world;
    world.wait(to_system);
    world.on_turn = [&] {
      if (world.kernel.ideal_ns > 15e9) world.program.utc_offset = 34;
    };
    EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
    EXPECT_NEAR(world.difference(), 0.0, 100.0) << to_system;
  }
}

TEST(PortWatch, another_utc_offset_that_lasts_is_slewed_to_and_never_stepped) {
  for (const bool to_system : {true, false}) {
    World world;
    world.wait(to_system);
    world.options.duration = Duration::from_ns(90e9);
    world.options.servo.limits = RateLimits::symmetric_ppb(100e6);  // else a second takes long
    double last = 0.0;
    double largest_move = 0.0;
    world.on_turn = [&] {
      if (world.kernel.ideal_ns > 15e9) world.program.utc_offset = 36;
      if (world.kernel.ideal_ns > 5e9) {
        largest_move = std::max(largest_move, std::abs(world.difference() - last));
      }
      last = world.difference();
    };
    EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
    EXPECT_NEAR(world.difference(), -1e9, 100.0) << to_system;
    EXPECT_LT(largest_move, 0.1e9) << to_system;
  }
}

// One Announce, believed by the PTP program for two seconds: the clock was stepped by hours.
TEST(PortWatch, one_forged_announcement_moves_no_clock) {
  for (const int forged : {-32'768, 0, 36, 32'767, -1}) {
    for (const bool to_system : {true, false}) {
      World world;
      world.wait(to_system);
      double largest = 0.0;
      world.on_turn = [&] {
        const double s = world.kernel.ideal_ns / 1e9;
        const bool attack = s > 15.0 && s < 17.0;
        world.program.utc_offset = static_cast<std::int16_t>(attack && forged != -1 ? forged : 37);
        world.program.flags = attack && forged == -1 ? 0x04 : 0x0C;
        if (s > 10.0) largest = std::max(largest, std::abs(world.difference()));
      };
      EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
      EXPECT_LT(largest, 1'000.0) << forged << (to_system ? " to the system" : " to the adapter");
    }
  }
}

TEST(PortWatch, a_port_that_stops_receiving_is_not_followed) {
  World world;
  int commands = 0;
  world.program.state = PortState::kTimeReceiver;
  world.on_turn = [&] {
    if (world.kernel.ideal_ns > 10e9) world.program.state = PortState::kListening;
    if (world.kernel.ideal_ns < 12e9) commands = world.kernel.commands;
  };
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kNotLocked);
  // The kernel's own status goes on being told, once a second; the rate is left alone.
  EXPECT_LE(world.kernel.commands - commands, 32);
  EXPECT_NEAR(world.difference(), 0.0, 1'000.0);
}

TEST(PortWatch, a_port_that_begins_to_transmit_is_led_by_the_system_clock_only_if_that_may_lead) {
  for (const bool may_lead : {false, true}) {
    World world;
    world.options.system_may_lead = may_lead;
    world.program.state = PortState::kTimeReceiver;
    double system_rate = 0.0;
    world.on_turn = [&] {
      auto& kernel = world.kernel;
      if (kernel.ideal_ns > 10e9) world.program.state = PortState::kTimeTransmitter;
      if (kernel.ideal_ns < 12e9) system_rate = kernel.system.steering();
      // A while later the hardware clock drifts: who leads now is seen by who follows.
      if (kernel.ideal_ns > 13e9) kernel.phc.oscillator = 1.0 + 5e-6;
    };
    EXPECT_EQ(run_phc(world.kernel, world.options, world.log), may_lead ? kSuccess : kNotLocked);
    EXPECT_NEAR(world.kernel.system.steering(), system_rate, 1e-9) << "is kept";
    EXPECT_EQ(std::abs(world.difference()) < 100.0, may_lead) << world.difference();
    EXPECT_EQ(world.kernel.phc.steering() != 1.0, may_lead);
  }
}

TEST(PortWatch, a_system_clock_that_leads_from_the_start_brings_the_hardware_clock_to_tai) {
  World world;
  world.options.system_may_lead = true;
  world.program.state = PortState::kTimeTransmitter;
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
  EXPECT_NEAR(world.difference(), 0.0, 50.0);
  EXPECT_NEAR(world.kernel.system.steering(), 1.0, 1e-15);
}

TEST(PortWatch, the_clock_of_another_port_that_receives_time_is_followed_instead) {
  World world;
  world.program.state = PortState::kTimeReceiver;
  world.on_turn = [&] {
    if (world.kernel.ideal_ns < 10e9) return;
    world.program.interface = "eth1";
    world.kernel.interface_exists = false;  // that is asked for when another clock is opened
  };
  testing::internal::CaptureStderr();
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kRuntimeError);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("interface eth1: no such device"),
            std::string::npos);
  EXPECT_LT(world.kernel.ideal_ns, 15e9);
}

TEST(PortWatch, of_several_ports_the_receiving_one_counts_and_then_a_transmitting_one) {
  World world;
  auto watch = PortWatch::open(world.options.port);
  ASSERT_TRUE(watch.ok());
  const auto answer = [&](std::uint16_t port, PortState state) {
    world.program.port = port;
    world.program.interface = "eth" + std::to_string(port);
    world.program.state = state;
    static std::int64_t now = 0;
    watch->attend(now += 1'000'000'000);
    world.program.serve();
    watch->attend(now += 1'000'000);
    return watch->port()->state;
  };
  EXPECT_EQ(answer(1, PortState::kTimeTransmitter), PortState::kTimeTransmitter);
  EXPECT_EQ(answer(2, PortState::kListening), PortState::kTimeTransmitter);
  EXPECT_EQ(answer(2, PortState::kTimeReceiver), PortState::kTimeReceiver);
  EXPECT_EQ(answer(1, PortState::kTimeTransmitter), PortState::kTimeReceiver);
  EXPECT_EQ(answer(2, PortState::kListening), PortState::kListening);
  EXPECT_EQ(answer(1, PortState::kTimeTransmitter), PortState::kTimeTransmitter);
  EXPECT_EQ(answer(2, PortState::kTimeTransmitter), PortState::kTimeTransmitter);
  EXPECT_EQ(watch->port()->interface, "eth1") << "no reason to change";
}

TEST(PortWatch, silence_is_no_state) {
  World world;
  auto watch = PortWatch::open(world.options.port);
  ASSERT_TRUE(watch.ok());
  world.program.state = PortState::kTimeReceiver;
  watch->attend(0);
  world.program.serve();
  watch->attend(100'000'000);
  EXPECT_TRUE(watch->is_receiving());
  EXPECT_EQ(watch->port()->interface, "eth0");
  EXPECT_EQ(watch->port()->scale.utc_offset, 37);
  world.program.silent = true;
  watch->attend(4'000'000'000);
  EXPECT_TRUE(watch->is_receiving());
  watch->attend(6'000'000'000);
  EXPECT_FALSE(watch->port().has_value());
}

TEST(PortWatch, software_timestamps_leave_nothing_to_do) {
  World world;
  world.program.state = PortState::kTimeReceiver;
  world.program.hardware = false;
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kRuntimeError);
  EXPECT_EQ(world.kernel.commands, 0);
}

TEST(PortWatch, waits_for_a_port_as_w_does_and_gives_up_with_the_duration) {
  World world;
  world.wait(true);
  world.program.state = PortState::kListening;
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kNotLocked);
  EXPECT_EQ(world.kernel.commands, 0);
  world.kernel.held_names.clear();
  world.program.state = PortState::kTimeReceiver;
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
  EXPECT_NEAR(world.difference(), 0.0, 50.0);
}

// Its grandmaster is gone, or never was: its adapter's clock shows what it likes.
TEST(PortWatch, a_port_that_transmits_is_followed_only_if_that_is_said_twice) {
  for (const bool said : {false, true}) {
    World world;
    world.wait(true);
    world.options.system_may_lead = said;
    world.program.state = PortState::kTimeTransmitter;
    EXPECT_EQ(run_phc(world.kernel, world.options, world.log), said ? kSuccess : kNotLocked);
    EXPECT_EQ(world.kernel.commands > 0, said);
  }
}

TEST(PortWatch, the_system_clock_leads_the_adapter_of_a_port_that_transmits) {
  World world;
  world.wait(false);
  world.program.state = PortState::kTimeTransmitter;
  EXPECT_EQ(run_phc(world.kernel, world.options, world.log), kSuccess);
  EXPECT_NEAR(world.difference(), 0.0, 50.0);
}

}  // namespace
}  // namespace ftcs::daemon
