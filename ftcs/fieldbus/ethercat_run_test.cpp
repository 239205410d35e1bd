// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/ethercat_run.h"

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "ftcs/daemon/exit_code.h"
#include "test/support/good_cycle.h"

namespace ftcs::daemon {
namespace {

using diagnosis::CycleSeen;

// Whatever else was seen, a script that reads the code and a person who reads the sentence are told
// the same.
TEST(EthercatRun, exit_code_zero_and_the_word_locked_go_together) {
  for (unsigned bits = 0; bits < 1U << 9U; ++bits) {
    const auto chosen = [bits](unsigned n) { return (bits >> n & 1U) != 0; };
    CycleSeen seen = test::good_cycle();
    if (chosen(0)) seen.state = CycleState::kCoasting;
    if (chosen(1)) seen.failure = ethercat::FailureKind::kLinkLost;
    if (chosen(2)) seen.has_reference = false;
    if (chosen(3)) seen.lost = 200;
    if (chosen(4)) seen.late = 200;
    if (chosen(5)) seen.margin_ns = 20e3;
    if (chosen(6)) seen.working_counter = 21;
    if (chosen(7)) seen.operational = false;
    if (chosen(8)) seen.axes_in_fault = 1;
    std::array<char, 480> text{};
    const std::string sentence(diagnosis::write_sentence(text, seen));
    EXPECT_EQ(exit_code_of(seen) == kSuccess, sentence.starts_with("locked: ")) << sentence;
    EXPECT_EQ(exit_code_of(seen), bits == 0   ? kSuccess
                                  : chosen(1) ? kRuntimeError
                                              : kNotLocked)
        << sentence;
  }
}

// 0.1 s is the least that --unlocked-limit takes, and 1 s the longest cycle: no cycle at all, after
// which drives that never lost a lock would be stopped.
TEST(EthercatRun, is_not_begun_where_supervision_cannot_work) {
  RunOptions options;
  EXPECT_EQ(check_run(options), std::nullopt);
  options.servo.cycle = Nanoseconds{1'000'000'000};
  EXPECT_EQ(check_run(options), std::nullopt) << "a sample of plant time takes a cycle or more";
  options.unlocked_limit_s = 0.1;
  const auto wrong = check_run(options);
  ASSERT_TRUE(wrong);
  EXPECT_TRUE(wrong->starts_with("--unlocked-limit: ")) << *wrong;
  options.lock_policy = node::LockPolicy::kAdvisory;
  EXPECT_EQ(check_run(options), std::nullopt);
}

TEST(DriveSupervisionConfig, says_what_is_wrong_with_it) {
  using Error = node::SupervisionConfigError;
  node::DriveSupervisionConfig config;
  EXPECT_EQ(validate(config), std::nullopt);
  config.recovery_interval = 0;
  EXPECT_EQ(validate(config), Error::kRecoveryInterval);
  config.unlocked_limit = 0;
  EXPECT_EQ(validate(config), Error::kUnlockedLimit);
  EXPECT_NE(describe(Error::kUnlockedLimit), describe(Error::kRecoveryInterval));
}

}  // namespace
}  // namespace ftcs::daemon
