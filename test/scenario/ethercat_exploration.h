// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/scenario/lying_drive.h"

namespace ftcs::ethercat::test {

/// Walks through lies, one path after another, and asks of each: the bring-up ends in time, by the
/// cycles or by a failure that has a name; once the drive is honest again all come to OP, or are
/// stopped for a reason; the way down ends in time, and nobody is left in OP.
class Exploration {
 public:
  static constexpr unsigned kLongestBringUp = 1'600;  ///< ms: its deadline, and the last retries
  static constexpr int kLongestWayBack = 4'000;       ///< cycles
  static constexpr int kLongestStop = 60;             ///< frames

  void walk(std::span<const Lie> lies, bool reference) {
    ++paths_;
    LyingDrive world(lies, reference);
    const unsigned took = world.bring_up();
    longest_bring_up_ = std::max(longest_bring_up_, took);
    EXPECT_LT(took, kLongestBringUp) << text(lies, reference);
    if (world.node().cyclic()) live(world, lies, reference);
    down(world, lies, reference);
  }
  void summarise(const char* title) const {
    std::printf("%s: %zu paths, longest bring-up %u ms, longest way to OP %d cycles, stop %d ms\n",
                title, paths_, longest_bring_up_, longest_way_back_, longest_stop_);
    for (const auto& [end, count] : ends_) std::printf("  %6zu %s\n", count, end.c_str());
  }
  [[nodiscard]] std::size_t paths() const { return paths_; }

 private:
  static bool for_ever(std::span<const Lie> lies) {
    return std::any_of(lies.begin(), lies.end(),
                       [](const Lie& lie) { return lie.count >= Lie::kForEver; });
  }
  void live(LyingDrive& world, std::span<const Lie> lies, bool reference) {
    if (for_ever(lies)) {
      world.go_on(600);
      ++ends_["lies for ever, then told to stop"];
      return;
    }
    unsigned honest_from = 0;
    for (const Lie& lie : lies) honest_from = std::max(honest_from, lie.first + lie.count);
    while (!world.node().stopped() && world.frames() < honest_from) world.go_on(1);
    int cycles = 0;
    do {  // the last lie is still in the last report
      world.go_on(10);
      cycles += 10;
    } while (!world.node().stopped() && !world.all_in_op() && cycles < kLongestWayBack);
    EXPECT_LT(cycles, kLongestWayBack) << text(lies, reference);
    longest_way_back_ = std::max(longest_way_back_, cycles);
    if (world.node().stopped()) return;
    ++ends_["all in OP"];
    for (std::size_t n = 0; n < world.segment().size(); ++n) {
      EXPECT_EQ(world.segment()[n].drive().state(), AlState::kOp) << text(lies, reference);
    }
  }
  void down(LyingDrive& world, std::span<const Lie> lies, bool reference) {
    const bool by_itself = world.node().stopped();
    world.stop();
    int frames = 0;
    for (; !world.node().stopped() && frames < kLongestStop; ++frames) world.go_on(1);
    EXPECT_TRUE(world.node().stopped()) << text(lies, reference);
    longest_stop_ = std::max(longest_stop_, frames);
    const Failure& failure = world.node().main().failure();
    if (by_itself) {
      EXPECT_TRUE(failure) << text(lies, reference);
      ++ends_[std::string("stopped: ") + name(failure.kind)];
    }
    EXPECT_STRNE(name(failure.kind), "unknown failure") << text(lies, reference);
    // Who cannot be heard may be in OP still: then it is told.
    for (std::size_t n = 0; n < world.segment().size(); ++n) {
      const bool in_op = world.segment()[n].drive().state() == AlState::kOp;
      EXPECT_TRUE(!in_op || !world.node().main().stop_confirmed() || for_ever(lies))
          << text(lies, reference);
    }
  }
  static std::string text(std::span<const Lie> lies, bool reference) {
    std::string result = reference ? "the reference" : "the other";
    for (const Lie& lie : lies) {
      result += ": kind " + std::to_string(static_cast<int>(lie.kind)) + " AL " +
                std::to_string(lie.al_status) + " code " + std::to_string(lie.al_code) +
                " from frame " + std::to_string(lie.first) + " for " + std::to_string(lie.count);
    }
    return result;
  }

  std::size_t paths_ = 0;
  unsigned longest_bring_up_ = 0;
  int longest_way_back_ = 0;
  int longest_stop_ = 0;
  std::map<std::string, std::size_t> ends_;
};

/// Frames of an honest life until the cycles begin, and which of them ask for the state.
struct HonestLife {
  unsigned bring_up = 0;
  unsigned frames = 0;  ///< until some cycles after OP
  std::vector<unsigned> asking;

  explicit HonestLife(bool reference) {
    LyingDrive world({}, reference);
    world.bring_up();
    bring_up = world.frames();
    for (int i = 0; i < 200 && !world.all_in_op(); ++i) world.go_on(1);
    world.go_on(4);
    frames = world.frames();
    for (unsigned n = 0; n < frames; ++n) {
      if (world.asked_for_state()[n]) asking.push_back(n);
    }
  }
};

/// What an AL status may show: every state and none of them, with and without the error.
inline const std::vector<std::uint16_t> kStatuses = [] {
  std::vector<std::uint16_t> result;
  for (std::uint16_t state = 0; state <= 15; ++state) {
    const bool is_one = state <= 4 || state == 8 || state == 15;
    if (!is_one) continue;
    result.push_back(state);
    result.push_back(static_cast<std::uint16_t>(state | 0x10));
  }
  return result;
}();

}  // namespace ftcs::ethercat::test
