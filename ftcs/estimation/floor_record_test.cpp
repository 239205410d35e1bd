// SPDX-License-Identifier: MIT
#include "ftcs/estimation/floor_record.h"

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

using Record = FloorRecord<8>;
constexpr Direction kForward = Direction::kForward;
constexpr Direction kBackward = Direction::kBackward;

void push(Record& record, double cycles, Direction direction, double z, bool at_floor = false) {
  record.elapse(cycles);
  (void)record.push({direction, z, 0.0, at_floor, 0.0});
}

TEST(FloorRecord, keeps_the_last_messages_of_each_direction_with_their_age) {
  Record record;
  for (int k = 0; k < 12; ++k) {
    push(record, 0.75, kForward, k);
    push(record, 0.25, kBackward, -k);
  }
  const RecordWindow window = record.window(kForward, 3);
  ASSERT_EQ(window.size, 3U);
  EXPECT_EQ(window[0].z, 9.0);
  EXPECT_EQ(window[2].z, 11.0);
  EXPECT_NEAR(window.time(window[0]), -2.25, 1e-5);
  EXPECT_EQ(record.window(kBackward, 99).size, 8U);
  EXPECT_EQ(record.window(kBackward, 1)[0].z, -11.0);
}

TEST(FloorRecord, readings_are_brought_to_the_rounded_time_at_the_believed_rate) {
  Record record;
  record.elapse(0.3);
  const double rate = 1e6;
  (void)record.push({kForward, 1e6, 0.0, false, rate});
  const RecordWindow window = record.window(kForward, 1);
  EXPECT_NEAR(window[0].z, 1e6, rate / RecordWindow::kUnitsPerCycle);
  record.elapse(1.0);
  const RecordWindow later = record.window(kForward, 1);
  // A line through it at that rate is as exact as the reading.
  EXPECT_NEAR(later[0].z - rate * later.time(later[0]), 1e6 + rate * 1.0, 8.0);
}

TEST(FloorRecord, coarsened_it_keeps_the_earlier_of_two_neighbours) {
  Record record;
  for (const double late : {5.0, 1.0, 0.0, 7.0}) push(record, 1.0, kForward, late);
  for (const double late : {5.0, 1.0, 0.0, 7.0}) push(record, 1.0, kBackward, -late);
  record.coarsen(0.0);
  EXPECT_EQ(record.stride(), 2U);
  ASSERT_EQ(record.size(kForward), 2U);
  EXPECT_EQ(record.window(kForward, 2)[0].z, 1.0);
  EXPECT_EQ(record.window(kForward, 2)[1].z, 0.0);
  EXPECT_EQ(record.window(kBackward, 2)[0].z, -1.0);
  record.refine();
  EXPECT_EQ(record.stride(), 1U);
}

TEST(FloorRecord, coarsened_when_its_ring_has_wrapped_it_stays_in_order) {
  Record record;
  for (int k = 0; k < 13; ++k) push(record, 1.0, kForward, k);
  record.coarsen(0.0);
  const RecordWindow window = record.window(kForward, 8);
  ASSERT_EQ(window.size, 4U);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(window[k].z, 5.0 + 2.0 * static_cast<double>(k));
  push(record, 1.0, kForward, 20.0);
  push(record, 1.0, kForward, 19.0);
  EXPECT_EQ(record.window(kForward, 1)[0].z, 19.0);
}

TEST(FloorRecord, of_several_messages_the_first_at_the_floor_is_kept) {
  Record record;
  record.coarsen(0.0);
  push(record, 1.0, kForward, 3.0, true);
  push(record, 1.0, kForward, 2.0, true);  // earlier by its noise
  ASSERT_EQ(record.size(kForward), 1U);
  EXPECT_EQ(record.window(kForward, 1)[0].z, 3.0);
  push(record, 1.0, kForward, 900.0);
  push(record, 1.0, kForward, 4.0, true);
  EXPECT_EQ(record.window(kForward, 1)[0].z, 4.0);
}

TEST(FloorRecord, starts_anew_after_a_gap_that_it_cannot_measure) {
  Record record;
  push(record, 1.0, kForward, 1.0);
  record.elapse(1e6);
  EXPECT_EQ(record.size(kForward), 0U);
}

TEST(FloorRecord, follows_a_change_of_unit_and_of_offset) {
  Record record;
  push(record, 1.0, kForward, 1.0);
  push(record, 4.0, kForward, 2.0);
  record.rescale_time(2.0);
  record.shift_offset(10.0);
  const RecordWindow window = record.window(kForward, 2);
  EXPECT_NEAR(window.time(window[0]), -2.0, 1e-4);
  EXPECT_EQ(window[0].z, 11.0);
}

}  // namespace
}  // namespace ftcs::estimation
