// SPDX-License-Identifier: MIT
// World: files of a few hundred lines, written here; an oscillator 20 ppm fast, one message a
// second.
#include "ftcs/record/recorded_log.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>
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
  EXPECT_NE(log.replay_notes.front().find("s0 throughout"), std::string::npos);
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

TEST_F(RecordedLogTest, a_byte_order_mark_begins_a_table) {
  const RecordedLog log = read("\xEF\xBB\xBFtime_s,offset_ns\n0,10\n1,20\n2,30\n");
  EXPECT_EQ(log.pairs.size(), 3U);
  EXPECT_EQ(log.unusable, 0U);
}

// Saturated, it would count as used and stand for 146 years.
TEST_F(RecordedLogTest, a_line_with_a_number_that_does_not_fit_is_left_out) {
  std::string text;
  for (int i = 0; i < 6; ++i) {
    text += fmt::format("ptp4l[{}.0]: master offset {} s2 freq +1 path delay 5\n", i,
                        i == 3 ? "99999999999999999999999" : std::to_string(i));
  }
  const RecordedLog log = read(text);
  EXPECT_EQ(log.used, 5U);
  EXPECT_EQ(log.unusable, 1U);
  ASSERT_EQ(log.examples.size(), 1U);
  EXPECT_EQ(log.examples[0].number, 4U);
  EXPECT_EQ(log.examples[0].text.rfind("a number that is too large for a clock", 0), 0U);
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

// An oscillator 20 ppm fast; Delay_Req 250 ms after Sync. Truth is told at the Sync: at the request
// the clock is 5 us further, and an unsteered clock's error there is that, exactly.
TEST_F(RecordedLogTest, truth_is_interpolated_to_the_instants_of_delay_requests) {
  std::string text = "t1_ns,t2_ns,t3_ns,t4_ns,truth_ns\n";
  for (std::int64_t i = 0; i < 8; ++i) {
    const std::int64_t sync = 1'000'000'000 * i;
    const std::int64_t request = sync + 250'000'000;
    text += fmt::format("{},{},{},{},{}\n", sync, sync + 20'000 * i + 1000,
                        request + 20'000 * i + 5'000, request + 1000, 20'000 * i);
  }
  const RecordedLog log = read(text);
  ASSERT_EQ(log.pairs.size(), 16U);
  EXPECT_EQ(log.pairs[1].pair.direction, Direction::kBackward);
  EXPECT_NEAR(log.pairs[1].truth_ns.value_or(0.0), 5'000.0, 0.2);
  EXPECT_FALSE(log.pairs[15].truth_ns) << "no truth is told after it";
}

/// A clock whose oscillator is 20 ppm fast, steered by alternating +-`ppm` from each line on.
std::string steered_exchanges(const std::string& heading, double ppm, bool as_addend) {
  std::string text = heading + "\n";
  double local_ns = 0.0;
  for (int i = 0; i < 20; ++i) {
    const double sync_ns = 1e9 * i;
    const double frequency = (i % 2 == 0 ? ppm : -ppm) * 1e-6;
    text += fmt::format("{:.3f},{:.3f},,,{:.6f},{:.3f}", sync_ns, local_ns + 1000.0,
                        as_addend ? 3'000'000'000.0 * (1.0 + frequency) : frequency * 1e9,
                        local_ns - sync_ns);
    text += as_addend ? ",3000000000\n" : "\n";
    local_ns += 1e9 * (1.0 + 20e-6) * (1.0 + frequency);
  }
  return text;
}

TEST_F(RecordedLogTest, a_steered_clock_with_its_frequency_gives_back_the_free_running_clock) {
  for (const bool as_addend : {false, true}) {
    const RecordedLog log = read(steered_exchanges(
        as_addend ? "t1,t2,t3,t4,addend,truth,nominal_addend" : "t1,t2,t3,t4,freq_ppb,truth", 50.0,
        as_addend));
    ASSERT_EQ(log.pairs.size(), 20U);
    EXPECT_TRUE(log.steered);
    for (std::size_t i = 0; i < log.pairs.size(); ++i) {
      EXPECT_NEAR(x_ns(log, i), 20'000.0 * static_cast<double>(i) + 1000.0, 0.02) << i;
      EXPECT_NEAR(log.pairs[i].truth_ns.value_or(0.0), 20'000.0 * static_cast<double>(i), 0.02);
    }
  }
}

TEST_F(RecordedLogTest, a_frequency_that_is_none_is_an_unusable_line) {
  const RecordedLog log = read("time,offset,freq\n0,0,0\n1,0,0\n2,0,x\n3,0,600000000\n4,0,0\n");
  EXPECT_EQ(log.pairs.size(), 3U);
  EXPECT_EQ(log.unusable, 2U);
}

TEST_F(RecordedLogTest, units_may_stand_in_the_heading_in_any_customary_form) {
  const RecordedLog log = read("Time [s];Offset (us)\n0;1\n1;2\n2;3\n");
  EXPECT_EQ(x_ns(log, 2), 3000.0);
}

constexpr const char* kJournal =
    "ptp4l[10.0]: master offset 10 s2 freq +0 path delay 1000\n"
    "phc2sys[10.1]: CLOCK_REALTIME phc offset 700 s2 freq +0 delay 5\n"
    "ptp4l[11.0]: master offset 20 s2 freq +0 path delay 1000\n"
    "phc2sys[11.1]: CLOCK_REALTIME phc offset 800 s2 freq +0 delay 5\n"
    "ptp4l[12.0]: master offset 30 s2 freq +0 path delay 1000\n"
    "phc2sys[12.1]: CLOCK_REALTIME phc offset 900 s2 freq +0 delay 5\n"
    "phc2sys[13.1]: CLOCK_REALTIME phc offset 950 s2 freq +0 delay 5\n";

TEST_F(RecordedLogTest, one_clock_of_a_mixed_journal_is_replayed_and_the_others_are_named) {
  const RecordedLog largest = read(kJournal);
  EXPECT_EQ(largest.format, "phc2sys");
  EXPECT_EQ(largest.source, "phc2sys CLOCK_REALTIME");
  EXPECT_EQ(largest.used, 4U);
  EXPECT_NE(largest.notes.front().find("ptp4l (3 lines)"), std::string::npos);
  const auto chosen = read_recorded_log(path_.string(), "ptp4l");
  ASSERT_TRUE(chosen.ok());
  EXPECT_EQ(x_ns(*chosen, 2), 30.0);
  const auto wrong = read_recorded_log(path_.string(), "ts2phc");
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().text().find("no offsets of 'ts2phc'"), std::string::npos);
}

// An oscillator 20 ppm fast and 10 ppb faster in every other second; what ptp4l said of itself
// stays what it said.
TEST_F(RecordedLogTest, summaries_give_the_oscillator_and_the_magnitudes_of_the_recorded_clock) {
  std::string text = "phc2sys[9.9]: CLOCK_REALTIME rms 500 max 900 freq +1 +/- 3 delay 5 +/- 1\n";
  for (int i = 0; i < 8; ++i) {
    text += fmt::format("ptp4l[{}.001]: rms {} max 80 freq {:+} +/- 30 delay 1000 +/- 10\n", 10 + i,
                        i % 2 == 0 ? 30 : 40, i % 2 == 0 ? 20'000 : 20'010);
  }
  const RecordedLog log = read(text);
  EXPECT_EQ(log.source, "ptp4l");
  ASSERT_EQ(log.pairs.size(), 8U);
  EXPECT_NEAR(x_ns(log, 7), 4 * 20'010.0 + 3 * 20'000.0, 1e-6);
  EXPECT_NE(log.replay_notes.at(1).find("lower limits"), std::string::npos);
  const auto results = replay_log(log, {"adaptive"});
  ASSERT_EQ(results.size(), 2U);
  const ReplayResult& recorded = results[results[0].servo == kAsRecorded ? 0 : 1];
  EXPECT_NEAR(recorded.rms_offset_ns, std::sqrt(0.5 * (30.0 * 30.0 + 40.0 * 40.0)), 1e-9);
  EXPECT_EQ(recorded.max_offset_ns, 80.0);
  EXPECT_TRUE(std::isnan(recorded.median_ns)) << "no summary tells it";
}

TEST_F(RecordedLogTest, summaries_beside_offsets_of_one_program_are_left_out) {
  const RecordedLog log = read(
      "ptp4l[10.0]: master offset 10 s2 freq +0 path delay 1000\n"
      "ptp4l[11.0]: rms 12 max 30 freq +5 +/- 3 delay 100 +/- 1\n"
      "ptp4l[12.0]: master offset 20 s2 freq +0 path delay 1000\n"
      "ptp4l[13.0]: master offset 30 s2 freq +0 path delay 1000\n");
  EXPECT_EQ(log.used, 3U);
  EXPECT_EQ(log.unusable, 1U);
  EXPECT_TRUE(log.summaries.empty());
}

TEST_F(RecordedLogTest, chrony_tells_its_servers_and_reference_clocks_apart) {
  std::string measurements;
  std::string statistics;
  std::string refclocks;
  for (int i = 0; i < 4; ++i) {
    for (const int server : {1, 2}) {  // the second one is 1 ms away
      measurements += fmt::format(
          "2026-01-02 03:04:{:02} 192.0.2.{} N 2 111 111 1111 4 4 0.10 {:e} 2e-4 1e-5 1e-4 7e-3 "
          "CB00710F 4B D K\n",
          5 + 16 * i - (i / 3) * 3, server, server == 1 ? -5e-6 : -1e-3);
      statistics += fmt::format(
          "2026-01-02 03:0{}:05 192.0.2.{} 6e-6 {:e} 2e-6 1e-6 1e-6 7.8e-02 16 0 8 0.00\n", i,
          server, server == 1 ? 5e-6 : 1e-3);
    }
    refclocks += fmt::format("2026-01-02 03:04:{:02}.250000 PPS 7 N 1 4.9e-07 -5.0e-06 1e-06\n", i);
    refclocks += fmt::format("2026-01-02 03:04:{:02}.500000 PPS - N - - -5.0e-06 1e-06\n", i);
  }
  for (const auto& [text, format, source] :
       {std::tuple{statistics, "chrony statistics", "192.0.2.1"},
        std::tuple{refclocks, "chrony refclocks", "PPS"}}) {
    const RecordedLog log = read(text);
    EXPECT_EQ(log.format, format);
    EXPECT_EQ(log.source, source);
    EXPECT_EQ(log.used, 4U);
    EXPECT_NEAR(x_ns(log, 3), 5000.0, 1e-6) << format;
  }
  std::ofstream(path_) << measurements;
  const auto second = read_recorded_log(path_.string(), "192.0.2.2");
  ASSERT_TRUE(second.ok());
  EXPECT_NEAR(x_ns(*second, 1), 1e6, 1e-6);
  EXPECT_NE(second->notes.front().find("192.0.2.1 ("), std::string::npos);
  const auto wrong = read_recorded_log(path_.string(), "192.0.2.3");
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().text().find("no measurements of '192.0.2.3'"), std::string::npos);
}

// What ptp4l itself did stands beside the servos: here an offset of 300 ns for ever.
TEST_F(RecordedLogTest, the_clock_as_recorded_is_a_row_of_its_own) {
  std::string text;
  for (int i = 0; i < 40; ++i)
    text += fmt::format("ptp4l[{}.0]: master offset 300 s2 freq +20000 path delay 1000\n", 10 + i);
  const auto results = replay_log(read(text), {"ftcs"});
  ASSERT_EQ(results.size(), 2U);
  EXPECT_EQ(results.back().servo, kAsRecorded);
  EXPECT_NEAR(results.back().rms_offset_ns, 300.0, 1e-3);
  EXPECT_NEAR(results.back().median_ns, 300.0, 1e-3);
  EXPECT_LT(results.front().rms_offset_ns, 1.0);
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
    EXPECT_LE(result.median_ns, result.percentile_95_ns) << result.servo;
    if (result.servo != "adaptive") continue;
    EXPECT_GT(result.within_sigma[2], 0.95);
    EXPECT_LE(result.within_sigma[0], result.within_sigma[1]);
  }
}

}  // namespace
}  // namespace ftcs::experiment
