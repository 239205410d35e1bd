// SPDX-License-Identifier: MIT
// The world: a MainDevice and up to eight modelled drives with crystals of up to ±100 ppm in a line
// of 300 ns hops and 50 ns cables, in simulated time; a cycle of 1 ms.
#include "ftcs/ethercat/maindevice/main_device.h"

#include <gtest/gtest.h>

#include "ftcs/ethercat/maindevice/csp_axis.h"
#include "test/support/forbid_allocation.h"
#include "test/support/main_bench.h"

namespace ftcs::ethercat {
namespace {

using test::MainBench;

constexpr Nanoseconds kCycle{1'000'000};
constexpr auto kObjects = csp_objects(kCycle);

MainDeviceConfig csp_config() {
  MainDeviceConfig config;
  config.process.objects = kObjects;
  config.process.cycle = kCycle;
  config.process.sync0_shift = Nanoseconds{500'000};
  return config;
}

/// Eight drives; the reference is perfect, so that the cycle may run freely.
void add_drives(MainBench& bench, int n = 8) {
  for (int i = 0; i < n; ++i) {
    const double ppm = i == 0 ? 0.0 : (i % 2 == 0 ? 100.0 : -100.0);
    SubDeviceConfig config;
    config.identity.serial = static_cast<std::uint32_t>(i + 1);
    bench.add({.parent = i - 1, .cable = Nanoseconds{50}}, ppm, config);
  }
}

/// From the moment the cyclic stage begins: cycles on whole milliseconds of reference time.
void align(MainBench& bench) {
  const auto reference = bench.segment()[0].dc().system_time(bench.now());
  bench.wait(Nanoseconds{1'000'000 - static_cast<std::int64_t>(reference % 1'000'000)});
}

void to_op(MainBench& bench) {
  bench.bring_up();
  ASSERT_TRUE(bench.main().cyclic()) << name(bench.main().failure().kind);
  align(bench);
  bench.run(150);
  bench.main().request_operational();
  bench.run(50);
  ASSERT_TRUE(bench.main().last_cycle().all_operational())
      << std::hex << bench.main().last_cycle().states;
}

TEST(MainDevice, brings_eight_drives_to_op_with_sync0) {
  MainBench bench(csp_config());
  add_drives(bench);
  to_op(bench);
  bench.run(1000);
  EXPECT_EQ(bench.main().last_cycle().working_counter, 24);
  EXPECT_EQ(bench.main().counters().wrong_working_counter, 0U);
  for (std::size_t n = 0; n < 8; ++n) {
    const SyncStatistics& statistics = bench.segment()[n].drive().statistics();
    EXPECT_EQ(bench.segment()[n].drive().state(), AlState::kOp);
    EXPECT_EQ(statistics.missed, 0U);
    // Sent at the whole millisecond, SYNC0 half a cycle later; the way there is 350 ns a hop.
    EXPECT_NEAR(static_cast<double>(statistics.last_margin_ns),
                500'000 - 50 - 350.0 * static_cast<double>(n), 150.0);
  }
}

TEST(MainDevice, keeps_all_clocks_within_100_ns_after_one_second_at_1_khz_and_100_ppm) {
  MainDeviceConfig config = csp_config();
  config.clocks.drift_pulses = 0;  // no help before the first cycle
  MainBench bench(config);
  add_drives(bench);
  bench.bring_up();
  ASSERT_TRUE(bench.main().cyclic());
  bench.run(1000);
  for (int i = 0; i < 1000; ++i) {
    bench.run(1);
    for (std::size_t n = 1; n < 8; ++n) {
      ASSERT_LT(std::abs(bench.segment()[n].system_time_difference()), 100) << "drive " << n;
    }
    ASSERT_LT(bench.main().last_cycle().difference_bound_ns, 128U);  // magnitudes OR-ed
  }
}

TEST(MainDevice, reports_the_reference_time_of_each_frame_unwrapped) {
  MainBench bench(csp_config());
  add_drives(bench, 2);
  bench.bring_up();
  bench.run(1);
  const ReferenceTime before = bench.main().last_cycle().reference;
  bench.run(5000);  // beyond the 4.29 s of 32 bits
  const Duration elapsed = bench.main().last_cycle().reference - before;
  EXPECT_NEAR(elapsed.ns(), 5e9, 10.0);
}

TEST(MainDevice, enables_all_axes_without_a_jump_and_moves_them) {
  MainBench bench(csp_config());
  add_drives(bench);
  for (std::size_t n = 0; n < 8; ++n)
    bench.segment()[n].drive().motor().place(1000 * static_cast<int>(n));
  to_op(bench);
  std::array<CspAxis, 8> axes;
  for (int cycle = 0; cycle < 300; ++cycle) {
    for (std::size_t n = 0; n < 8; ++n) {
      const auto inputs = csp::Inputs::decode(bench.main().inputs(n));
      const bool enabled = axes[n].state() == AxisState::kEnabled;
      const std::int32_t displacement = enabled && cycle > 100 ? (cycle - 100) * 10 : 0;
      axes[n]
          .cycle(inputs, {.enable = true, .displacement = displacement})
          .encode(bench.main().outputs(n));
    }
    bench.run(1);
    if (cycle == 100) {
      for (std::size_t n = 0; n < 8; ++n) {
        EXPECT_EQ(axes[n].state(), AxisState::kEnabled);
        EXPECT_EQ(bench.segment()[n].drive().motor().position(), 1000 * static_cast<int>(n));
      }
    }
  }
  for (std::size_t n = 0; n < 8; ++n) {
    EXPECT_NEAR(bench.segment()[n].drive().motor().position(), 1000 * static_cast<int>(n) + 1990,
                30);
  }
}

TEST(MainDevice, a_lost_frame_costs_one_cycle_and_too_many_in_a_row_stop_the_drives) {
  MainBench bench(csp_config());
  add_drives(bench);
  to_op(bench);
  bench.lose = [n = 0](std::size_t) mutable { return n++ == 0; };
  bench.run(20);
  EXPECT_TRUE(bench.main().last_cycle().all_operational());
  EXPECT_EQ(bench.main().counters().lost, 1U);
  bench.lose = [](std::size_t) { return true; };
  bench.run(30);
  EXPECT_EQ(bench.main().stage(), Stage::kStopped);
  EXPECT_EQ(bench.main().failure().kind, FailureKind::kLinkLost);
  bench.segment().advance(bench.now());
  for (std::size_t n = 0; n < 8; ++n) {
    EXPECT_EQ(bench.segment()[n].drive().code(), AlStatusCode::kSynchronizationError);
  }
}

TEST(MainDevice, a_cut_wire_is_a_wrong_working_counter_and_the_rest_goes_to_safeop) {
  MainBench bench(csp_config());
  add_drives(bench);
  to_op(bench);
  bench.segment().set_cut(5, true);
  bench.run(30);
  EXPECT_EQ(bench.main().stage(), Stage::kStopped);
  EXPECT_EQ(bench.main().failure().kind, FailureKind::kWorkingCounter);
  EXPECT_EQ(bench.main().failure().expected, 24);
  EXPECT_EQ(bench.main().failure().received, 15);
  EXPECT_EQ(bench.segment()[0].drive().state(), AlState::kSafeOp);
  EXPECT_EQ(bench.segment()[0].drive().code(), AlStatusCode::kNoError);
}

TEST(MainDevice, a_drive_that_missed_its_window_is_seen_and_recovered) {
  MainBench bench(csp_config());
  add_drives(bench);
  to_op(bench);
  bench.wait(Nanoseconds{3'000'000});  // a stall of the MainDevice
  bench.run(20);
  EXPECT_EQ(bench.main().network().devices[3].code, AlStatusCode::kSynchronizationError);
  EXPECT_EQ(bench.main().last_cycle().states, 0x14);
  for (int round = 0; round < 10; ++round) {
    for (std::size_t n = 0; n < 8; ++n) bench.main().recover(n);
    bench.run(30);
  }
  EXPECT_TRUE(bench.main().last_cycle().all_operational());
}

TEST(MainDevice, lost_frames_during_the_bring_up_are_repeated) {
  MainBench bench(csp_config());
  add_drives(bench, 3);
  bench.lose = [](std::size_t n) { return n % 20 == 7; };
  bench.bring_up();
  EXPECT_TRUE(bench.main().cyclic()) << name(bench.main().failure().kind);
}

TEST(MainDevice, names_what_is_missing_or_wrong) {
  {
    MainBench bench(csp_config());
    bench.add({});
    bench.segment().set_cut(0, true);
    bench.bring_up();
    EXPECT_EQ(bench.main().failure().kind, FailureKind::kNoReply);
  }
  {
    MainDeviceConfig config = csp_config();
    config.expected_subdevices = 8;
    MainBench bench(config);
    add_drives(bench, 3);
    bench.bring_up();
    EXPECT_EQ(bench.main().failure().kind, FailureKind::kFewerThanConfigured);
    EXPECT_EQ(bench.main().failure().received, 3);
  }
  {
    MainDeviceConfig config = csp_config();
    static constexpr SdoDownload kUnknown[] = {{{0x2000, 1}, 2, 0}};
    config.process.objects = kUnknown;
    MainBench bench(config);
    add_drives(bench, 2);
    bench.bring_up();
    EXPECT_EQ(bench.main().failure().kind, FailureKind::kSdoAborted);
    EXPECT_EQ(bench.main().failure().abort, SdoAbort::kNoSuchObject);
    EXPECT_EQ(bench.main().failure().position, 0);
  }
  {
    MainDeviceConfig config = csp_config();
    config.process.cycle = Nanoseconds{100'000};  // the drives need 250 us
    config.process.objects = {};
    MainBench bench(config);
    add_drives(bench, 2);
    bench.bring_up();
    EXPECT_EQ(bench.main().failure().kind, FailureKind::kStateRefused);
    EXPECT_EQ(bench.main().failure().code, AlStatusCode::kInvalidSync0CycleTime);
    EXPECT_EQ(bench.main().failure().actual, AlState::kPreOp);
  }
}

TEST(MainDevice, does_without_objects_that_are_not_required) {
  // Missing, and to be read only: passed over.
  static constexpr SdoDownload kOptional[] = {{{0x2000, 1}, 2, 0, false},
                                              {{0x1018, 9}, 4, 0, false},
                                              {{0x1000, 0}, 4, 0, false},
                                              {{0x6060, 0}, 1, 8}};
  MainDeviceConfig config = csp_config();
  config.process.objects = kOptional;
  MainBench bench(config);
  add_drives(bench, 2);
  bench.bring_up();
  EXPECT_EQ(bench.main().failure().kind, FailureKind::kNone);
  EXPECT_TRUE(bench.main().cyclic());
  // There and refused for another reason: a fault all the same.
  static constexpr SdoDownload kWrongSize[] = {{{0x6060, 0}, 2, 8, false}};
  config.process.objects = kWrongSize;
  MainBench strict(config);
  add_drives(strict, 2);
  strict.bring_up();
  EXPECT_EQ(strict.main().failure().kind, FailureKind::kSdoAborted);
  EXPECT_EQ(strict.main().failure().abort, SdoAbort::kLengthMismatch);
}

TEST(MainDevice, ignores_foreign_malformed_and_late_frames) {
  MainBench bench(csp_config());
  add_drives(bench, 1);
  bench.bring_up();
  std::array<std::uint8_t, 64> rubbish{};
  EXPECT_EQ(bench.main().on_frame(rubbish, {}), FrameOutcome::kIgnored);
  const ConstBytes frame = bench.main().next_frame();
  std::vector<std::uint8_t> late(frame.begin(), frame.end());
  bench.main().on_timeout();
  EXPECT_EQ(bench.main().on_frame(late, {}), FrameOutcome::kIgnored);
  EXPECT_FALSE(bench.main().next_frame().empty());
  EXPECT_EQ(bench.main().on_frame(late, {}), FrameOutcome::kIgnored) << "of the frame before";
}

TEST(MainDevice, an_answer_256_frames_old_is_not_taken_for_the_one_that_is_waited_for) {
  MainBench bench(csp_config());
  add_drives(bench, 2);
  bench.bring_up();
  std::vector<std::uint8_t> old;
  bench.capture = [&old](FreeRunningTime, ConstBytes frame) {
    old.assign(frame.begin(), frame.end());  // the last one of a cycle is the answer
  };
  bench.run(1);
  bench.capture = nullptr;
  bench.run(255);
  constexpr std::size_t kFirstIndex = kFrameHeaderSize + 1;
  ASSERT_EQ(bench.main().next_frame()[kFirstIndex], old[kFirstIndex]) << "it has come round";
  EXPECT_EQ(bench.main().on_frame(old, {}), FrameOutcome::kIgnored);
}

TEST(MainDevice, drives_in_op_are_left_to_the_one_who_drives_them_unless_told_otherwise) {
  MainBench bench(csp_config());
  add_drives(bench, 3);
  to_op(bench);
  for (const bool take_over : {false, true}) {
    MainDeviceConfig config = csp_config();
    config.take_over = take_over;
    bench.configure(config);  // a second MainDevice on the same wire
    bench.bring_up();
    EXPECT_EQ(bench.main().cyclic(), take_over);
    const FailureKind wanted = take_over ? FailureKind::kNone : FailureKind::kInOperation;
    EXPECT_EQ(bench.main().failure().kind, wanted);
    if (take_over) continue;
    for (std::size_t n = 0; n < 3; ++n) {
      EXPECT_EQ(bench.segment()[n].drive().state(), AlState::kOp);
    }
  }
}

/// A second one comes when the first has sent `frames`; it has this wire for itself 100 ms long
/// only if the first is silent.
void come_second(std::size_t drives, int frames, bool first_goes_on) {
  SCOPED_TRACE(testing::Message() << drives << " drives, after " << frames << " frames");
  MainBench bench(csp_config());
  add_drives(bench, static_cast<int>(drives));
  for (int i = 0; i < frames; ++i) {
    bench.exchange_once();
    bench.wait(Nanoseconds{20'000});
  }
  MainDeviceConfig config = csp_config();
  config.listening = Nanoseconds{100'000'000};
  const auto second = std::make_unique<MainDevice>(config);
  while (!second->cyclic() && second->stage() != Stage::kStopped) {
    bench.exchange_once(*second);
    bench.wait(Nanoseconds{20'000});
    if (!first_goes_on) continue;
    bench.exchange_once();
    bench.wait(Nanoseconds{20'000});
  }
  EXPECT_EQ(second->cyclic(), !first_goes_on);
  if (!first_goes_on) return;
  EXPECT_EQ(second->failure().kind, FailureKind::kInUse) << name(second->failure().kind);
  to_op(bench);
}

TEST(MainDevice, a_second_one_finds_out_that_a_bring_up_is_under_way_and_disturbs_nothing) {
  for (const std::size_t drives : {1U, 2U, 8U}) {
    MainBench alone(csp_config());
    add_drives(alone, static_cast<int>(drives));
    int frames = 0;
    for (; !alone.main().cyclic(); ++frames) {
      alone.exchange_once();
      alone.wait(Nanoseconds{20'000});
    }
    for (int n = 2; n < frames; n += 1 + frames / 12) come_second(drives, n, true);
    if (drives > 1) come_second(drives, frames + 100, true);  // cyclic, in SAFEOP
    come_second(drives, frames / 2, false);
  }
}

TEST(MainDevice, a_stop_is_over_when_everybody_was_seen_out_of_op) {
  MainBench bench(csp_config());
  add_drives(bench, 3);
  to_op(bench);
  bench.main().stop();
  bench.run(2);
  EXPECT_EQ(bench.main().stage(), Stage::kStopped);
  EXPECT_TRUE(bench.main().stop_confirmed());
  EXPECT_EQ(bench.main().failure().kind, FailureKind::kNone);
}

TEST(MainDevice, drives_that_do_not_obey_the_stop_are_a_failure_after_its_time) {
  MainBench bench(csp_config());
  add_drives(bench, 3);
  to_op(bench);
  bench.tamper = [](const FrameView& frame) {
    for (const Datagram datagram : frame) {
      const bool states =
          datagram.command() == Command::kBrd && datagram.offset() == reg::kAlStatus;
      if (states) store(datagram.data(), 0, std::uint16_t{0x0C});  // one is still in OP
    }
  };
  bench.main().stop();
  bench.run(190);
  EXPECT_EQ(bench.main().stage(), Stage::kStopping) << "asked again and again";
  bench.run(30);
  EXPECT_EQ(bench.main().stage(), Stage::kStopped);
  EXPECT_FALSE(bench.main().stop_confirmed());
  EXPECT_EQ(bench.main().failure().kind, FailureKind::kNotStopped);
}

TEST(MainDevice, without_distributed_clocks_drives_run_free) {
  MainDeviceConfig config = csp_config();
  config.distributed_clocks = false;
  config.process.sync0 = false;
  static constexpr SdoDownload kMode[] = {{{0x6060, 0}, 1, 8}};
  config.process.objects = kMode;
  MainBench bench(config);
  add_drives(bench, 2);
  bench.bring_up();
  bench.main().request_operational();
  bench.run(20);
  EXPECT_TRUE(bench.main().last_cycle().all_operational());
  EXPECT_FALSE(bench.main().last_cycle().has_reference);
}

TEST(MainDevice, a_cycle_touches_no_heap) {
  MainBench bench(csp_config());
  add_drives(bench);
  to_op(bench);
  std::array<std::uint8_t, kMaxFrameSize> buffer{};
  const ftcs::test::ForbidAllocation guard;
  const ConstBytes frame = bench.main().next_frame();
  std::copy(frame.begin(), frame.end(), buffer.begin());
  const auto view = FrameView::parse(Bytes{buffer}.first(frame.size()));
  bench.segment().pass(*view, bench.now());
  EXPECT_EQ(bench.main().on_frame(Bytes{buffer}.first(frame.size()), {}), FrameOutcome::kCycle);
}

}  // namespace
}  // namespace ftcs::ethercat
