// SPDX-License-Identifier: MIT
// The world: lying_drive.h. Every path with one lie: whatever the one drive answers in any frame,
// once, for some frames or for ever, no state of the bring-up, of the cycles or of the way down is
// without an end.
#include "test/scenario/ethercat_exploration.h"

namespace ftcs::ethercat::test {
namespace {

class EthercatExploration : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Liar, EthercatExploration, ::testing::Bool());

TEST_P(EthercatExploration, an_honest_life_leads_to_op_on_a_host_that_is_exact_to_the_nanosecond) {
  LyingDrive world({}, GetParam());
  EXPECT_LT(world.bring_up(), 300U);
  world.go_on(100);
  EXPECT_TRUE(world.all_in_op());
}

TEST_P(EthercatExploration, any_al_status_at_any_time_has_an_end) {
  const HonestLife honest(GetParam());
  Exploration exploration;
  for (const unsigned first : honest.asking) {
    for (const std::uint16_t status : kStatuses) {
      for (const unsigned count : {1U, 15U, Lie::kForEver}) {
        const Lie lie{Lie::Kind::kAlStatus, status, 0x001A, first, count};
        exploration.walk(std::span{&lie, 1}, GetParam());
      }
    }
  }
  exploration.summarise("one AL status");
  EXPECT_GT(exploration.paths(), 1000U);
}

TEST_P(EthercatExploration, silence_and_wrong_counters_in_any_frame_have_an_end) {
  using enum Lie::Kind;
  const HonestLife honest(GetParam());
  Exploration exploration;
  for (unsigned first = 0; first < honest.frames; ++first) {
    for (const Lie::Kind kind :
         {kSilence, kNobody, kOneMore, kAllOnes, kDifference, kMailboxEmpty}) {
      for (const unsigned count : {1U, Lie::kForEver}) {
        const Lie lie{kind, 0, 0, first, count};
        exploration.walk(std::span{&lie, 1}, GetParam());
      }
    }
  }
  exploration.summarise("one wrong frame");
}

TEST_P(EthercatExploration, every_al_status_code_of_a_refusal_is_told) {
  const HonestLife honest(GetParam());
  for (unsigned code = 0; code <= 0xFFFF; code += code < 0x100 ? 1 : 0xFF) {
    for (const unsigned first : honest.asking) {
      if (first < 10 || first >= honest.bring_up) continue;  // behind the scan's own
      const Lie lie{Lie::Kind::kAlStatus, 0x11, static_cast<std::uint16_t>(code), first,
                    Lie::kForEver};
      LyingDrive world(std::span{&lie, 1}, GetParam());
      world.bring_up();
      const Failure& failure = world.node().main().failure();
      EXPECT_EQ(failure.kind, FailureKind::kStateRefused) << first;
      EXPECT_EQ(static_cast<unsigned>(failure.code), code);
    }
  }
}

}  // namespace
}  // namespace ftcs::ethercat::test
