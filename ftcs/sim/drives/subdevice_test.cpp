// SPDX-License-Identifier: MIT
// The world: SubDevices in a line or a tree with perfect crystals, 300 ns a hop, one datagram per
// frame every 100 us. Expectations come from ETG.1000.4 and .6, not from the code.
#include "ftcs/sim/drives/subdevice.h"

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/wire_bench.h"

namespace ftcs::ethercat {
namespace {

using test::WireBench;
using enum Command;
constexpr std::uint16_t kStation = 0x1001;

Target fp(Command command, std::uint16_t offset) { return {command, kStation, offset}; }

/// One SubDevice with station address 0x1001.
struct OneDevice : WireBench, ::testing::Test {
  OneDevice() {
    add({});
    write(Target::at_position(kApwr, 0, reg::kStationAddress), kStation);
  }
  Reply request_state(std::uint16_t control) {
    write(fp(kFpwr, reg::kAlControl), control);
    return read(fp(kFprd, reg::kAlStatus), 6);
  }
  void expect_state(std::uint16_t status, AlStatusCode code) {
    const Reply reply = read(fp(kFprd, reg::kAlStatus), 6);
    EXPECT_EQ(load<std::uint16_t>(reply.data, 0), status);
    EXPECT_EQ(load<std::uint16_t>(reply.data, 4), static_cast<std::uint16_t>(code))
        << name(AlStatusCode{load<std::uint16_t>(reply.data, 4)});
  }
  void set_sync_manager(std::size_t n, std::uint16_t start, std::uint16_t length,
                        std::uint8_t control) {
    std::vector<std::uint8_t> bytes(reg::kSyncManagerSize);
    SyncManagerChannel{start, length, control, true}.encode(bytes);
    exchange(fp(kFpwr, static_cast<std::uint16_t>(reg::kSyncManager + 8 * n)), bytes);
  }
  void set_mailboxes() {
    set_sync_manager(0, 0x1000, 128, 0x26);
    set_sync_manager(1, 0x1080, 128, 0x22);
  }
  void set_process_data() {
    set_sync_manager(2, 0x1100, 7, 0x64);
    set_sync_manager(3, 0x1400, 7, 0x20);
  }
  void set_fmmu(std::size_t n, const FmmuChannel& channel) {
    std::vector<std::uint8_t> bytes(reg::kFmmuSize);
    channel.encode(bytes);
    exchange(fp(kFpwr, static_cast<std::uint16_t>(reg::kFmmu + 16 * n)), bytes);
  }
  void to_preop() {
    set_mailboxes();
    ASSERT_EQ(request_state(2).data[0], 2);
  }
  /// Raw SDO: request into mailbox 0, answer out of mailbox 1.
  Sdo sdo(SdoKind kind, ObjectAddress object, std::vector<std::uint8_t> data = {}) {
    std::vector<std::uint8_t> mailbox(128);
    EXPECT_TRUE(encode_sdo(mailbox, {kind, object, 1, false, {}, data}));
    EXPECT_EQ(exchange(fp(kFpwr, 0x1000), mailbox).working_counter, 1);
    reply_ = read(fp(kFprd, 0x1080), 128);
    EXPECT_EQ(reply_.working_counter, 1);
    const auto answer = decode_sdo(reply_.data);
    EXPECT_TRUE(answer);
    return answer ? *answer : Sdo{};
  }
  void write_object(ObjectAddress object, std::vector<std::uint8_t> data) {
    EXPECT_EQ(sdo(SdoKind::kDownloadRequest, object, std::move(data)).kind,
              SdoKind::kDownloadResponse);
  }
  void start_sync0(std::uint32_t cycle, std::int64_t ahead_ns) {
    const auto now = read(fp(kFprd, reg::kSystemTime), 8).value<std::uint64_t>();
    write(fp(kFpwr, reg::kSync0CycleTime), cycle);
    write(fp(kFpwr, reg::kSync0StartTime), now + static_cast<std::uint64_t>(ahead_ns));
    write(fp(kFpwr, reg::kDcActivation), std::uint8_t{3});
  }
  /// Outputs once per millisecond for n cycles.
  void cycle(int n) {
    set_step(Nanoseconds{1'000'000});
    for (int i = 0; i < n; ++i) exchange(fp(kFpwr, 0x1100), {0x0F, 0, 0, 0, 0, 0, 8});
    set_step(Nanoseconds{100'000});
  }
  [[nodiscard]] const DriveApplication& drive() { return segment()[0].drive(); }
  Reply reply_;
};

TEST_F(OneDevice, read_write_returns_the_old_value_and_counts_three) {
  write(fp(kFpwr, 0x1800), std::uint16_t{0xAAAA});
  const Reply reply = write(fp(kFprw, 0x1800), std::uint16_t{0x5555});
  EXPECT_EQ(reply.working_counter, 3);
  EXPECT_EQ(reply.value<std::uint16_t>(), 0xAAAA);
  EXPECT_EQ(read(fp(kFprd, 0x1800), 2).value<std::uint16_t>(), 0x5555);
}

TEST_F(OneDevice, read_only_registers_stay_and_memory_ends_somewhere) {
  EXPECT_EQ(write(fp(kFpwr, reg::kType), std::uint8_t{0}).working_counter, 0);
  EXPECT_EQ(read(fp(kFprd, reg::kType), 1).data[0], 0x11);
  EXPECT_EQ(read(fp(kFprd, 0x2FFF), 1).working_counter, 1);
  EXPECT_EQ(read(fp(kFprd, 0x2FFF), 2).working_counter, 0);
}

TEST_F(OneDevice, lrw_counts_three_once_however_many_channels_it_meets) {
  set_fmmu(0, {0x10000, 2, 0, 7, 0x1800, 0, false, true, true});
  set_fmmu(1, {0x10002, 2, 0, 7, 0x1900, 0, true, false, true});
  set_fmmu(2, {0x10004, 1, 0, 7, 0x080D, 0, true, false, true});
  write(fp(kFpwr, 0x1900), std::uint16_t{0xBEEF});
  const Reply reply = exchange(Target::logical(kLrw, 0x10000), {0x34, 0x12, 0, 0, 0xFF});
  EXPECT_EQ(reply.working_counter, 3);
  EXPECT_EQ(load<std::uint16_t>(reply.data, 2), 0xBEEF);
  EXPECT_EQ(reply.data[4], 0) << "status of sync manager 1";
  EXPECT_EQ(read(fp(kFprd, 0x1800), 2).value<std::uint16_t>(), 0x1234);
  EXPECT_EQ(read(Target::logical(kLrd, 0x10000), 5).working_counter, 1);
  EXPECT_EQ(read(Target::logical(kLwr, 0x10000), 5).working_counter, 1);
  EXPECT_EQ(read(Target::logical(kLrw, 0x20000), 5).working_counter, 0);
}

TEST_F(OneDevice, a_channel_maps_single_bits) {
  // Logical bits 3 to 6 of byte 0x100 are physical bits 6 to 9 from 0x1800 on.
  set_fmmu(0, {0x100, 1, 3, 6, 0x1800, 6, true, false, true});
  write(fp(kFpwr, 0x1800), std::uint16_t{0b0000'0010'0100'0000});
  const Reply reply = exchange(Target::logical(kLrd, 0x100), {0b1000'0101});
  EXPECT_EQ(reply.working_counter, 1);
  EXPECT_EQ(reply.data[0], 0b1100'1101);
}

TEST_F(OneDevice, a_mailbox_takes_one_message_and_gives_it_once) {
  to_preop();
  EXPECT_EQ(read(fp(kFprd, 0x1080), 128).working_counter, 0) << "empty";
  const Sdo answer = sdo(SdoKind::kUploadRequest, {0x1018, 1});
  EXPECT_EQ(answer.kind, SdoKind::kUploadResponse);
  EXPECT_EQ(answer.value(), 0xF7C5U);
  EXPECT_EQ(read(fp(kFprd, 0x1080), 128).working_counter, 0) << "read already";
  // A message without its last byte is none.
  EXPECT_EQ(exchange(fp(kFpwr, 0x1000), std::vector<std::uint8_t>(127)).working_counter, 1);
  EXPECT_EQ(read(fp(kFprd, 0x0805), 1).data[0] & 0x08, 0);
}

TEST_F(OneDevice, a_full_mailbox_refuses_and_a_repeat_request_shows_the_last_message_again) {
  to_preop();
  sdo(SdoKind::kUploadRequest, {0x1000, 0});
  write(fp(kFpwr, 0x080E), std::uint8_t{0x03});
  EXPECT_EQ(read(fp(kFprd, 0x080F), 1).data[0] & 0x02, 0x02) << "acknowledged";
  EXPECT_EQ(read(fp(kFprd, 0x1080), 128).working_counter, 1);
  // Two requests while nobody reads the answers: the second stays, the third is refused.
  std::vector<std::uint8_t> mailbox(128);
  ASSERT_TRUE(encode_sdo(mailbox, {SdoKind::kUploadRequest, {0x1000, 0}, 1, false, {}, {}}));
  EXPECT_EQ(exchange(fp(kFpwr, 0x1000), mailbox).working_counter, 1);
  EXPECT_EQ(exchange(fp(kFpwr, 0x1000), mailbox).working_counter, 1);
  EXPECT_EQ(exchange(fp(kFpwr, 0x1000), mailbox).working_counter, 0);
}

TEST_F(OneDevice, answers_sdos_with_the_abort_codes_of_the_standard) {
  to_preop();
  EXPECT_EQ(sdo(SdoKind::kUploadRequest, {0x2000, 0}).abort, SdoAbort::kNoSuchObject);
  EXPECT_EQ(sdo(SdoKind::kUploadRequest, {0x1018, 9}).abort, SdoAbort::kNoSuchSubindex);
  EXPECT_EQ(sdo(SdoKind::kDownloadRequest, {0x1000, 0}, {1, 2, 3, 4}).abort, SdoAbort::kReadOnly);
  EXPECT_EQ(sdo(SdoKind::kDownloadRequest, {0x6060, 0}, {1, 2}).abort, SdoAbort::kLengthMismatch);
  const Sdo device_name = sdo(SdoKind::kUploadRequest, {0x1008, 0});
  EXPECT_EQ(std::string(device_name.data.begin(), device_name.data.end()),
            "FTCS modelled servo drive");
}

TEST_F(OneDevice, the_eeprom_interface_takes_all_forms_of_access) {
  // Six bytes: command and address; then status and data in one read of ten bytes or more.
  exchange(fp(kFpwr, reg::kSiiControl), {0x00, 0x01, 0x08, 0, 0, 0});
  const Reply reply = read(fp(kFprd, reg::kSiiControl), 14);
  EXPECT_EQ(load<std::uint16_t>(reply.data, 0) & 0x8000, 0) << "not busy";
  EXPECT_EQ(load<std::uint32_t>(reply.data, 6), 0xF7C5U);
  EXPECT_EQ(load<std::uint32_t>(reply.data, 10), 0x402U);
  // Four bytes, broadcast; beyond the end 0xFF.
  exchange({kBwr, 0, reg::kSiiControl}, {0x00, 0x01, 0x00, 0x80});
  EXPECT_EQ(read(fp(kFprd, reg::kSiiData), 4).value<std::uint32_t>(), 0xFFFFFFFFU);
  // The PDI owns it: no access.
  write(fp(kFpwr, reg::kSiiConfiguration), std::uint8_t{1});
  EXPECT_EQ(exchange(fp(kFpwr, reg::kSiiControl), {0, 1, 8, 0, 0, 0}).working_counter, 0);
}

TEST_F(OneDevice, a_mapping_may_hold_gaps_of_whole_bytes) {
  to_preop();
  const auto map = [this](std::uint8_t subindex, std::uint32_t entry) {
    std::vector<std::uint8_t> data(4);
    store(Bytes{data}, 0, entry);
    write_object({0x1A00, subindex}, data);
  };
  write_object({0x1A00, 0}, {0});
  std::uint8_t n = 0;
  for (const std::uint32_t entry : {0x60410010U, 0x60610008U, 0x00000008U, 0x60640020U, 0x606C0020U,
                                    0x60770010U, 0x603F0010U}) {
    map(++n, entry);
  }
  write_object({0x1A00, 0}, {n});
  write_object({0x1A00, 0}, {0});
  map(3, 0x00000007);
  EXPECT_EQ(sdo(SdoKind::kDownloadRequest, {0x1A00, 0}, {n}).abort, SdoAbort::kCannotBeMapped);
  map(3, 0x00000000);
  EXPECT_EQ(sdo(SdoKind::kDownloadRequest, {0x1A00, 0}, {n}).abort, SdoAbort::kCannotBeMapped);
}

TEST_F(OneDevice, refuses_illegal_and_unknown_states_and_wants_the_error_acknowledged) {
  request_state(8);
  expect_state(0x11, AlStatusCode::kInvalidRequestedStateChange);
  set_mailboxes();
  request_state(2);
  expect_state(0x11, AlStatusCode::kInvalidRequestedStateChange);
  request_state(0x12);
  expect_state(0x02, AlStatusCode::kNoError);
  request_state(7);
  expect_state(0x12, AlStatusCode::kUnknownRequestedState);
  request_state(0x13);
  expect_state(0x12, AlStatusCode::kBootstrapNotSupported);
}

TEST_F(OneDevice, checks_its_sync_managers_on_the_way_up) {
  request_state(2);
  expect_state(0x11, AlStatusCode::kInvalidMailboxConfiguration);
  set_mailboxes();
  request_state(0x12);
  request_state(4);
  expect_state(0x12, AlStatusCode::kInvalidOutputConfiguration);
  set_sync_manager(2, 0x1100, 7, 0x64);
  request_state(0x14);
  expect_state(0x12, AlStatusCode::kInvalidInputConfiguration);
  set_process_data();
  request_state(0x14);
  expect_state(0x04, AlStatusCode::kNoError);
}

TEST_F(OneDevice, without_sync0_goes_to_op_with_the_first_outputs_and_has_a_watchdog) {
  to_preop();
  set_process_data();
  request_state(4);
  request_state(8);
  expect_state(0x04, AlStatusCode::kNoError);
  cycle(1);
  expect_state(0x08, AlStatusCode::kNoError);
  wait(Nanoseconds{90'000'000});
  expect_state(0x08, AlStatusCode::kNoError);
  wait(Nanoseconds{15'000'000});
  expect_state(0x14, AlStatusCode::kSyncManagerWatchdog);
}

TEST_F(OneDevice, checks_the_sync_configuration) {
  to_preop();
  set_process_data();
  write_object(obj::kSyncType, {2, 0});
  request_state(4);
  expect_state(0x12, AlStatusCode::kInvalidDcSyncConfiguration);
  request_state(0x12);
  start_sync0(1'000'000, 10'000'000);
  write_object(obj::kSyncCycle, {0x80, 0x84, 0x1E, 0});  // 2 ms
  request_state(4);
  expect_state(0x12, AlStatusCode::kInvalidSyncCycleTime);
  request_state(0x12);
  write_object(obj::kSyncCycle, {0x40, 0x42, 0x0F, 0});  // 1 ms
  write_object(obj::kInterpolationPeriod, {2});
  request_state(4);
  expect_state(0x12, AlStatusCode::kInvalidSync0CycleTime);
  request_state(0x12);
  write_object(obj::kInterpolationPeriod, {1});
  request_state(4);
  expect_state(0x04, AlStatusCode::kNoError);
}

/// In SAFEOP with SYNC0 every millisecond.
struct SynchronousDevice : OneDevice {
  void start(std::int64_t ahead_ns) {
    to_preop();
    set_process_data();
    start_sync0(1'000'000, ahead_ns);
    request_state(4);
    expect_state(0x04, AlStatusCode::kNoError);
  }
  void start_op() {
    start(10'400'000);
    request_state(8);
    cycle(20);
    expect_state(0x08, AlStatusCode::kNoError);
  }
};

TEST_F(SynchronousDevice, a_sync0_start_in_the_past_never_fires_and_op_fails_with_no_sync_error) {
  start(-1'000'000);
  request_state(8);
  cycle(505);
  expect_state(0x14, AlStatusCode::kNoSyncError);
}

TEST_F(SynchronousDevice, one_missed_window_is_forgiven_two_are_a_synchronization_error) {
  start_op();
  wait(Nanoseconds{1'000'000});
  cycle(10);
  expect_state(0x08, AlStatusCode::kNoError);
  EXPECT_EQ(drive().statistics().missed, 1U);
  wait(Nanoseconds{2'000'000});
  expect_state(0x14, AlStatusCode::kSynchronizationError);
  EXPECT_EQ(drive().motor().state(), DriveState::kFault);
}

TEST_F(SynchronousDevice, the_margin_is_sync0_minus_the_arrival_of_the_outputs) {
  start_op();
  const std::int64_t margin = drive().statistics().last_margin_ns;
  EXPECT_GT(margin, 0);
  EXPECT_LT(margin, 1'000'000);
  wait(Nanoseconds{100'000});  // with the 100 us of reading the state: 200 us later
  cycle(5);
  EXPECT_EQ(drive().statistics().last_margin_ns, margin - 200'000);
}

TEST_F(SynchronousDevice, a_slewing_clock_is_a_pll_error) {
  start_op();
  crystal(0).set_rate(Rate::from_ppm(0), now());
  // Somebody writes a system time 100 us off: the copy slews as fast as it can.
  for (int i = 0; i < 30; ++i) {
    const auto time = read(fp(kFprd, reg::kSystemTime), 8).value<std::uint64_t>();
    write(fp(kFpwr, reg::kSystemTime), time + 200'000);
    wait(Nanoseconds{-100'000});
    wait(Nanoseconds{-100'000});
    cycle(1);
  }
  expect_state(0x14, AlStatusCode::kPllError);
}

TEST_F(SynchronousDevice, the_drive_is_enabled_step_by_step_and_follows_its_target) {
  start_op();
  set_step(Nanoseconds{1'000'000});
  for (const std::uint8_t word : {std::uint8_t{6}, std::uint8_t{7}, std::uint8_t{15}}) {
    exchange(fp(kFpwr, 0x1100), {word, 0, 0, 0, 0, 0, 8});
    exchange(fp(kFpwr, 0x1100), {word, 0, 0, 0, 0, 0, 8});
  }
  EXPECT_EQ(drive().motor().state(), DriveState::kOperationEnabled);
  for (int i = 0; i < 30; ++i) exchange(fp(kFpwr, 0x1100), {0x0F, 0, 0xE8, 0x03, 0, 0, 8});
  EXPECT_EQ(drive().motor().position(), 1000);
  const Reply inputs = read(fp(kFprd, 0x1400), 7);
  EXPECT_EQ(load<std::uint32_t>(inputs.data, 2), 1000U);
  EXPECT_EQ(load<std::uint16_t>(inputs.data, 0) & 0x006F, 0x0027);
}

TEST_F(OneDevice, loses_everything_volatile_when_power_returns) {
  to_preop();
  segment().power_cycle(0, now());
  EXPECT_EQ(read(fp(kFprd, reg::kAlStatus), 2).working_counter, 0) << "no station address";
  EXPECT_EQ(read(Target::at_position(kAprd, 0, reg::kAlStatus), 2).data[0], 1);
}

TEST_F(OneDevice, hostile_datagrams_do_not_lead_out_of_its_memory) {
  std::uint32_t state = 7;
  const auto next = [&state] { return state = state * 1664525U + 1013904223U; };
  for (int i = 0; i < 20000; ++i) {
    const auto command = static_cast<Command>((next() >> 16) % 15);
    const Target target{command, (next() >> 20) % 2 == 0 ? kStation : std::uint16_t{0},
                        static_cast<std::uint16_t>((next() >> 16) % 0x3100)};
    std::vector<std::uint8_t> data((next() >> 16) % 64);
    for (auto& byte : data) byte = static_cast<std::uint8_t>(next() >> 24);
    exchange(target, data);
  }
}

TEST(SubDevice, processes_frames_without_memory) {
  WireBench bench;
  bench.add_line(2);
  std::array<std::uint8_t, kMaxFrameSize> buffer{};
  FrameWriter writer(buffer, 1);
  writer.add({kFrmw, 0, reg::kSystemTime}, 8);
  writer.add(Target::logical(kLrw, 0), 100);
  ASSERT_TRUE(writer.finish());
  const ftcs::test::ForbidAllocation guard;
  EXPECT_TRUE(bench.segment().pass(*FrameView::parse(buffer), bench.now()).returned);
}

}  // namespace
}  // namespace ftcs::ethercat
