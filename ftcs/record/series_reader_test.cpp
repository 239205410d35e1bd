// SPDX-License-Identifier: MIT
// World: small files of every kind that is understood, and of many that are not.
#include "ftcs/record/series_reader.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

class SeriesReader : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = ::testing::TempDir() + "ftcs_series_" +
            ::testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  void TearDown() override { std::filesystem::remove(path_); }

  Result<Series, ReadError> read(std::string_view content, const SeriesOptions& options = {}) {
    std::ofstream(path_, std::ios::binary) << content;
    return read_series(path_, options);
  }
  /// The error without the name of the file.
  std::string error(std::string_view content, const SeriesOptions& options = {}) {
    const auto series = read(content, options);
    return series ? "no error" : series.error().text().substr(path_.size());
  }

  std::string path_;
};

TEST_F(SeriesReader, takes_one_column_for_phase_in_seconds_at_one_second) {
  const auto series = read("# counter\n1e-9\n2e-9\n\n-3e-9\n");
  ASSERT_TRUE(series.ok());
  EXPECT_EQ(series->kind, RecordKind::kPhase);
  EXPECT_EQ(series->values, (std::vector<double>{1e-9, 2e-9, -3e-9}));
  EXPECT_EQ(series->interval_s, 1.0);
  EXPECT_EQ(series->samples, 3U);
}

TEST_F(SeriesReader, takes_the_first_of_two_columns_for_time) {
  const auto series = read("100 1\n100.5 2\n101.5 3\n102 4\n102.5 5\n");
  ASSERT_TRUE(series.ok());
  EXPECT_EQ(series->interval_s, 0.5);
  EXPECT_EQ(series->values.size(), 6U);
  EXPECT_EQ(series->missing, 1U);
}

TEST_F(SeriesReader, finds_the_times_behind_a_byte_order_mark) {
  const auto series = read("\xEF\xBB\xBFtime,offset_ns\n10,5\n12,-3\n14,4\n");
  ASSERT_TRUE(series.ok()) << series.error().text();
  EXPECT_EQ(series->kind, RecordKind::kOffset);
  EXPECT_EQ(series->interval_s, 2.0);
  EXPECT_NEAR(series->values[0], 5e-9, 1e-20);
}

TEST_F(SeriesReader, takes_a_record_in_hertz_with_its_nominal_frequency) {
  SeriesOptions options;
  options.unit = "Hz";
  options.nominal_hz = 10e6;
  const auto series = read("9999999.99\n10000000.02\n10000000\n", options);
  ASSERT_TRUE(series.ok()) << series.error().text();
  EXPECT_EQ(series->kind, RecordKind::kFrequency);
  EXPECT_NEAR(series->values[0], -1e-9, 1e-16);
  EXPECT_NEAR(series->values[1], 2e-9, 1e-16);
  EXPECT_EQ(series->values[2], 0.0);
  options.unit.clear();
  const auto headed = read("t,freq_MHz\n0,10.0000001\n1,9.9999999\n", options);
  ASSERT_TRUE(headed.ok()) << headed.error().text();
  EXPECT_NEAR(headed->values[0], 1e-8, 1e-15);
}

TEST_F(SeriesReader, refuses_hertz_without_a_nominal_frequency_and_the_other_way_round) {
  SeriesOptions options;
  options.unit = "Hz";
  options.kind = RecordKind::kFrequency;
  EXPECT_NE(error("10000000.1\n9999999.9\n", options).find("--nominal"), std::string::npos);
  EXPECT_NE(error("t,f_MHz\n0,10.0000001\n").find("--nominal"), std::string::npos);
  options.unit = "ppb";
  options.nominal_hz = 10e6;
  EXPECT_NE(error("1\n2\n", options).find("belongs to values in Hz"), std::string::npos);
}

TEST_F(SeriesReader, does_not_analyse_hertz_as_phase_or_fraction) {
  const std::string hertz = "9999999.99\n10000000.02\n10000000\n";
  EXPECT_NE(error(hertz).find("--unit Hz --nominal"), std::string::npos);
  SeriesOptions options;
  options.kind = RecordKind::kFrequency;
  EXPECT_NE(error(hertz, options).find("--unit Hz --nominal"), std::string::npos);
  EXPECT_NE(error("time,freq\n0,9999999.99\n1,10000000.02\n").find("--unit Hz"), std::string::npos);
  options.unit = "1";
  EXPECT_TRUE(read(hertz, options).ok());
  options = {};
  options.kind = RecordKind::kPhase;
  EXPECT_TRUE(read(hertz, options).ok());
  EXPECT_TRUE(read("0\n1000\n2000\n3000\n").ok());  // a phase that runs away
}

