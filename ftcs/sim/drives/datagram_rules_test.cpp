// SPDX-License-Identifier: MIT
// The world: SubDevices in a line, one datagram per frame. Expectations come from ETG.1000.4.
#include <gtest/gtest.h>

#include "test/support/wire_bench.h"

namespace ftcs::ethercat {
namespace {

using test::WireBench;
using enum Command;

constexpr std::uint16_t kStation = 0x1001;

TEST(DatagramRules, each_device_counts_a_broadcast_and_moves_its_position_on) {
  WireBench bench;
  bench.add_line(3);
  const auto reply = bench.read({kBrd, 0, reg::kType}, 1);
  EXPECT_EQ(reply.working_counter, 3);
  EXPECT_EQ(reply.position, 3);
  EXPECT_EQ(reply.data[0], 0x11);
}

TEST(DatagramRules, auto_increment_reaches_exactly_one) {
  WireBench bench;
  bench.add_line(3);
  EXPECT_EQ(bench.write(Target::at_position(kApwr, 1, reg::kStationAddress), std::uint16_t{7})
                .working_counter,
            1);
  EXPECT_EQ(bench.segment()[1].memory().get<std::uint16_t>(reg::kStationAddress), 7);
  EXPECT_EQ(bench.segment()[0].memory().get<std::uint16_t>(reg::kStationAddress), 0);
  EXPECT_EQ(bench.read({kFprd, 7, reg::kType}, 1).working_counter, 1);
  EXPECT_EQ(bench.read({kFprd, 8, reg::kType}, 1).working_counter, 0);
}

TEST(DatagramRules, a_broadcast_read_ors) {
  WireBench bench;
  bench.add_line(2);
  bench.write(Target::at_position(kApwr, 0, reg::kStationAddress), std::uint16_t{0x0101});
  bench.write(Target::at_position(kApwr, 1, reg::kStationAddress), std::uint16_t{0x1010});
  EXPECT_EQ(bench.read({kBrd, 0, reg::kStationAddress}, 2).value<std::uint16_t>(), 0x1111);
}

TEST(DatagramRules, frmw_reads_one_and_writes_the_others) {
  WireBench bench;
  bench.add_line(4);
  bench.write(Target::at_position(kApwr, 0, reg::kStationAddress), kStation);
  EXPECT_EQ(bench.read({kFrmw, kStation, reg::kSystemTime}, 8).working_counter, 4);
}

}  // namespace
}  // namespace ftcs::ethercat
