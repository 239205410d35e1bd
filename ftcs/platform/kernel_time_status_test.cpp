// SPDX-License-Identifier: MIT
#include "ftcs/platform/kernel_time_status.h"

#include <gtest/gtest.h>

#include "test/support/fake_clocks.h"

namespace ftcs::platform {
namespace {

TEST(KernelTimeStatus, tells_other_programs_what_the_clock_is_worth) {
  FakeClocks kernel;
  kernel.system.status = STA_UNSYNC | STA_PLL;
  ASSERT_EQ(publish(kernel, {.synchronised = true,
                             .leap = 1,
                             .tai_offset = 37,
                             .estimated_error_us = 3,
                             .largest_error_us = 12}),
            0);
  EXPECT_EQ(kernel.system.status, STA_INS) << "no PLL goes on steering";
  EXPECT_EQ(kernel.system.tai, 37);
  EXPECT_EQ(kernel.system.esterror, 3);
  EXPECT_EQ(kernel.system.maxerror, 12);
  ASSERT_EQ(publish(kernel, {.leap = -1}), 0);
  EXPECT_EQ(kernel.system.status, STA_UNSYNC | STA_DEL);
  EXPECT_EQ(kernel.system.tai, 37) << "not told: not touched";
  EXPECT_EQ(kernel.system.freq, 0);
}

TEST(KernelTimeStatus, says_when_it_was_refused) {
  FakeClocks kernel;
  kernel.adjust_errno = EPERM;
  EXPECT_EQ(publish(kernel, {.synchronised = true}), -EPERM);
  EXPECT_EQ(kernel.system.status, STA_UNSYNC);
}

}  // namespace
}  // namespace ftcs::platform