TEST_F(SeriesReader, learns_kind_and_units_from_headings) {
  const auto series = read("time_ms,state,offset_us\n0,x,1\n250,y,-2\n500,z,nan\n");
  SeriesOptions options;
  options.column = "offset_us";
  const auto offsets = read("time_ms,state,offset_us\n0,x,1\n250,y,-2\n500,z,nan\n", options);
  EXPECT_FALSE(series.ok());  // the first column that is no time holds words
  ASSERT_TRUE(offsets.ok());
  EXPECT_EQ(offsets->kind, RecordKind::kOffset);
  EXPECT_DOUBLE_EQ(offsets->interval_s, 0.25);
  EXPECT_DOUBLE_EQ(offsets->values[1], -2e-6);
  EXPECT_EQ(offsets->missing, 1U);
}

TEST_F(SeriesReader, does_what_it_is_told) {
  SeriesOptions options;
  options.column = "1";
  options.time_column = "none";
  options.kind = RecordKind::kFrequency;
  options.unit = "ppb";
  options.interval_s = 0.1;
  const auto series = read("3;x\n1;y\n", options);
  ASSERT_TRUE(series.ok());
  EXPECT_EQ(series->kind, RecordKind::kFrequency);
  EXPECT_EQ(series->interval_s, 0.1);
  EXPECT_DOUBLE_EQ(series->values[0], 3e-9);
}

TEST_F(SeriesReader, keeps_the_digits_of_an_epoch_in_nanoseconds) {
  SeriesOptions options;
  options.time_unit = "ns";
  const auto series =
      read("1700000000000000000 1\n1700000000125000000 2\n1700000000250000000 3\n", options);
  ASSERT_TRUE(series.ok());
  EXPECT_NEAR(series->interval_s, 0.125, 1e-6);
}

TEST_F(SeriesReader, reads_a_log_from_its_lock_on) {
  const auto series = read(
      "ptp4l[1.0]: selected /dev/ptp0 as PTP clock\n"
      "ptp4l[2.0]: master offset 90000 s0 freq +0 path delay 100\n"
      "ptp4l[3.0]: master offset 90100 s1 freq +100 path delay 100\n"
      "ptp4l[4.0]: master offset -50 s2 freq +50 path delay 100\n"
      "ptp4l[4.0]: port 1: UNCALIBRATED to SLAVE\n"
      "ptp4l[5.0]: master offset 20 s2 freq +60 path delay 100\n"
      "ptp4l[8.0]: master offset 10 s2 freq +60 path delay 100\n"
      "ptp4l[9.0]: master offset 10 s2 freq +60 path delay 100\n");
  ASSERT_TRUE(series.ok());
  EXPECT_EQ(series->kind, RecordKind::kOffset);
  EXPECT_EQ(series->samples, 4U);
  EXPECT_EQ(series->missing, 2U);
  EXPECT_EQ(series->lines_left_out, 2U);
  EXPECT_DOUBLE_EQ(series->values[0], -50e-9);
}

TEST_F(SeriesReader, takes_the_interval_that_is_told_where_a_log_has_no_times) {
  SeriesOptions options;
  options.interval_s = 0.125;
  const auto series = read(
      "ptp4l: master offset -50 s2 freq +50 path delay 100\n"
      "ptp4l: master offset 20 s2 freq +60 path delay 100\n"
      "ptp4l: master offset 10 s2 freq +60 path delay 100\n",
      options);
  ASSERT_TRUE(series.ok()) << series.error().text();
  EXPECT_EQ(series->interval_s, 0.125);
  ASSERT_EQ(series->values.size(), 3U);
  EXPECT_NEAR(series->values[1], 20e-9, 1e-15);
}

