// SPDX-License-Identifier: MIT
// The world: a frame of several datagrams, the bytes of ETG.1000.4 on the wire, and hostile bytes.
#include "ftcs/ethercat/wire/frame.h"

#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ethercat/wire/al_state.h"
#include "test/support/forbid_allocation.h"

namespace ftcs::ethercat {
namespace {

using Buffer = std::array<std::uint8_t, kMaxFrameSize>;

TEST(Frame, a_read_of_the_type_register_has_the_bytes_of_the_standard) {
  Buffer buffer{};
  FrameWriter writer(buffer, 0x5A);
  writer.add(Target{Command::kBrd, 0, 0x0000}, 2);
  const auto frame = writer.finish();
  ASSERT_TRUE(frame);
  const std::vector<std::uint8_t> expected{0x0E, 0x10, 0x07, 0x5A, 0, 0, 0, 0,
                                           2,    0,    0,    0,    0, 0, 0, 0};
  EXPECT_TRUE(std::equal(frame->begin(), frame->end(), expected.begin(), expected.end()));
}

TEST(Frame, datagrams_come_back_as_they_were_written) {
  Buffer buffer{};
  FrameWriter writer(buffer, 7);
  writer.add_value(Target{Command::kFpwr, 0x1001, 0x0120}, std::uint16_t{0x0008});
  writer.add(Target::logical(Command::kLrw, 0x00012345), 20);
  writer.add(Target::at_position(Command::kAprd, 3, 0x0130), 6);
  ASSERT_TRUE(writer.finish());

  const auto view = FrameView::parse(buffer);
  ASSERT_TRUE(view);
  ASSERT_EQ(view->count(), 3U);
  EXPECT_EQ((*view)[0].command(), Command::kFpwr);
  EXPECT_EQ((*view)[0].position(), 0x1001);
  EXPECT_EQ(load<std::uint16_t>((*view)[0].data(), 0), 8);
  EXPECT_EQ((*view)[1].logical_address(), 0x00012345U);
  EXPECT_EQ((*view)[1].data().size(), 20U);
  EXPECT_EQ((*view)[2].position(), 0xFFFD);
  EXPECT_EQ((*view)[2].index(), 7);
}

TEST(Frame, the_working_counter_is_counted_where_the_datagram_ends) {
  Buffer buffer{};
  FrameWriter writer(buffer, 0);
  writer.add(Target{Command::kBrd, 0, 0}, 1);
  writer.add(Target{Command::kBrd, 0, 0}, 1);
  ASSERT_TRUE(writer.finish());
  const auto view = FrameView::parse(buffer);
  (*view)[0].add_to_working_counter(3);
  EXPECT_EQ((*view)[0].working_counter(), 3);
  EXPECT_EQ((*view)[1].working_counter(), 0);
  EXPECT_EQ(buffer[2 + 10 + 1], 3);
}

TEST(Frame, a_full_frame_says_so) {
  Buffer buffer{};
  FrameWriter writer(buffer, 0);
  writer.add(Target{Command::kLrw, 0, 0}, 1486);
  EXPECT_TRUE(writer.finish());
  EXPECT_TRUE(writer.add(Target{Command::kBrd, 0, 0}, 1).empty());
  EXPECT_EQ(writer.finish().error(), FrameError::kNoRoom);
}

TEST(Frame, each_malformation_has_its_name) {
  Buffer buffer{};
  FrameWriter writer(buffer, 0);
  writer.add(Target{Command::kBrd, 0, 0}, 4);
  const std::size_t size = writer.finish()->size();
  const auto error = [&](auto change, std::size_t length) {
    Buffer copy = buffer;
    change(copy);
    return FrameView::parse(Bytes{copy}.first(length)).error();
  };
  const auto nothing = [](Buffer&) {};
  EXPECT_EQ(error(nothing, 1), FrameError::kTooShort);
  EXPECT_EQ(error(nothing, size - 1), FrameError::kLengthBeyondFrame);
  EXPECT_EQ(error([](Buffer& b) { b[1] = 0x50; }, size), FrameError::kNotDatagrams);
  EXPECT_EQ(error([](Buffer& b) { b[2] = 15; }, size), FrameError::kUnknownCommand);
  EXPECT_EQ(error([](Buffer& b) { b[8] = 5; }, size), FrameError::kDatagramTruncated);
  EXPECT_EQ(error([](Buffer& b) { b[9] = 0x80; }, size), FrameError::kDatagramTruncated);
}

TEST(Frame, no_bytes_whatever_lead_beyond_the_buffer) {
  // Every start pattern of a small generator; the sanitizer build is the judge.
  std::uint32_t state = 1;
  for (int round = 0; round < 20000; ++round) {
    std::vector<std::uint8_t> bytes(state % 80);
    for (auto& byte : bytes) {
      state = state * 1664525U + 1013904223U;
      byte = static_cast<std::uint8_t>(state >> 24);
    }
    if (bytes.size() > 3) bytes[1] = 0x10, bytes[2] = static_cast<std::uint8_t>(bytes[2] % 16);
    state = state * 1664525U + 1013904223U;
    const auto view = FrameView::parse(bytes);
    if (!view) continue;
    for (const Datagram datagram : *view) datagram.add_to_working_counter(1);
  }
}

TEST(Ethernet, carries_the_frame_padded_to_sixty_bytes) {
  std::array<std::uint8_t, kMaxEthernetSize> ethernet{};
  const std::array<std::uint8_t, 4> frame{1, 2, 3, 4};
  const auto encoded = encode_ethernet(ethernet, {2, 0, 0, 0, 0, 1}, frame);
  ASSERT_TRUE(encoded);
  EXPECT_EQ(encoded->size(), 60U);
  EXPECT_EQ((*encoded)[0], 0xFF);
  EXPECT_EQ((*encoded)[12], 0x88);
  EXPECT_EQ((*encoded)[13], 0xA4);
  const auto decoded = decode_ethernet(Bytes{ethernet}.first(60));
  ASSERT_TRUE(decoded);
  EXPECT_TRUE(std::equal(frame.begin(), frame.end(), decoded->begin()));
  ethernet[12] = 0x08;
  EXPECT_EQ(decode_ethernet(ethernet).error(), FrameError::kForeign);
}

TEST(AlState, only_one_step_up_and_any_way_down) {
  using enum AlState;
  EXPECT_TRUE(is_legal_transition(kInit, kPreOp));
  EXPECT_FALSE(is_legal_transition(kInit, kSafeOp));
  EXPECT_FALSE(is_legal_transition(kPreOp, kOp));
  EXPECT_TRUE(is_legal_transition(kSafeOp, kOp));
  EXPECT_TRUE(is_legal_transition(kOp, kInit));
  EXPECT_FALSE(is_legal_transition(kInit, kBootstrap));
  EXPECT_STREQ(name(AlStatusCode{0x002D}), "no SYNC error");
}

TEST(Frame, is_written_and_parsed_without_memory) {
  Buffer buffer{};
  const test::ForbidAllocation guard;
  FrameWriter writer(buffer, 0);
  writer.add(Target{Command::kBrd, 0, 0}, 4);
  EXPECT_TRUE(writer.finish());
  EXPECT_TRUE(FrameView::parse(buffer));
}

}  // namespace
}  // namespace ftcs::ethercat
