// SPDX-License-Identifier: MIT
// World: one sample, printed in each way; the format strings are those that parsers of ptp4l's log
// know
// ("master offset %10lld s%d freq %+7.0f path delay %9lld").
#include "ftcs/daemon/sample_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

namespace ftcs::daemon {
namespace {

SampleRecord sample() {
  SampleRecord record;
  record.time_s = 1.5;
  record.offset_known = true;
  record.offset = Duration::from_whole_ns(-1234);
  record.telemetry.servo.state = ServoState::kLocked;
  record.telemetry.servo.path_delay = Duration::from_whole_ns(2500);
  record.telemetry.servo.offset_gain = 0.0625;
  record.telemetry.applied_rate = Rate::from_ppb(-50'000.0);
  return record;
}

TEST(SampleReport, the_line_is_ptp4ls_to_the_character) {
  // What ptp4l's own format string makes of a clock that is 50 ppm fast.
  char expected[100];
  std::snprintf(expected, sizeof expected, "master offset %10lld s%d freq %+7.0f path delay %9lld",
                -1234LL, 2, 50'000.0, 2500LL);
  EXPECT_EQ(ptp4l_line(sample()), expected);
}

TEST(SampleReport, a_rejected_sample_is_shown_as_such) {
  SampleRecord record = sample();
  record.telemetry.verdict = SampleVerdict::kRejected;
  EXPECT_TRUE(ptp4l_line(record).ends_with("path delay      2500 rejected"));
}

TEST(SampleReport, json_is_null_where_nothing_is_known) {
  SampleRecord record = sample();
  const std::string line = json_line(record);
  EXPECT_NE(line.find("\"offset_ns\":-1234,"), std::string::npos) << line;
  EXPECT_NE(line.find("\"state\":\"locked\","), std::string::npos) << line;
  EXPECT_NE(line.find("\"offset_sigma_ns\":null,"), std::string::npos) << line;
  record.offset_known = false;
  EXPECT_NE(json_line(record).find("\"offset_ns\":null,"), std::string::npos);
}

TEST(SampleReport, csv_lines_have_as_many_fields_as_the_header) {
  const auto commas = [](const std::string& line) {
    return std::count(line.begin(), line.end(), ',');
  };
  EXPECT_EQ(commas(csv_header()), commas(csv_line(sample())));
  EXPECT_TRUE(csv_header().starts_with("time_s,verdict,state,locked,offset_ns,"));
}

TEST(SampleReport, the_summary_is_rms_and_mean_and_deviation) {
  SampleSummary summary;
  SampleRecord record = sample();
  for (const int offset : {3, -4}) {
    record.offset = Duration::from_whole_ns(offset);
    summary.add(record);
  }
  // rms of 3 and 4 is sqrt(12.5).
  EXPECT_EQ(summary.text(), "rms    4 max    4 freq +50000 +/-   0 delay  2500 +/-   0");
}

TEST(SampleReport, the_deviations_of_the_summary_have_the_divisor_n) {
  SampleSummary summary;
  EXPECT_EQ(summary.offset_rms(), 0.0);
  SampleRecord record = sample();
  for (const int delay : {100, 200, -400}) {
    record.telemetry.servo.path_delay = Duration::from_whole_ns(delay);
    summary.add(record);
  }
  // sqrt(70000 - 1000 / 9 * 10) = 262.5; with the divisor n - 1 it would be 321.5.
  EXPECT_NE(summary.text().find("delay   -33 +/- 262"), std::string::npos) << summary.text();
}

}  // namespace
}  // namespace ftcs::daemon
