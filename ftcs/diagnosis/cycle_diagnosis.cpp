// SPDX-License-Identifier: MIT
#include "ftcs/diagnosis/cycle_diagnosis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

namespace ftcs::diagnosis {
namespace {

using ethercat::FailureKind;

/// What should have been, and what mends it.
struct Advice {
  Cause cause;
  std::string_view expected;
  std::string_view remedy;
};

constexpr std::array kAdvice{
    Advice{
        Cause::kNoSubDevice, "an answer of a SubDevice",
        "is one with power connected to -i INTERFACE, or does ftcs ethercat-segment run at --udp?"},
    Advice{Cause::kTooFewSubDevices, "all that --drives names",
           "look at cables and power behind the last one, or lower --drives"},
    Advice{Cause::kNoDistributedClock, "a drive with a distributed clock",
           "drives that need none run without (--servo none), and nothing is in phase with them"},
    Advice{Cause::kLostFrames, "each frame back within its cycle",
           "a network of its own for the drives, a longer --cycle"},
    Advice{Cause::kWorkingCounter, "every drive's share of it",
           "a drive is out of reach or not in SAFEOP or OP: ftcs ethercat scan"},
    Advice{Cause::kHostLate, "the host awake in time for each cycle",
           "--priority 80 with the right to it (CAP_SYS_NICE), an idle processor (--cpu), a "
           "PREEMPT_RT kernel, --spin, or a longer --cycle and --gate"},
    Advice{Cause::kMarginTooSmall, "the frame at the drives well before SYNC0",
           "--sync0-phase nearer to 0.5, a longer --cycle, or a host that is less late"},
    Advice{Cause::kDrivesNotOperational, "all drives in OP",
           "the lines of the log tell which drive and its AL status code"},
    Advice{Cause::kAxisFault, "axes that obey",
           "object 0x603F of that drive tells why; --reset-faults 1 resets it once"},
};

Advice advice(Cause cause) noexcept {
  const auto* const found = std::find_if(kAdvice.begin(), kAdvice.end(),
                                         [cause](const Advice& one) { return one.cause == cause; });
  return found == kAdvice.end() ? Advice{cause, "", ""} : *found;
}

/// The frame came just too late for its SYNC0: the next one, that the margin is of, is a cycle
/// away.
bool is_after_sync0(const CycleSeen& seen) noexcept { return seen.margin_ns > seen.cycle_ns / 2; }

/// Between the frame and the SYNC0 that it is nearer to.
double distance_ns(const CycleSeen& seen) noexcept {
  return is_after_sync0(seen) ? seen.cycle_ns - seen.margin_ns : seen.margin_ns;
}

/// Writes what was seen, up to the room there is.
std::size_t write_seen(std::span<char> text, Cause cause, const CycleSeen& seen) {
  const auto write = [&](auto... arguments) {
    return std::min(fmt::format_to_n(text.data(), text.size(), arguments...).size, text.size());
  };
  switch (cause) {
    case Cause::kNoSubDevice:
      return write(FMT_STRING("no SubDevice answers"));
    case Cause::kTooFewSubDevices:
      return write(FMT_STRING("{} SubDevices of {}"), seen.drives, seen.expected_drives);
    case Cause::kNoDistributedClock:
      return write(FMT_STRING("none of {} SubDevices has a distributed clock"), seen.drives);
    case Cause::kLostFrames:
      return write(FMT_STRING("{} of the last {} frames were lost"), seen.lost, seen.cycles);
    case Cause::kWorkingCounter:
      return write(FMT_STRING("working counter {} of {}"), seen.working_counter,
                   seen.expected_counter);
    case Cause::kHostLate:
      return write(FMT_STRING("{} of the last {} cycles began more than {:.0f} us late"), seen.late,
                   seen.cycles, seen.gate_ns * 1e-3);
    case Cause::kMarginTooSmall:
      return write(FMT_STRING("frames arrive {:.1f} us {} SYNC0, cycle {:.0f} us"),
                   distance_ns(seen) * 1e-3, is_after_sync0(seen) ? "after" : "before",
                   seen.cycle_ns * 1e-3);
    case Cause::kDrivesNotOperational:
      return write(FMT_STRING("a drive is not in OP, working counter {} of {}"),
                   seen.working_counter, seen.expected_counter);
    case Cause::kAxisFault:
      return write(FMT_STRING("{} of {} axes in Fault (CiA 402), the first is that of drive {}"),
                   seen.axes_in_fault, seen.drives, seen.first_in_fault);
    case Cause::kOther:
      return write(FMT_STRING("{}"), ethercat::name(seen.failure));
    default:
      return write(FMT_STRING("phase {:+.3f} us, margin {:.1f} us, working counter {} of {}"),
                   seen.phase_ns * 1e-3, seen.margin_ns * 1e-3, seen.working_counter,
                   seen.expected_counter);
  }
}

Cause cause_of_failure(const CycleSeen& seen) noexcept {
  switch (seen.failure) {
    case FailureKind::kNoReply:
    case FailureKind::kNoSubDevices:
      return Cause::kNoSubDevice;
    case FailureKind::kFewerThanConfigured:
      return Cause::kTooFewSubDevices;
    case FailureKind::kNoDistributedClock:
      return Cause::kNoDistributedClock;
    case FailureKind::kWorkingCounter:
      return Cause::kWorkingCounter;
    case FailureKind::kLinkLost:
      return Cause::kLostFrames;
    default:  // a drive that needs a clock and has none refuses SAFEOP
      return seen.has_reference || seen.drives == 0 ? Cause::kOther : Cause::kNoDistributedClock;
  }
}

/// Whether the frame comes so near to SYNC0 that jitter decides which SYNC0 it is in time for.
bool is_narrow(const CycleSeen& seen) noexcept {
  constexpr double kShare = 0.05;
  return !std::isnan(seen.margin_ns) && distance_ns(seen) < kShare * seen.cycle_ns;
}

/// More than one in ten is no accident.
bool is_often(std::uint64_t count, std::uint64_t cycles) noexcept {
  constexpr std::uint64_t kOneIn = 10;
  return cycles > 0 && count * kOneIn > cycles;
}

std::string_view beginning(Cause cause, CycleState state) noexcept {
  if (state != CycleState::kLocked) return "not locked: ";
  return cause == Cause::kLocked ? "locked: " : "in phase, but ";
}

}  // namespace

Cause cause_of(const CycleSeen& seen) noexcept {
  if (seen.failure != FailureKind::kNone) return cause_of_failure(seen);
  if (seen.drives < seen.expected_drives) return Cause::kTooFewSubDevices;
  if (!seen.has_reference) return Cause::kNoDistributedClock;
  if (is_often(seen.lost, seen.cycles)) return Cause::kLostFrames;
  if (seen.working_counter < seen.expected_counter) return Cause::kWorkingCounter;
  if (is_often(seen.late, seen.cycles)) return Cause::kHostLate;
  if (is_narrow(seen)) return Cause::kMarginTooSmall;
  if (seen.state != CycleState::kLocked) return Cause::kAcquiring;
  if (!seen.operational) return Cause::kDrivesNotOperational;
  return seen.axes_in_fault > 0 ? Cause::kAxisFault : Cause::kLocked;
}

std::string_view write_sentence(std::span<char> text, const CycleSeen& seen) {
  const Cause cause = cause_of(seen);
  const std::string_view begin = beginning(cause, seen.state);
  std::size_t used = std::min(begin.size(), text.size());
  std::copy_n(begin.begin(), used, text.begin());
  used += write_seen(text.subspan(used), cause, seen);
  const auto add = [&](std::string_view before, std::string_view part) {
    if (part.empty()) return;
    for (const std::string_view piece : {before, part}) {
      const std::size_t size = std::min(piece.size(), text.size() - used);
      std::copy_n(piece.begin(), size, text.begin() + static_cast<std::ptrdiff_t>(used));
      used += size;
    }
  };
  add("; expected ", advice(cause).expected);
  add("; ", advice(cause).remedy);
  return {text.data(), used};
}

Finding diagnose(const CycleSeen& seen) {
  const Cause cause = cause_of(seen);
  std::array<char, 200> text{};
  const std::size_t size = write_seen(text, cause, seen);
  const Advice found = advice(cause);
  return {cause, std::string(text.data(), size), std::string(found.expected),
          std::string(found.remedy)};
}

}  // namespace ftcs::diagnosis
