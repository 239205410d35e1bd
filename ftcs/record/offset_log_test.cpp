// SPDX-License-Identifier: MIT
// World: lines as ptp4l 3.1 and 4, phc2sys and syslog write them.
#include "ftcs/record/offset_log.h"

#include <gtest/gtest.h>

namespace ftcs {
namespace {

TEST(OffsetLog, reads_ptp4l) {
  const auto line = parse_offset_log_line(
      "ptp4l[5197.201]: master offset        -12 s2 freq   +1234 path delay       567");
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->time_s, 5197.201);
  EXPECT_EQ(line->offset_ns, -12.0);
  EXPECT_EQ(line->state, 2);
  EXPECT_EQ(line->frequency_ppb, 1234.0);
  EXPECT_EQ(line->delay_ns, 567.0);
}

TEST(OffsetLog, reads_phc2sys_and_syslog) {
  const auto line = parse_offset_log_line(
      "Nov 21 09:00:00 host phc2sys[991]: [12345.678] CLOCK_REALTIME phc offset 31 s0 freq -5 "
      "delay 468");
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->time_s, 12345.678);
  EXPECT_EQ(line->offset_ns, 31.0);
  EXPECT_EQ(line->state, 0);
  EXPECT_EQ(line->frequency_ppb, -5.0);
}

TEST(OffsetLog, leaves_other_lines_alone) {
  for (const char* text : {"", "ptp4l[1.0]: port 1: MASTER to UNCALIBRATED",
                           "ptp4l[2.0]: rms 12 max 30 freq +5 +/- 3 delay 100 +/- 1", "offset",
                           "offset 5", "offset x s2", "offset 5 s7"}) {
    EXPECT_FALSE(parse_offset_log_line(text).has_value()) << text;
  }
  EXPECT_TRUE(is_linuxptp_line("ptp4l[1.0]: selected /dev/ptp0 as PTP clock"));
  EXPECT_FALSE(is_linuxptp_line("# made by ptp4l"));
}

}  // namespace
}  // namespace ftcs
