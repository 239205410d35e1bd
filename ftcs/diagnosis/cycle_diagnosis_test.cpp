// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/cycle_diagnosis.h"

#include <array>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "test/support/forbid_allocation.h"
#include "test/support/good_cycle.h"

namespace ftcs::diagnosis {
namespace {

struct Case {
  Cause cause;
  std::function<void(CycleSeen&)> change;
  const char* part;
};

const std::array kCases{
    Case{Cause::kLocked, [](CycleSeen&) {}, "locked: phase"},
    Case{Cause::kNoSubDevice, [](CycleSeen& s) { s.failure = ethercat::FailureKind::kNoReply; },
         "no SubDevice answers"},
    Case{Cause::kTooFewSubDevices, [](CycleSeen& s) { s.drives = 5; }, "5 SubDevices of 8"},
    Case{Cause::kNoDistributedClock, [](CycleSeen& s) { s.has_reference = false; }, "--servo none"},
    Case{Cause::kNoDistributedClock,
         [](CycleSeen& s) {
           s.has_reference = false;
           s.failure = ethercat::FailureKind::kStateRefused;
         },
         "none of 8 SubDevices"},
    Case{Cause::kLostFrames, [](CycleSeen& s) { s.lost = 200; }, "200 of the last 1000 frames"},
    Case{Cause::kWorkingCounter, [](CycleSeen& s) { s.working_counter = 21; }, "21 of 24"},
    Case{Cause::kHostLate, [](CycleSeen& s) { s.late = 300; }, "more than 200 us late"},
    Case{Cause::kMarginTooSmall, [](CycleSeen& s) { s.margin_ns = 20e3; }, "20.0 us before SYNC0"},
    Case{Cause::kMarginTooSmall, [](CycleSeen& s) { s.margin_ns = s.cycle_ns - 20e3; },
         "20.0 us after SYNC0, cycle"},
    Case{Cause::kOther, [](CycleSeen& s) { s.failure = ethercat::FailureKind::kInOperation; },
         ethercat::name(ethercat::FailureKind::kInOperation)},
    Case{Cause::kAcquiring, [](CycleSeen& s) { s.state = CycleState::kAcquiring; }, "phase"},
    Case{Cause::kAxisFault,
         [](CycleSeen& s) {
           s.axes_in_fault = 2;
           s.first_in_fault = 3;
         },
         "2 of 8 axes in Fault (CiA 402), the first is that of drive 3"},
    Case{Cause::kDrivesNotOperational, [](CycleSeen& s) { s.operational = false; }, "AL status"},
};

TEST(CycleDiagnosis, each_cause_has_its_sentence) {
  for (const Case& one : kCases) {
    CycleSeen seen = test::good_cycle();
    one.change(seen);
    const Finding found = diagnose(seen);
    EXPECT_EQ(name(found.cause), name(one.cause));
    std::array<char, 400> text{};
    const std::string written(write_sentence(text, seen));
    EXPECT_NE(written.find(one.part), std::string::npos) << written;
    EXPECT_NE(written.find(found.seen), std::string::npos) << written;
  }
}

TEST(CycleDiagnosis, only_a_locked_cycle_is_called_locked) {
  for (const CycleState state :
       {CycleState::kWaiting, CycleState::kAcquiring, CycleState::kCoasting}) {
    for (const Case& one : kCases) {
      CycleSeen seen = test::good_cycle();
      one.change(seen);
      seen.state = state;
      std::array<char, 400> text{};
      EXPECT_TRUE(write_sentence(text, seen).starts_with("not locked: "));
    }
  }
}

TEST(CycleDiagnosis, a_locked_cycle_with_a_cause_is_not_called_locked) {
  for (const Case& one : kCases) {
    CycleSeen seen = test::good_cycle();
    one.change(seen);
    if (seen.state != CycleState::kLocked) continue;
    std::array<char, 400> text{};
    const std::string written(write_sentence(text, seen));
    EXPECT_EQ(written.find("locked") != std::string::npos, one.cause == Cause::kLocked) << written;
  }
}

TEST(CycleDiagnosis, the_cyclic_path_touches_no_heap_and_no_more_than_its_room) {
  std::array<char, 40> text{};
  CycleSeen seen = test::good_cycle();
  seen.late = 500;
  std::string_view written;
  {
    const test::ForbidAllocation none;
    written = write_sentence(text, seen);
  }
  EXPECT_LE(written.size(), text.size());
  EXPECT_TRUE(written.starts_with("in phase, but 500 of"));
}

}  // namespace
}  // namespace ftcs::diagnosis
