// SPDX-License-Identifier: MIT
#include "ftcs/daemon/kept_state.h"

#include <filesystem>
#include <sys/stat.h>

#include <gtest/gtest.h>

namespace ftcs::daemon {
namespace {

constexpr std::int64_t kSavedAt = 1'700'000'000;
constexpr std::int64_t kDay = 86'400;
const KeptState kState{"eth0, software timestamps, skew 0 ppb", kSavedAt, {12.5e-6, 3e-7, 80.0}};

std::string objection(std::string_view text, std::int64_t now = kSavedAt + 10,
                      std::string_view clock = kState.clock) {
  const auto state = read_kept_state(text, clock, now);
  return state ? "" : state.error();
}

ServoSnapshot good_snapshot() {
  ServoSnapshot snapshot;
  snapshot.state = ServoState::kLocked;
  snapshot.rate_ratio = Rate::from_ratio(1.0 / (1.0 + 10e-6));
  snapshot.rate_sigma_ppb = 300.0;
  snapshot.timestamp_noise_ns = 80.0;
  return snapshot;
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(KeptState, comes_back_as_it_was) {
  const auto state = read_kept_state(to_text(kState), kState.clock, kSavedAt + kDay);
  ASSERT_TRUE(state.ok());
  EXPECT_DOUBLE_EQ(state->rate_deviation, 12.5e-6);
  EXPECT_DOUBLE_EQ(state->rate_sigma, 3e-7);
  EXPECT_DOUBLE_EQ(state->timestamp_noise_ns, 80.0);
}

// A servo that ran for a day knows its rate to 1e-12; the crystal does not come back to that.
TEST(KeptState, no_crystal_is_believed_better_than_a_fifth_of_a_ppm) {
  KeptState state = kState;
  state.learnt.rate_sigma = 1e-12;
  EXPECT_DOUBLE_EQ(read_kept_state(to_text(state), state.clock, kSavedAt)->rate_sigma, 2e-7);
}

TEST(KeptState, broken_files_are_refused) {
  const std::string text = to_text(kState);
  for (std::size_t length = 0; length + 2 < text.size(); ++length)
    EXPECT_EQ(objection(text.substr(0, length)), "it is broken") << length;
  EXPECT_EQ(objection("[1, 2]"), "it is broken");
  EXPECT_EQ(objection(with(text, "12500.0", "\"fast\"")), "it is broken");
  EXPECT_EQ(objection(std::string(1000, '\0')), "it is broken");
}

TEST(KeptState, other_clocks_versions_and_ages_are_refused_with_the_reason) {
  const std::string text = to_text(kState);
  EXPECT_EQ(objection(with(text, "\"ftcs_state\": 1", "\"ftcs_state\": 2")),
            "it has format 2, this program knows 1");
  EXPECT_EQ(objection(text, kSavedAt, "eth1, hardware timestamps, skew 0 ppb"),
            "it is of another clock (eth0, software timestamps, skew 0 ppb), this is eth1, "
            "hardware timestamps, skew 0 ppb");
  EXPECT_EQ(objection(text, kSavedAt + 91 * kDay), "it is 91 days old");
  EXPECT_EQ(objection(with(text, "12500.0", "-6e8")), "its figures are impossible");
  EXPECT_EQ(objection(with(text, "80.0", "0.0")), "its figures are impossible");
}

TEST(KeptState, rates_that_no_crystal_has_and_impossible_dates_are_refused) {
  const std::string text = to_text(kState);
  EXPECT_EQ(objection(with(text, "12500.0", "1.1e6")), "its figures are impossible");
  EXPECT_EQ(objection(with(text, "12500.0", "-490000000.0")), "its figures are impossible");
  EXPECT_EQ(objection(with(text, "1700000000", "-9223372036854775808")), "its date is impossible");
  EXPECT_EQ(objection(with(text, "1700000000", "9223372036854775807")), "its date is impossible");
}

TEST(StateKeeper, what_is_no_regular_file_is_neither_read_nor_replaced) {
  platform::LinuxKernel kernel;
  Log log(kernel, stdout, 0);
  const std::string path = testing::TempDir() + "ftcs_kept_state_pipe";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  {
    StateKeeper keeper(log, path, Duration{}, "a");  // would wait for a writer
    keeper.note(good_snapshot(), FreeRunningTime::from_ns(1));
    keeper.save();
  }
  EXPECT_TRUE(std::filesystem::is_fifo(path));
  std::filesystem::remove(path);
}

TEST(StateKeeper, writes_beside_the_loop_and_whole) {
  platform::LinuxKernel kernel;
  Log log(kernel, stdout, 0);
  const std::string path = testing::TempDir() + "ftcs_kept_state";
  std::filesystem::remove(path);
  {
    StateKeeper keeper(log, path, Duration::from_ns(1e9), "a");
    for (int i = 0; i < 100; ++i) {
      keeper.note(good_snapshot(), FreeRunningTime::from_ns(std::int64_t{i} * 1'000'000'000));
    }
  }
  StateKeeper again(log, path, Duration{}, "a");
  ASSERT_TRUE(again.learnt().has_value());
  EXPECT_NEAR(again.learnt()->rate_deviation, 10e-6, 1e-9);
  std::filesystem::remove(path);
}

// The machine's own clock may have been wrong when it was written.
TEST(KeptState, a_state_from_the_future_is_used) {
  EXPECT_EQ(objection(to_text(kState), kSavedAt - 1000 * kDay), "");
}

}  // namespace
}  // namespace ftcs::daemon
