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

TEST(OffsetLog, tells_programs_and_clocks_of_one_journal_apart) {
  OffsetLog log;
  const char* lines[] = {
      "ptp4l[1.0]: master offset 1 s2 freq +1 path delay 5",
      "phc2sys[1.1]: CLOCK_REALTIME phc offset 2 s2 freq +1 delay 5",
      "phc2sys[1.2]: eth1 sys offset 3 s2 freq +1 delay 5",
      "phc2sys[2.1]: CLOCK_REALTIME phc offset 4 s2 freq +1 delay 5",
      "ptp4l[1.0]: [second] master offset 5 s2 freq +1 path delay 5",
      "ts2phc[1.3]: /dev/ptp1 master offset 6 s2 freq +1",
      "Nov 21 09:00:00 host phc2sys[991]: [2.2] CLOCK_REALTIME phc offset 7 s2 freq -5 delay 4",
  };
  for (const char* line : lines) EXPECT_EQ(log.add(line), "") << line;
  EXPECT_EQ(log.describe_sources(),
            "ptp4l (1 lines), phc2sys CLOCK_REALTIME (3 lines), phc2sys eth1 (1 lines), "
            "ptp4l [second] (1 lines), ts2phc /dev/ptp1 (1 lines)");
  EXPECT_EQ(log.pick("")->name, "phc2sys CLOCK_REALTIME");
  EXPECT_EQ(log.pick("phc2sys eth1")->lines.front().offset_ns, 3.0);
  EXPECT_EQ(log.pick("chronyd"), nullptr);
}

TEST(OffsetLog, reads_summaries_of_ptp4l_and_phc2sys) {
  const auto line = parse_summary_log_line(
      "ptp4l[2.5]: [second] rms   12 max   30 freq  +5123 +/-   3 delay   100 +/-   1");
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->source, "ptp4l [second]");
  EXPECT_EQ(line->time_s, 2.5);
  EXPECT_EQ(line->rms_ns, 12.0);
  EXPECT_EQ(line->max_ns, 30.0);
  EXPECT_EQ(line->frequency_ppb, 5123.0);
  for (const char* text : {"", "rms 12 max 30", "ptp4l[1.0]: rms x max 30 freq +5 +/- 3",
                           "ptp4l[1.0]: master offset 1 s2 freq +1 path delay 5"}) {
    EXPECT_FALSE(parse_summary_log_line(text).has_value()) << text;
  }
}

TEST(OffsetLog, prefers_offsets_to_summaries) {
  OffsetLog log;
  for (const char* text : {"phc2sys[1.0]: CLOCK_REALTIME rms 1 max 3 freq +5 +/- 3 delay 4 +/- 1",
                           "phc2sys[2.0]: CLOCK_REALTIME rms 1 max 3 freq +5 +/- 3 delay 4 +/- 1",
                           "ftcs[1.0]: master offset 1 s2 freq +1 path delay 5"}) {
    EXPECT_EQ(log.add(text), "") << text;
  }
  EXPECT_EQ(log.describe_sources(), "phc2sys CLOCK_REALTIME (2 summaries), ftcs (1 lines)");
  EXPECT_EQ(log.pick("")->name, "ftcs");
  EXPECT_EQ(log.add("ptp4l[2.0]: port 1: MASTER to UNCALIBRATED"), "no offset in it");
}

TEST(OffsetLog, refuses_numbers_that_no_clock_has) {
  OffsetLog log;
  for (const char* text :
       {"ptp4l[1.0]: master offset 99999999999999999999999 s2 freq +1 path delay 5",
        "ptp4l[1.0]: master offset -4700000000000000000 s2 freq +1 path delay 5",
        "ptp4l[1.0]: master offset 1 s2 freq +99999999999 path delay 5",
        "ptp4l[99999999999.0]: master offset 1 s2 freq +1 path delay 5",
        "ptp4l[1.0]: rms 1 max 99999999999999999999999 freq +1 +/- 3 delay 100 +/- 1"}) {
    EXPECT_EQ(log.add(text), "a number that is too large for a clock") << text;
  }
  EXPECT_TRUE(log.sources().empty());
  EXPECT_EQ(log.add("ptp4l[1.0]: master offset -4500000000000000000 s0 freq +1 path delay 5"), "");
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
