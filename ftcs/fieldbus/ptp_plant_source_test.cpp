// SPDX-License-Identifier: MIT
// The world: a fake kernel with a PTP transmitter 10 us away.
#include "ftcs/fieldbus/ptp_plant_source.h"

#include <chrono>
#include <filesystem>

#include <gtest/gtest.h>

#include "test/support/fake_network.h"

namespace ftcs::daemon {
namespace {

PtpOptions on_eth0() {
  PtpOptions options;
  options.interface = options.socket.interface = "eth0";
  options.timestamps = platform::TimestampMode::kSoftware;
  options.log_level = 3;
  return options;
}

/// The receiver alone, for so long of the kernel's time.
struct Receiver {
  explicit Receiver(platform::FakeClocks& kernel, double seconds)
      : log(kernel, stderr, 3), options(on_eth0()) {
    options.follower.first_step = true;
    options.duration = Duration::from_ns(seconds * kSecond);
    auto clocks = open_ptp_clocks(kernel, options, log);
    const auto facts = port_facts(kernel, options, *clocks);
    receiver = std::make_unique<PlantReceiver>(kernel, options, log, std::move(clocks->timestamps),
                                               *facts, nullptr);
    testing::internal::CaptureStdout();
    (void)receiver->run([] { return false; });
    (void)testing::internal::GetCapturedStdout();
  }
  Log log;
  PtpOptions options;
  std::unique_ptr<PlantReceiver> receiver;
};

TEST(PlantReceiver, tells_plant_time_of_the_grandmaster_against_the_clock_of_the_cycle) {
  NetworkKernel kernel;
  const Receiver world(kernel, 60.0);
  const auto reading = world.receiver->mailbox().take();
  ASSERT_TRUE(reading) << world.receiver->reason();
  EXPECT_EQ(world.receiver->reason(), "");
  // What the grandmaster shows now, and as much earlier as the reading is old.
  const std::int64_t now = kernel.clock_ns(CLOCK_MONOTONIC);
  const double age = static_cast<double>(now) - reading->instant.since_epoch().ns();
  const auto shown =
      platform::FakeClocks::kEpoch + std::llround(kernel.ideal_ns + kernel.reference_ahead - age);
  EXPECT_NEAR((reading->plant - on_dc_epoch(shown)).ns(), 0.0, 2000.0);
}

TEST(PlantReceiver, without_a_grandmaster_says_so) {
  platform::FakeClocks kernel;
  const Receiver world(kernel, 20.0);
  EXPECT_FALSE(world.receiver->mailbox().take());
  EXPECT_NE(world.receiver->reason().find("no time transmitter was heard on eth0, domain 0"),
            std::string::npos)
      << world.receiver->reason();
}

TEST(PlantReceiver, takes_no_plant_time_from_an_arbitrary_epoch) {
  NetworkKernel kernel;
  kernel.reference_ahead = -static_cast<double>(platform::FakeClocks::kEpoch) + 1e15;
  const Receiver world(kernel, 60.0);
  EXPECT_FALSE(world.receiver->mailbox().take());
  EXPECT_NE(world.receiver->reason().find("shows a time before the year 2000: an arbitrary epoch"),
            std::string::npos)
      << world.receiver->reason();
}

TEST(PtpPlantSource, follows_in_a_thread_of_its_own_and_ends_with_it) {
  NetworkKernel kernel;
  auto source = PtpPlantSource::start(kernel, on_eth0());
  ASSERT_TRUE(source) << source.error();
  std::optional<PlantReading> reading;
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds{20};
  while (!reading && std::chrono::steady_clock::now() < give_up) reading = (*source)->read({});
  EXPECT_TRUE(reading) << (*source)->reason();
}

// --ptp-config may name the file of a service that runs on the same host.
TEST(PtpPlantSource, leaves_the_driftfile_of_its_configuration_to_whose_it_is) {
  NetworkKernel kernel;
  PtpOptions options = on_eth0();
  options.follower.driftfile = testing::TempDir() + "ftcs-plant-driftfile";
  std::filesystem::remove(options.follower.driftfile);
  auto source = PtpPlantSource::start(kernel, options);
  ASSERT_TRUE(source) << source.error();
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds{20};
  while (!(*source)->read({}) && std::chrono::steady_clock::now() < give_up) continue;
  source->reset();
  EXPECT_FALSE(std::filesystem::exists(options.follower.driftfile));
}

TEST(PtpPlantSource, without_the_interface_says_why_at_once) {
  NetworkKernel kernel;
  kernel.interface_exists = false;
  const auto source = PtpPlantSource::start(kernel, on_eth0());
  ASSERT_FALSE(source);
  EXPECT_NE(source.error().find("eth0"), std::string::npos) << source.error();
}

}  // namespace
}  // namespace ftcs::daemon
