// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/servo/servo.h"

namespace ftcs {

/// When a forward message was sent and received: all that the next one is compared with.
struct SampleInstant {
  ReferenceTime origin;
  FreeRunningTime free_running;
};

[[nodiscard]] constexpr SampleInstant instant_of(const SyncSample& sample) noexcept {
  return {sample.origin, sample.free_running};
}

/// Elapsed time between two forward messages on both clocks, and whether it can be true.
struct SampleProgress {
  Duration reference{};     ///< tau_r(n) - tau_r(n-1), without the path delay
  Duration free_running{};  ///< the same span on the local oscillator
  SampleVerdict verdict = SampleVerdict::kUsed;

  /// k(n) a_l(n) of the paper's eq. 12 and 13: reference per free running. Only if verdict is
  /// kUsed.
  [[nodiscard]] Rate ratio() const noexcept {
    return Rate::from_ratio(reference.ns() / free_running.ns());
  }
};

/// What lies between two samples. kDuplicate: newer on neither clock (a repeated or a late
/// message). kImplausible: newer on one clock only, or at a ratio of rates outside `plausible` (one
/// of the clocks jumped). Differences are taken modulo 2^64 ns, so that a counter that wraps is no
/// event.
[[nodiscard]] inline SampleProgress progress_between(const SampleInstant& previous,
                                                     const SyncSample& sample,
                                                     const RateLimits& plausible) noexcept {
  SampleProgress progress{sample.origin - previous.origin,
                          sample.free_running - previous.free_running, SampleVerdict::kUsed};
  const bool newer_on_reference = progress.reference > Duration{};
  const bool newer_on_oscillator = progress.free_running > Duration{};
  if (!newer_on_reference && !newer_on_oscillator) {
    progress.verdict = SampleVerdict::kDuplicate;
  } else if (newer_on_reference != newer_on_oscillator || !plausible.contains(progress.ratio())) {
    progress.verdict = SampleVerdict::kImplausible;
  }
  return progress;
}
[[nodiscard]] inline SampleProgress progress_between(const SyncSample& previous,
                                                     const SyncSample& sample,
                                                     const RateLimits& plausible) noexcept {
  return progress_between(instant_of(previous), sample, plausible);
}

}  // namespace ftcs
