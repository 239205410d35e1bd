// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/csp_axis.h"

#include <gtest/gtest.h>

namespace ftcs::ethercat {
namespace {

TEST(CspAxis, resets_a_fault_with_an_edge_and_does_not_enable_by_itself) {
  CspAxis axis;
  const csp::Inputs fault{.statusword = 0x0208, .position = 5};
  EXPECT_EQ(axis.cycle(fault, {.enable = true}).controlword, 0);
  EXPECT_EQ(axis.state(), AxisState::kFault);
  EXPECT_EQ(axis.cycle(fault, {.enable = true, .reset_fault = true}).controlword, 0x80);
  EXPECT_EQ(axis.cycle(fault, {.enable = true, .reset_fault = true}).controlword, 0);
  EXPECT_EQ(axis.cycle({.statusword = 0x0250, .position = 5}, {}).controlword, 0);
  EXPECT_EQ(axis.cycle({.statusword = 0x0250, .position = 5}, {.enable = true}).controlword, 6);
}

TEST(InterpolationPeriod, is_mantissa_and_power_of_ten) {
  EXPECT_EQ(InterpolationPeriod::of(Nanoseconds{1'000'000}).mantissa, 1);
  EXPECT_EQ(InterpolationPeriod::of(Nanoseconds{1'000'000}).exponent, -3);
  EXPECT_EQ(InterpolationPeriod::of(Nanoseconds{250'000}).mantissa, 25);
  EXPECT_EQ(InterpolationPeriod::of(Nanoseconds{250'000}).exponent, -5);
  EXPECT_EQ(InterpolationPeriod::of(Nanoseconds{1'234'567}).mantissa, 0);
}

}  // namespace
}  // namespace ftcs::ethercat
