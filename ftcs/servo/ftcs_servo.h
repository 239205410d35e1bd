// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/servo/converged_band.h"
#include "ftcs/servo/sample_progress.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

/// Parameters of the frequency-tracking clock servo; the names in brackets are the paper's.
struct FtcsConfig {
  /// [T_sync] Interval between samples in reference time. Zero: measured, sample by sample.
  Nanoseconds sync_interval{0};
  /// [T_c] Time in which the offset is removed, 0 < T_c <= T_sync (eq. 17). Zero: T_sync (eq. 18).
  Nanoseconds correction_time{0};
  /// [p] Part of the offset removed in one interval once converged (eq. 19): 1 is quickest and
  /// noisiest, 0 tracks the frequency only. The default and its reasons: docs/decisions/0010.
  double offset_gain = 1.0 / 16.0;
  /// [B] Inside the band p is offset_gain (eq. 19), outside it is 1 (eq. 18).
  ConvergedBand converged_band{};
  /// ["after some time"] Consecutive samples inside the band, after the first action, before eq. 19
  /// applies; the first action is by eq. 18. Zero: eq. 19 may apply from the first action on.
  std::uint32_t converged_dwell = 1;
  /// [F] Limits of the local rate, local per free running.
  RateLimits limits{};
  /// A measured ratio outside is a jump of one of the clocks, not a frequency: it never steers.
  RateLimits plausible_ratio{};
};

[[nodiscard]] std::optional<ServoConfigError> validate(const FtcsConfig& config) noexcept;

/// The frequency-tracking clock servo of Chen et al., IEEE Access 5 (2017), Section III and Table
/// 1:
///
///     k(n) = (tau_r(n) - tau_r(n-1)) / (tau_l(n) - tau_l(n-1))                    (12)
///     a_l(n+1) = (1 + p T_offset / T_c) k(n) a_l(n)   for T_c, then k(n) a_l(n)   (17), (19)
///     p = 1 outside the converged band (18), offset_gain inside (19); a_l limited to F.
///
/// k a is formed as reference per *free-running* time: that is k(n) times the mean rate which was
/// really applied between the samples, whatever was commanded in the meantime. Both ends use one
/// path delay (eq. 10 with d_rl unchanged), so that it cancels. T_offset = -offset, projected from
/// the sample to the moment at which the command takes effect, and the correction ends T_c after
/// the sample (Fig. 3), not after the command; without latency this is the paper to the letter. The
/// first command comes with the second sample; after an outage of more than four intervals it is
/// eq. (18) again. Never steps.
class FtcsServo {
 public:
  using Config = FtcsConfig;

  explicit FtcsServo(const FtcsConfig& config = {}) noexcept : config_(config) {}

  ServoUpdate update(const SyncSample& sample, const ClockReading& now) noexcept;
  /// Takes a first sample without acting: k(n) needs no path delay, so that a message from before
  /// the delay was known still counts. No effect unless the servo is empty.
  void prime(const SyncSample& sample) noexcept;
  /// Everything measured is void: the next command comes with the second sample and uses p = 1.
  void reset() noexcept;
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  enum class Phase : std::uint8_t { kEmpty, kPrimed, kActing };
  struct State {
    Phase phase = Phase::kEmpty;
    SampleInstant previous{};
    Duration last_interval{};  ///< between the last two samples; zero: there were none
    ConvergenceLatch converged{};
  };

  [[nodiscard]] Duration sync_interval(const SampleProgress& progress) const noexcept;
  [[nodiscard]] double gain_for(double offset_ns) noexcept;
  [[nodiscard]] ServoUpdate steer(const SyncSample& sample, const ClockReading& now,
                                  const SampleProgress& progress) noexcept;

  FtcsConfig config_;
  State state_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<FtcsServo>);

}  // namespace ftcs
