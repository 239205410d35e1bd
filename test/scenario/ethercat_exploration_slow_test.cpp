// SPDX-License-Identifier: MIT
// The world: lying_drive.h. Every path with two lies that are near each other.
#include "test/scenario/ethercat_exploration.h"

namespace ftcs::ethercat::test {
namespace {

class EthercatExploration : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Liar, EthercatExploration, ::testing::Bool());

using enum Lie::Kind;
constexpr std::array kOthers{kSilence, kNobody, kOneMore, kAllOnes, kDifference, kMailboxEmpty};

/// A state that is shown, and what may come in one of the next questions for it.
TEST_P(EthercatExploration, any_two_al_statuses_have_an_end) {
  constexpr std::size_t kNear = 3;
  const HonestLife honest(GetParam());
  Exploration exploration;
  const auto walk_second = [&](Lie first, unsigned at) {
    for (const std::uint16_t status : kStatuses) {
      const std::array lies{first, Lie{kAlStatus, status, 0x001B, at, 15}};
      exploration.walk(lies, GetParam());
    }
    for (const Lie::Kind kind : kOthers) {
      const std::array lies{first, Lie{kind, 0, 0, at, 15}};
      exploration.walk(lies, GetParam());
    }
  };
  for (std::size_t i = 0; i + kNear < honest.asking.size(); ++i) {
    for (const std::uint16_t status : kStatuses) {
      for (std::size_t j = i + 1; j <= i + kNear; ++j) {
        walk_second({kAlStatus, status, 0x001A, honest.asking[i], 1}, honest.asking[j]);
      }
      // Both states from here on, the second one after the first has had its effect.
      walk_second({kAlStatus, status, 0x001A, honest.asking[i], 15}, honest.asking[i] + 15);
    }
  }
  exploration.summarise("two AL statuses");
  EXPECT_GT(exploration.paths(), 10'000U);
}

TEST_P(EthercatExploration, any_two_wrong_frames_have_an_end) {
  constexpr unsigned kNear = 4;
  const HonestLife honest(GetParam());
  Exploration exploration;
  for (unsigned first = 0; first < honest.frames; ++first) {
    for (const Lie::Kind kind : kOthers) {
      for (const Lie::Kind other : kOthers) {
        for (unsigned after = 1; after <= kNear; ++after) {
          const std::array lies{Lie{kind, 0, 0, first, 1}, Lie{other, 0, 0, first + after, 6}};
          exploration.walk(lies, GetParam());
        }
      }
    }
  }
  exploration.summarise("two wrong frames");
  EXPECT_GT(exploration.paths(), 10'000U);
}

}  // namespace
}  // namespace ftcs::ethercat::test