TEST_F(SeriesReader, reads_the_offsets_of_chronys_tracking_log) {
  const auto series = read(
      "====================\n"
      "   Date (UTC) Time     IP Address   St   Freq ppm   Skew ppm     Offset L Co  Offset sd\n"
      "====================\n"
      "2024-01-01 00:00:00 192.0.2.1 2 20.0 0.1  5.0e-04 N 1 3e-08 0.0 2e-05 2e-05 1.5\n"
      "2024-01-01 00:00:04 192.0.2.1 2 20.0 0.1 -6.0e-08 N 1 3e-08 0.0 2e-05 2e-05 1.5\n"
      "2024-01-01 00:00:12 192.0.2.1 2 20.0 0.1  2.0e-08 N 1 3e-08 0.0 2e-05 2e-05 1.5\n"
      "2024-01-01 00:00:16 192.0.2.1 2 20.0 0.1  3.0e-08 N 1 3e-08 0.0 2e-05 2e-05 1.5\n");
  ASSERT_TRUE(series.ok()) << series.error().text();
  EXPECT_EQ(series->kind, RecordKind::kOffset);
  EXPECT_EQ(series->interval_s, 4.0);
  EXPECT_EQ(series->missing, 1U);
  EXPECT_NEAR(series->values[0], 5e-4, 1e-12);
  EXPECT_NEAR(series->values[1], -6e-8, 1e-12);
}

TEST_F(SeriesReader, takes_the_offset_of_exchanges_not_their_stamps) {
  // 300 ns ahead over 1,000 ns of path; the third request was lost.
  const std::string_view stamps =
      "t1,t2,t3,t4\n"
      "1700000000000000000,1700000000000001300,1700000000000500300,1700000000000501000\n"
      "1700000000125000000,1700000000125001300,1700000000125500300,1700000000125501000\n"
      "1700000000250000000,1700000000250001300,,\n"
      "1700000000375000000,1700000000375001310,1700000000375500310,1700000000375501000\n";
  const auto series = read(stamps);
  ASSERT_TRUE(series.ok()) << series.error().text();
  EXPECT_EQ(series->kind, RecordKind::kOffset);
  EXPECT_EQ(series->interval_s, 0.125);
  ASSERT_EQ(series->values.size(), 4U);
  EXPECT_NEAR(series->values[0], 300e-9, 1e-15);
  EXPECT_NEAR(series->values[3], 310e-9, 1e-15);

  SeriesOptions options;
  options.unit = "us";
  EXPECT_NE(error(stamps, options).find("--unit is for tables"), std::string::npos);
  options.column = "t2";
  EXPECT_TRUE(read(stamps, options).ok()) << "a column by its name is a table's";
}

TEST_F(SeriesReader, says_what_was_expected_and_what_came) {
  EXPECT_EQ(error(""), ": the file is empty: expected numbers or a log of linuxptp");
  EXPECT_EQ(error("# only\n# comments\n"),
            ": expected numbers or offsets of a log, got none in 2 lines");
  EXPECT_EQ(error("nan\nnan\n"), ": expected numbers or offsets of a log, got none in 2 lines");
  EXPECT_EQ(error("1\n2\nthree\n"), ":3: expected a finite number in column 1, got 'three'");
  EXPECT_EQ(error("1\ninf\n"), ":2: expected a finite number in column 1, got 'inf'");
  EXPECT_EQ(error("1 5\n2 6\n3\n"), ":3: expected at least 2 columns, got 1 (a truncated line?)");
  EXPECT_EQ(error("1 5\nx 6\n"), ":2: expected a time in column 1, got 'x'");
  EXPECT_NE(error("2 5\n1 6\n").find(":2: expected ascending times in column 1, got '1'"),
            std::string::npos);
  EXPECT_NE(error("ptp4l[1.0]: port 1: LISTENING\n").find("got none in 1 lines"),
            std::string::npos);
  EXPECT_NE(error("the quick brown fox\njumps\n").find("column 1, got 'jumps'"), std::string::npos);
}

TEST_F(SeriesReader, refuses_columns_and_units_that_do_not_exist) {
  SeriesOptions options;
  options.column = "7";
  EXPECT_EQ(error("time,offset\n1,2\n", options),
            ":1: there is no column '7': expected 1 to 2 or 'time', 'offset'");
  options.column = "";
  options.unit = "ppb";
  options.kind = RecordKind::kOffset;
  EXPECT_EQ(error("1\n", options),
            ":1: the unit of offset values is one of s, ms, us, ns, ps, d, got 'ppb'");
  options.unit = "";
  options.time_unit = "fortnight";
  EXPECT_NE(error("1 2\n", options).find("unit of times"), std::string::npos);
}

TEST_F(SeriesReader, refuses_binary_data) {
  EXPECT_NE(error(std::string_view("\x1f\x8b\x08\x00", 4)).find("gzip data"), std::string::npos);
  EXPECT_EQ(error(std::string_view("\0\1\2", 3)), ":1: expected text or gzip, got binary data");
}

}  // namespace
}  // namespace ftcs
