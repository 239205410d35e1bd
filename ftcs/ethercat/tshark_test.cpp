// SPDX-License-Identifier: MIT
//
// The world: a whole bring-up of two drives to OP and some cycles, both directions, as Ethernet and
// as UDP encapsulation in one capture each. tshark, which shares no code with us, must find nothing
// malformed and must read what we meant. Skipped where tshark is not installed.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ethercat/maindevice/csp_profile.h"
#include "test/support/main_bench.h"
#include "test/support/shell_lines.h"

namespace ftcs::ethercat {
namespace {

using ftcs::test::lines_of;

/// A capture file of Ethernet packets (libpcap's format, link type 1).
class Capture {
 public:
  Capture() {
    std::string name = (std::filesystem::temp_directory_path() / "ftcs-ecat-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) folder_ = name;
    file_.open(path(), std::ios::binary);
    put32(0xA1B2C3D4);
    put32(0x00040002);
    for (const std::uint32_t value : {0U, 0U, 65535U, 1U}) put32(value);
  }
  ~Capture() { std::filesystem::remove_all(folder_); }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  [[nodiscard]] std::string path() const { return (folder_ / "capture.pcap").string(); }
  void add(FreeRunningTime time, ConstBytes packet) {
    const std::int64_t ns = time.since_epoch().floor_ns();
    put32(static_cast<std::uint32_t>(ns / 1'000'000'000));
    put32(static_cast<std::uint32_t>(ns % 1'000'000'000 / 1000));
    put32(static_cast<std::uint32_t>(packet.size()));
    put32(static_cast<std::uint32_t>(packet.size()));
    file_.write(reinterpret_cast<const char*>(packet.data()),
                static_cast<std::streamsize>(packet.size()));
    ++count_;
  }
  [[nodiscard]] std::vector<std::string> tshark(const std::string& arguments) {
    file_.flush();
    return lines_of("tshark -r " + path() + " " + arguments + " 2>/dev/null");
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  void put32(std::uint32_t value) {
    std::array<std::uint8_t, 4> bytes{};
    store(bytes, 0, value);
    file_.write(reinterpret_cast<const char*>(bytes.data()), 4);
  }
  std::filesystem::path folder_;
  std::ofstream file_;
  std::size_t count_ = 0;
};

/// Ethernet, IPv4 and UDP around a frame; checksums left out (zero is "none" for UDP).
std::vector<std::uint8_t> in_udp(ConstBytes frame) {
  std::vector<std::uint8_t> packet(14 + 20 + 8);
  packet[12] = 0x08;
  const auto put16 = [&packet](std::size_t at, std::size_t value) {
    packet[at] = static_cast<std::uint8_t>(value >> 8);
    packet[at + 1] = static_cast<std::uint8_t>(value);
  };
  packet[14] = 0x45;
  put16(16, 20 + 8 + frame.size());
  packet[22] = 64;
  packet[23] = 17;
  packet[26] = packet[30] = 127;
  packet[29] = packet[33] = 1;
  put16(34, 40000);
  put16(36, kUdpPort);
  put16(38, 8 + frame.size());
  packet.insert(packet.end(), frame.begin(), frame.end());
  return packet;
}

class Tshark : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (lines_of("command -v tshark").empty()) GTEST_SKIP() << "tshark is not installed";
  }
};
INSTANTIATE_TEST_SUITE_P(Encapsulation, Tshark, ::testing::Values(false, true),
                         [](const auto& parameter) {
                           return parameter.param ? "udp" : "ethernet";
                         });

/// Every frame of the bench, both directions, as this encapsulation has it.
void record(test::MainBench& bench, Capture& capture, bool udp) {
  bench.capture = [&capture, udp](FreeRunningTime time, ConstBytes frame) {
    if (udp) {
      capture.add(time, in_udp(frame));
      return;
    }
    std::array<std::uint8_t, kMaxEthernetSize> buffer{};
    const auto ethernet = encode_ethernet(buffer, {0x02, 0x46, 0x54, 0x43, 0x53, 1}, frame);
    ASSERT_TRUE(ethernet);
    if (capture.count() % 2 == 1) mark_returned(buffer);
    capture.add(time, *ethernet);
  };
}

MainDeviceConfig quick_config() {
  constexpr Nanoseconds kCycle{1'000'000};
  static constexpr auto kObjects = csp_objects(kCycle);
  MainDeviceConfig config;
  config.clocks.drift_pulses = 5;
  config.process.objects = kObjects;
  config.process.cycle = kCycle;
  config.process.sync0_shift = Nanoseconds{500'000};
  return config;
}

TEST_P(Tshark, reads_a_bring_up_and_cycles_without_an_error) {
  test::MainBench bench(quick_config());
  bench.add_line(2, Nanoseconds{50});
  Capture capture;
  record(bench, capture, GetParam());
  bench.bring_up();
  ASSERT_TRUE(bench.main().cyclic());
  bench.run(150);
  bench.main().request_operational();
  bench.run(50);

  EXPECT_TRUE(capture.tshark("-Y '_ws.malformed || _ws.expert.severity == error'").empty());
  EXPECT_EQ(capture.tshark("-Y ecat").size(), capture.count());
  EXPECT_FALSE(capture.tshark("-Y 'ecat_mailbox.coe.sdoidx == 0x1c12'").empty());
  // Eight bytes of FRMW and the process image in each cycle, both directions.
  const auto cycles = capture.tshark("-Y 'ecat.sub1.cmd == 0x0e && ecat.sub2.cmd == 0x0c'");
  EXPECT_EQ(cycles.size(), 2U * 200U);
  const auto replies =
      capture.tshark("-Y 'ecat.sub2.cmd == 0x0c && ecat.sub2.cnt == 6' -T fields -e frame.number");
  EXPECT_EQ(replies.size(), 200U) << "working counter of two drives, as the dissector counts it";
}

TEST_P(Tshark, reads_the_way_back_of_a_restarted_drive_without_an_error) {
  test::MainBench bench(quick_config());
  bench.add_line(2, Nanoseconds{50});
  bench.bring_up();
  ASSERT_TRUE(bench.main().cyclic());
  bench.main().request_operational();
  bench.run(300);
  Capture capture;
  record(bench, capture, GetParam());
  bench.segment().power_cycle(1, bench.now());
  bench.run(1000);
  ASSERT_EQ(bench.main().counters().reintegrated, 1U);
  EXPECT_TRUE(capture.tshark("-Y '_ws.malformed || _ws.expert.severity == error'").empty());
  EXPECT_EQ(capture.tshark("-Y ecat").size(), capture.count());
  EXPECT_FALSE(capture.tshark("-Y 'ecat_mailbox.coe.sdoidx == 0x1c12'").empty());
}

}  // namespace
}  // namespace ftcs::ethercat
