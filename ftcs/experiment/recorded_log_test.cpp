// SPDX-License-Identifier: MIT
// World: files of a few hundred lines, written here; an oscillator 20 ppm fast, one message a
// second.
#include "ftcs/experiment/recorded_log.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>
#include <zlib.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "ftcs/experiment/log_replay.h"

namespace ftcs::experiment {
namespace {

class RecordedLogTest : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / fmt::format("ftcs-log-{}.txt", getpid());
  }
  void TearDown() override { std::filesystem::remove(path_); }

  RecordedLog read(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    auto log = read_recorded_log(path_.string());
    EXPECT_TRUE(log.ok()) << (log.ok() ? "" : log.error().text());
    return log.ok() ? *log : RecordedLog{};
  }
  /// Free running minus reference of entry i, ns.
  static double x_ns(const RecordedLog& log, std::size_t i) {
    const EventPair& pair = log.pairs.at(i).pair;
    return (pair.free_running.since_epoch() - pair.reference.since_epoch()).ns();
  }

  std::filesystem::path path_;
};

TEST_F(RecordedLogTest, a_free_running_ptp4l_log_is_taken_as_it_stands) {
  std::string text = "ptp4l[100.000]: selected local clock\n";
  for (int i = 0; i < 10; ++i) {
    text += fmt::format("ptp4l[{}.001]: master offset {:10} s0 freq  +20000 path delay  1000\n",
                        101 + i, 5000 + 20'000 * i);
  }
  const RecordedLog log = read(text);
  ASSERT_EQ(log.pairs.size(), 10U);
  EXPECT_EQ(x_ns(log, 0), 5000.0);
  EXPECT_EQ(x_ns(log, 9), 185'000.0);
  EXPECT_EQ(log.unusable, 1U);
  EXPECT_NE(log.notes.front().find("s0 throughout"), std::string::npos);
  EXPECT_EQ(log.interval_s, 1.0);
}

// An oscillator 20,000 ppb fast; ptp4l steps at the third line and compensates what it measured.
TEST_F(RecordedLogTest, a_steered_ptp4l_log_gives_back_the_free_running_clock) {
  const RecordedLog log = read(
      "ptp4l[10.000]: master offset 100000 s0 freq +0 path delay 1000\n"
      "ptp4l[11.000]: master offset 120000 s1 freq +19000 path delay 1000\n"
      "ptp4l[12.001]: master offset 1000 s2 freq +20700 path delay 1000\n"
      "ptp4l[13.000]: master offset 300 s2 freq +20000 path delay 1000\n"
      "ptp4l[14.000]: master offset 300 s2 freq +20000 path delay 1000\n");
  ASSERT_EQ(log.pairs.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(x_ns(log, i), 100'000.0 + 20'000.0 * static_cast<double>(i), 1e-6);
}

TEST_F(RecordedLogTest, chrony_tracking_gives_back_the_free_running_clock) {
  std::string text =
      "   Date (UTC) Time     IP Address   St   Freq ppm   Skew ppm     Offset L Co  Offset sd "
      "Rem. corr. Root delay "
      "Root disp. Max. error\n"
      "=====================\n";
  for (int i = 0; i < 5; ++i) {
    text += fmt::format(
        "2026-01-02 03:04:{:02} 192.0.2.1        2     20.000      0.075  0.000e+00 N  1  1.0e-06  "
        "0.000e+00  1.5e-04 "
        "3.4e-05 8.3e-05\n",
        5 + 4 * i);
  }
  const RecordedLog log = read(text);
  ASSERT_EQ(log.pairs.size(), 5U);
  EXPECT_EQ(log.format, "chrony tracking");
  EXPECT_NEAR(x_ns(log, 4), 20'000.0 * 16, 1e-3);
}

TEST_F(RecordedLogTest, chrony_measurements_have_the_sign_of_local_minus_reference) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    text += fmt::format(
        "2026-01-02 03:04:{:02} 192.0.2.1     N  2 111 111 1111  4  4 0.10 -4.966e-06  2.296e-04  "
        "1.577e-05  1.6e-04  "
        "7.4e-03 CB00710F 4B D K\n",
        5 + 16 * i);
  }
  const RecordedLog log = read(text.substr(0, text.size()));
  EXPECT_EQ(log.format, "chrony measurements");
  EXPECT_NEAR(x_ns(log, 0), 4966.0, 1e-6);
}

TEST_F(RecordedLogTest, csv_of_exchanges_keeps_nanoseconds_of_1970_seconds) {
  const RecordedLog log = read(
      "t1_s,t2_s,t3_s,t4_s,truth_ns\n"
      "1700000000.000000001,1700000000.000010003,1700000000.500000000,1700000000.500010001,2\n"
      "1700000001.000000001,1700000001.000010003,1700000001.500000000,1700000001.500010001,2\n"
      "junk,1,2,3,4\n");
  ASSERT_EQ(log.pairs.size(), 4U);
  EXPECT_TRUE(log.two_way);
  EXPECT_TRUE(log.has_truth);
  EXPECT_NEAR(x_ns(log, 0), 10'002.0, 1e-3);
  EXPECT_EQ(log.unusable, 1U);
  ASSERT_EQ(log.examples.size(), 1U);
  EXPECT_EQ(log.examples[0].number, 4U);
}

TEST_F(RecordedLogTest, a_gzip_file_is_read_as_its_content) {
  gzFile file = gzopen(path_.c_str(), "wb");
  ASSERT_NE(file, nullptr);
  const std::string text = "time_s,offset_ns\n0,10\n1,20\n2,30\n";
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  const auto log = read_recorded_log(path_.string());
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(log->pairs.size(), 3U);
}

TEST_F(RecordedLogTest, empty_binary_and_foreign_files_are_one_clear_error) {
  for (const std::string& text :
       {std::string(), std::string("\0\1\2\3", 4), std::string("hello\nworld\n")}) {
    std::ofstream(path_, std::ios::binary) << text;
    const auto log = read_recorded_log(path_.string());
    ASSERT_FALSE(log.ok());
    EXPECT_NE(log.error().text().find(path_.string()), std::string::npos);
  }
  EXPECT_FALSE(read_recorded_log("no/such/file").ok());
}

// An oscillator 20 ppm fast with 100 ns of alternating error: every servo but none follows; the
// truth is the ramp.
TEST_F(RecordedLogTest, a_replay_tells_what_the_clock_would_have_done) {
  std::string text = "time_s,offset_ns,truth_ns\n";
  for (int i = 0; i < 400; ++i)
    text += fmt::format("{},{},{}\n", i, 20'000 * i + (i % 2 == 0 ? 100 : -100), 20'000 * i);
  const auto results = replay_log(read(text));
  EXPECT_EQ(results.back().servo, "none");
  EXPECT_GT(results.back().rms_time_error_ns, 1e6);
  for (const auto& result : results) {
    if (result.servo == "none") continue;
    EXPECT_LT(result.rms_time_error_ns, 500.0) << result.servo;
  }
}

}  // namespace
}  // namespace ftcs::experiment
