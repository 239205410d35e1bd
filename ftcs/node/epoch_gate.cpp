// SPDX-License-Identifier: MIT
#include "ftcs/node/epoch_gate.h"

#include "ftcs/time/duration.h"

namespace ftcs::node {
namespace {

/// So long after it was built a program may still be the one that sets a clock for the first time.
constexpr std::int64_t kLongestUseS = 20LL * 365 * 86'400;
/// More than the rates of two crystals, or of a kernel's clock and its reference, differ by.
constexpr double kLargestDrift = 500e-6;

}  // namespace

EpochVerdict EpochGate::judge(ReferenceTime reference, Duration ahead_of_utc,
                              const Witnesses& witnesses) noexcept {
  const Reading reading{reference, witnesses.machine};
  if (!first_) {
    const std::int64_t utc_ns = (reference.since_epoch() - ahead_of_utc).floor_ns();
    const EpochVerdict verdict = judge_first(utc_ns, witnesses.system_utc_ns);
    if (verdict == EpochVerdict::kPlausible) first_ = last_ = reading;
    return verdict;
  }
  if (is_off(reading, last_, rules_.largest_change)) return EpochVerdict::kJumped;
  if (is_off(reading, *first_, rules_.largest_total_change)) return EpochVerdict::kWandered;
  last_ = reading;
  return EpochVerdict::kPlausible;
}

EpochVerdict EpochGate::judge_first(std::int64_t utc_ns, std::int64_t system_ns) noexcept {
  if (rules_.any_epoch) return EpochVerdict::kPlausible;
  excess_ = Duration::from_whole_ns(utc_ns) - Duration::from_whole_ns(system_ns);
  const std::int64_t utc_s = utc_ns / kNsPerSecond;
  if (utc_s < rules_.earliest_utc_s) return EpochVerdict::kTooEarly;
  if (system_ns / kNsPerSecond < rules_.earliest_utc_s) {
    return utc_s <= rules_.earliest_utc_s + kLongestUseS ? EpochVerdict::kPlausible
                                                         : EpochVerdict::kFarFromSystem;
  }
  const Duration limit{rules_.largest_first_change};
  return limit > Duration{} && abs(excess_) > limit ? EpochVerdict::kFarFromSystem
                                                    : EpochVerdict::kPlausible;
}

bool EpochGate::is_off(const Reading& reading, const Reading& since, Nanoseconds limit) noexcept {
  if (limit <= Nanoseconds{0}) return false;
  const Duration elapsed = reading.machine - since.machine;
  const Duration excess = (reading.reference - since.reference) - elapsed;
  const Duration allowed = Duration{limit} + Duration::from_ns(kLargestDrift * abs(elapsed).ns());
  if (abs(excess) <= allowed) return false;
  excess_ = excess;
  return true;
}

}  // namespace ftcs::node
