// SPDX-License-Identifier: MIT
// World: logs in test/data/logs, written by Debian's ptp4l, phc2sys and chronyd from their start on
// (recorded by test/peer/record_logs.sh). The clock they steered was 500 us away and 20 ppm fast:
// whatever they did to it, the rebuilt free-running clock must be that straight line.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/experiment/log_replay.h"
#include "ftcs/record/recorded_log.h"

namespace ftcs::experiment {
namespace {

constexpr double kSkew = 20e-6;

RecordedLog read(const std::string& name) {
  auto log = read_recorded_log("test/data/logs/" + name);
  EXPECT_TRUE(log.ok()) << (log.ok() ? "" : log.error().text());
  return log.ok() ? std::move(*log) : RecordedLog{};
}

/// Free running minus reference of entry i, ns.
double x_ns(const RecordedLog& log, std::size_t i) {
  const EventPair& pair = log.pairs.at(i).pair;
  return (pair.free_running.since_epoch() - pair.reference.since_epoch()).ns();
}

/// Entry i against the line of slope 20 ppm through the last entry.
double residual_ns(const RecordedLog& log, std::size_t i) {
  const std::size_t last = log.pairs.size() - 1;
  const Duration before = log.pairs[last].pair.reference - log.pairs[i].pair.reference;
  return x_ns(log, i) - (x_ns(log, last) - kSkew * before.ns());
}

double largest_residual_ns(const RecordedLog& log, std::size_t from) {
  double largest = 0.0;
  for (std::size_t i = from; i < log.pairs.size(); ++i)
    largest = std::max(largest, std::abs(residual_ns(log, i)));
  return largest;
}

void expect_followed(const RecordedLog& log, double rms_ns) {
  for (const ReplayResult& result : replay_log(log)) {
    if (result.servo == "none") continue;
    EXPECT_LT(result.rms_offset_ns, rms_ns) << result.servo;
  }
}

// s0 while it listens (37 s of UTC offset away), one step (s1), then s2. Its path delay is wrong by
// up to 7 us until the step, by 50 ppm of a second after it for some messages.
TEST(RealLog, ptp4l_from_its_start_over_the_step) {
  const RecordedLog log = read("ptp4l-startup.log");
  EXPECT_EQ(log.format, "ptp4l");
  ASSERT_GT(log.pairs.size(), 80U);
  EXPECT_NEAR(x_ns(log, 0), 37e9 + 790e3, 50e3);
  EXPECT_LT(largest_residual_ns(log, 0), 12e3);
  EXPECT_LT(largest_residual_ns(log, 40), 600.0);
  expect_followed(log, 1000.0);
}

// ptp4l with summary_interval: 18 summaries while it listens (frequency 0), one with the step in
// it, then of a clock that is steered. Its frequency is the oscillator's but for what the servo
// does.
TEST(RealLog, ptp4l_summaries_begin_where_the_clock_is_steered) {
  const RecordedLog log = read("ptp4l-summaries.log");
  EXPECT_EQ(log.format, "ptp4l");
  EXPECT_TRUE(log.steered);
  ASSERT_EQ(log.pairs.size(), 25U);
  ASSERT_EQ(log.summaries.size(), 25U);
  EXPECT_EQ(log.summaries.front().rms_ns, 310.0);
  EXPECT_EQ(log.summaries.back().max_ns, 217.0);
  EXPECT_LT(largest_residual_ns(log, 0), 1500.0) << "as far as its servo went to remove 0.9 us";
  ASSERT_GE(log.notes.size(), 1U);
  EXPECT_NE(log.notes.at(0).find("19 summaries of the time before"), std::string::npos);
  expect_followed(log, 1000.0);
}

// ptp4l over veth with free_running: 5 ppm slower than its transmitter, and nobody steers.
TEST(RealLog, ptp4l_summaries_of_a_clock_that_ran_freely) {
  const RecordedLog log = read("ptp4l-summaries-free.log");
  EXPECT_FALSE(log.steered);
  ASSERT_EQ(log.pairs.size(), 18U);
  const double seconds = 17.0 * 4.0;
  EXPECT_NEAR(x_ns(log, 17), -5000.0 * seconds, 50.0 * seconds);
  EXPECT_NE(log.replay_notes.at(1).find("nobody steered the clock"), std::string::npos);
}

TEST(RealLog, phc2sys_from_its_start_over_the_step) {
  const RecordedLog log = read("phc2sys-startup.log");
  EXPECT_EQ(log.format, "phc2sys");
  ASSERT_GT(log.pairs.size(), 50U);
  EXPECT_NEAR(x_ns(log, 0), 520e3, 1e3);
  EXPECT_LT(largest_residual_ns(log, 0), 1000.0);
  expect_followed(log, 500.0);
}

// Slewed at 10 ppm for a minute: what remains to be removed must not count as an offset.
TEST(RealLog, chrony_tracking_over_a_long_slew) {
  const RecordedLog log = read("chrony-tracking.log");
  EXPECT_EQ(log.format, "chrony tracking");
  ASSERT_GT(log.pairs.size(), 50U);
  EXPECT_NEAR(x_ns(log, 0), 564e3, 10e3);
  EXPECT_LT(largest_residual_ns(log, 0), 1000.0);
  expect_followed(log, 1000.0);
}

// Unsteered for four messages, then corrected as chrony sees it: no frequency to add.
TEST(RealLog, chrony_measurements_are_taken_as_they_stand) {
  const RecordedLog log = read("chrony-measurements.log");
  EXPECT_EQ(log.format, "chrony measurements");
  ASSERT_GT(log.pairs.size(), 50U);
  EXPECT_NEAR(x_ns(log, 0), 504e3, 5e3);
  EXPECT_LT(std::abs(x_ns(log, log.pairs.size() - 1)), 1000.0);
  EXPECT_NE(log.replay_notes.at(1).find("cannot be rebuilt"), std::string::npos);
}

}  // namespace
}  // namespace ftcs::experiment
