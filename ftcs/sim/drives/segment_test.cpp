// SPDX-License-Identifier: MIT
// The world: SubDevices whose hops and cables the test chose; crystals of 1 ns tick unless said.
// Oracle: the delays that follow from adding up the configured hops by hand.
#include "ftcs/sim/drives/segment.h"

#include <gtest/gtest.h>

#include "test/support/wire_bench.h"

namespace ftcs::ethercat {
namespace {

using test::WireBench;
using enum Command;

SubDeviceConfig fine_clock() {
  SubDeviceConfig config;
  config.clock.tick = Nanoseconds{1};
  return config;
}

TEST(Segment, a_line_is_visited_in_order_and_the_frame_comes_back_after_all_hops) {
  WireBench bench;
  bench.add_line(3, Nanoseconds{50});
  const WireTime sent = bench.now();
  bench.read({kBrd, 0, 0}, 1);
  // Cable to the first and back, then per hop 300 ns and 50 ns each way.
  EXPECT_EQ(bench.returned() - sent, Duration{Nanoseconds{6 * 50 + 5 * 300}});
  EXPECT_EQ(bench.segment().delay_to(2), Duration{Nanoseconds{2 * 350}});
}

//        ┌─3─ b (1)
//   0 ── a
//        ├─1─ c (2) ─1─ d (3)
//        └─2─ e (4)
TEST(Segment, branches_are_visited_in_the_order_three_one_two) {
  WireBench bench;
  const int a = static_cast<int>(bench.add({}));
  bench.add({.parent = a, .parent_port = 1});
  bench.add({.parent = a, .parent_port = 2});
  bench.add({.parent = a, .parent_port = 3});
  bench.add({.parent = 1, .parent_port = 1});
  const std::size_t expected[] = {0, 3, 1, 4, 2};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(bench.segment().at_position(i), expected[i]);
}

TEST(Segment, receive_times_are_latched_at_each_open_port_as_the_frame_passes) {
  WireBench bench;
  bench.add({}, 0, fine_clock());
  bench.add({.parent = 0, .parent_port = 3, .cable = Nanoseconds{100}}, 0, fine_clock());
  bench.add({.parent = 0, .parent_port = 1, .cable = Nanoseconds{20}}, 0, fine_clock());
  bench.write({kBwr, 0, reg::kReceiveTimePort0}, std::uint32_t{0});
  const EscMemory& memory = bench.segment()[0].memory();
  const auto port = [&](std::size_t p) {
    return memory.get<std::uint32_t>(reg::kReceiveTimePort0 + 4 * p);
  };
  EXPECT_EQ(port(3) - port(0), 300U + 100U + 300U + 100U);
  EXPECT_EQ(port(1) - port(3), 300U + 20U + 300U + 20U);
  EXPECT_EQ(port(2), 0U) << "closed";
  EXPECT_EQ(memory.get<std::uint64_t>(reg::kReceiveTimeProcessingUnit), port(0));
}

TEST(Segment, dl_status_shows_open_and_closed_ports) {
  WireBench bench;
  bench.add_line(2);
  const DlStatus first{bench.segment()[0].memory().get<std::uint16_t>(reg::kDlStatus)};
  const DlStatus last{bench.segment()[1].memory().get<std::uint16_t>(reg::kDlStatus)};
  EXPECT_TRUE(first.open(0) && first.open(1) && !first.open(2) && !first.open(3));
  EXPECT_TRUE(last.open(0) && !last.open(1));
  EXPECT_TRUE(last.loop_closed(1));
}

TEST(Segment, a_cut_cable_hides_what_is_behind_it_until_it_is_mended) {
  WireBench bench;
  bench.add_line(4);
  bench.segment().set_cut(2, true);
  EXPECT_EQ(bench.read({kBrd, 0, 0}, 1).working_counter, 2);
  EXPECT_FALSE(DlStatus{bench.segment()[1].memory().get<std::uint16_t>(reg::kDlStatus)}.open(1));
  bench.segment().set_cut(2, false);
  EXPECT_EQ(bench.read({kBrd, 0, 0}, 1).working_counter, 4);
  bench.segment().set_cut(0, true);
  EXPECT_EQ(bench.read({kBrd, 0, 0}, 1).working_counter, 0);
}

TEST(Segment, refuses_impossible_wiring) {
  WireBench bench;
  AffineOscillator crystal;
  Segment& segment = bench.segment();
  EXPECT_EQ(segment.add({}, {.parent = 0}, crystal).error(), SegmentError::kNoSuchParent);
  bench.add({});
  EXPECT_EQ(segment.add({}, {.parent = 1}, crystal).error(), SegmentError::kNoSuchParent);
  EXPECT_EQ(segment.add({}, {.parent = 0, .parent_port = 0}, crystal).error(),
            SegmentError::kPortTaken);
  bench.add({.parent = 0, .parent_port = 1});
  EXPECT_EQ(segment.add({}, {.parent = 0, .parent_port = 1}, crystal).error(),
            SegmentError::kPortTaken);
}

/// Error of the local copy of the second of two SubDevices against the first, in ns, from the
/// crystals themselves (not from 0x092C).
double true_error(WireBench& bench) {
  const WireTime now = bench.now();
  const auto reference = bench.segment()[0].dc().system_time(now);
  const auto copy = bench.segment()[1].dc().system_time(now);
  return static_cast<double>(static_cast<std::int64_t>(copy - reference));
}

TEST(DistributedClock, a_copy_settles_within_a_second_at_any_skew_and_holds_between_frames) {
  for (const double ppm : {-100.0, 100.0, 250.0}) {
    SCOPED_TRACE(ppm);
    WireBench bench;
    bench.add({}, -ppm / 2);
    bench.add({.parent = 0}, ppm / 2);
    bench.set_step(Nanoseconds{1'000'000});
    // The two local clocks started together, 300 ns of hop are not compensated: tell the second.
    bench.write(Target::at_position(kApwr, 1, reg::kSystemTimeDelay), std::uint32_t{300});
    for (int i = 0; i < 1000; ++i) {
      bench.read(Target::at_position(kArmw, 0, reg::kSystemTime), 8);
    }
    EXPECT_LT(std::abs(bench.segment()[1].system_time_difference()), 100);
    EXPECT_NEAR(true_error(bench), 0.0, 50.0);
    bench.wait(Nanoseconds{9'000'000});  // no frame for ten cycles
    EXPECT_NEAR(true_error(bench), 0.0, 100.0);
  }
}

TEST(DistributedClock, four_byte_system_times_compare_modulo_two_to_the_thirty_second) {
  WireBench bench;
  SubDeviceConfig config;
  config.clock.initial_local = Nanoseconds{0xFFFF0000};
  bench.add({}, 20, config);
  bench.add({.parent = 0}, -20, config);
  bench.set_step(Nanoseconds{100'000});
  for (int i = 0; i < 3000; ++i) bench.read(Target::at_position(kArmw, 0, reg::kSystemTime), 4);
  EXPECT_LT(std::abs(bench.segment()[1].system_time_difference()), 30);
}

TEST(DistributedClock, a_zero_at_the_start_does_not_make_it_slew_once_the_loop_is_reset) {
  WireBench bench;
  SubDeviceConfig config;
  config.clock.initial_local = Nanoseconds{1'000'000'000'000};
  bench.add({}, 0, config);
  bench.write({kBwr, 0, reg::kSystemTime}, std::uint64_t{0});
  bench.write({kBwr, 0, reg::kSystemTime}, std::uint64_t{0});
  bench.write({kBwr, 0, reg::kSpeedCounterStart}, std::uint16_t{0x1000});
  EXPECT_EQ(bench.segment()[0].system_time_difference(), 0);
  const Duration before = bench.segment()[0].dc().local_time(bench.now());
  bench.wait(Nanoseconds{1'000'000'000});
  EXPECT_EQ(bench.segment()[0].dc().local_time(bench.now()) - before,
            Duration{Nanoseconds{1'000'000'000}});
}

// IgH's master is a kernel module and cannot be run here: the forms of its datagrams
// (ethercat 1.5.2).
TEST(DistributedClock, takes_the_accesses_that_the_igh_master_makes) {
  WireBench bench;
  bench.add({}, 50, fine_clock());
  bench.add({.parent = 0}, -80, fine_clock());
  const auto second = [](Command command, std::uint16_t offset) {
    return Target::at_position(command, 1, offset);
  };
  // Old times, a latch of one byte, new times: the port through which the frame came has changed.
  const auto old_times = bench.read(second(kAprd, reg::kReceiveTimePort0), 16);
  EXPECT_EQ(bench.write({kBwr, 0, reg::kReceiveTimePort0}, std::uint8_t{0}).working_counter, 2);
  const auto new_times = bench.read(second(kAprd, reg::kReceiveTimePort0), 16);
  EXPECT_NE(new_times.value<std::uint32_t>(), old_times.value<std::uint32_t>());
  EXPECT_EQ(load<std::uint32_t>(new_times.data, 4), load<std::uint32_t>(old_times.data, 4))
      << "port 1 is closed";
  // Offset and delay as one; then system time, receive time, offset and delay as one.
  std::vector<std::uint8_t> offset_and_delay(12);
  store(Bytes{offset_and_delay}, 0, std::uint64_t{5'000'000'000});
  store(Bytes{offset_and_delay}, 8, std::uint32_t{300});
  EXPECT_EQ(bench.exchange(second(kApwr, reg::kSystemTimeOffset), offset_and_delay).working_counter,
            1);
  const auto clock = bench.read(second(kAprd, reg::kSystemTime), 28);
  EXPECT_EQ(clock.working_counter, 1);
  EXPECT_EQ(load<std::uint64_t>(clock.data, 16), 5'000'000'000U);
  EXPECT_EQ(load<std::uint32_t>(clock.data, 24), 300U);
  EXPECT_GT(clock.value<std::uint64_t>(), 5'000'000'000U);
  // AssignActivate as one word, both cycle times as one.
  std::vector<std::uint8_t> cycles(8);
  store(Bytes{cycles}, 0, std::uint32_t{1'000'000});
  EXPECT_EQ(bench.write(second(kApwr, reg::kCyclicUnitControl), std::uint16_t{0}).working_counter,
            1);
  EXPECT_EQ(bench.exchange(second(kApwr, reg::kSync0CycleTime), cycles).working_counter, 1);
  const std::uint64_t start =
      bench.read(second(kAprd, reg::kSystemTime), 8).value<std::uint64_t>() + 1'000'000;
  bench.write(second(kApwr, reg::kSync0StartTime), start);
  bench.write(second(kApwr, reg::kCyclicUnitControl), std::uint16_t{0x0300});
  bench.wait(Nanoseconds{10'000'000});
  const std::uint64_t next =
      bench.read(second(kAprd, reg::kSync0StartTime), 8).value<std::uint64_t>();
  EXPECT_GT(next, start) << "SYNC0 runs";
  EXPECT_EQ((next - start) % 1'000'000, 0U);
}

TEST(DistributedClock, the_speed_counter_tells_the_deviation_by_its_formula) {
  WireBench bench;
  bench.add({}, 0);
  bench.add({.parent = 0}, 80);
  bench.set_step(Nanoseconds{1'000'000});
  for (int i = 0; i < 2000; ++i) bench.read(Target::at_position(kArmw, 0, reg::kSystemTime), 8);
  const auto raw = bench.segment()[1].memory().get<std::uint16_t>(reg::kSpeedCounterDifference);
  const double d = static_cast<std::int16_t>(raw);
  constexpr double kStart = 0x1000;
  EXPECT_NEAR(d / (5 * (kStart + d + 2) * (kStart - d + 2)) * 1e6, -80.0, 0.5);
}

/// 0x092C after one drift datagram that is so much ahead of, or behind, the local copy.
std::uint32_t difference_after(const SubDeviceConfig& config, std::int64_t local_minus_received) {
  using enum Command;
  test::WireBench bench;
  bench.set_step(Nanoseconds{100'000});
  bench.add({}, 0.0, config);
  const auto own = bench.read({kBrd, 0, reg::kSystemTime}, 8).value<std::uint64_t>();
  bench.write({kBwr, 0, reg::kSystemTime},
              own + 100'000 - static_cast<std::uint64_t>(local_minus_received));
  const auto shown = bench.read({kBrd, 0, reg::kSystemTimeDifference}, 4).value<std::uint32_t>();
  const std::int32_t difference = bench.segment()[0].system_time_difference();
  EXPECT_EQ(difference > 0, local_minus_received > 0) << "whatever bit 31 means";
  return shown;
}

TEST(SystemTimeDifference, bit_31_means_ahead_or_behind_as_configured) {
  constexpr std::uint32_t kBit31 = 0x80000000U;
  SubDeviceConfig config;
  const std::uint32_t ahead = difference_after(config, 500);
  const std::uint32_t behind = difference_after(config, -500);
  EXPECT_EQ(ahead & kBit31, kBit31);
  EXPECT_EQ(behind & kBit31, 0U);
  EXPECT_NEAR(static_cast<double>(ahead & ~kBit31), 500.0, 20.0);
  EXPECT_NEAR(static_cast<double>(behind), 500.0, 20.0);
  config.clock.sign_bit_means_ahead = false;
  EXPECT_EQ(difference_after(config, 500), ahead & ~kBit31);
  EXPECT_EQ(difference_after(config, -500), behind | kBit31);
}

}  // namespace
}  // namespace ftcs::ethercat
