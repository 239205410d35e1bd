// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include "ftcs/measurement/sample_interval.h"
#include "ftcs/servo/converged_band.h"
#include "ftcs/servo/sample_progress.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"

namespace ftcs {

/// Parameters of the frequency-tracking clock servo; the names in brackets are the paper's. The
/// defaults and their reasons: docs/decisions/0010.
struct FtcsConfig {
  /// [T_sync] Interval between samples in reference time. Zero: measured, sample by sample.
  Nanoseconds sync_interval{0};
  /// [T_c] Time in which the offset is removed, 0 < T_c <= T_sync (eq. 17). Zero: T_sync (eq. 18).
  /// Beside a measured interval the upper bound is not checked: a longer T_c is replaced by the
  /// next command before it has done its work.
  Nanoseconds correction_time{0};
  /// [p] Part of the offset removed in one interval once converged (eq. 19): 1 is quickest and
  /// noisiest, 0 tracks the frequency only. With noise sigma of one timestamp and random-walk FM of
  /// b per interval the true error has the variance sigma^2 (2 + 3p)/(2 - p) + b^2/(p (2 - p)):
  /// 1.06 sigma at 1/16, 2.24 sigma at 1.
  double offset_gain = 1.0 / 16.0;
  /// [B] Inside the band p is offset_gain (eq. 19), outside it is 1 (eq. 18). A band below a few
  /// sigma is never entered for long, and p stays 1.
  ConvergedBand converged_band{};
  /// ["after some time"] Consecutive samples inside the band, after the first action, before eq. 19
  /// applies; the first action is by eq. 18. Zero: eq. 19 may apply from the first action on.
  std::uint32_t converged_dwell = 1;
  /// [F] Limits of the local rate, local per free running. A command beyond is cut; as long as the
  /// first action is cut, the next one is by eq. 18 again.
  RateLimits limits{};
  /// A measured ratio outside is a jump of one of the clocks, not a frequency: it never steers.
  RateLimits plausible_ratio{};
};

/// The first thing that is wrong, in the order of the fields: kSyncInterval, kCorrectionTime,
/// kOffsetGain (not in [0, 1], or not a number), kConvergedBand, kRateLimits, kPlausibleRatio. No
/// value: the servo can be made.
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
///
///     FtcsServo servo({.sync_interval = 1s, .offset_gain = 1.0});
///     const ServoUpdate update = servo.update({t1, path_delay, t2_local, t2_free}, clock.read());
///     if (update.has_command && !clock.apply(update.command)) ...   // the clock did not take it
///
/// The clock is exact after one interval where k(n) is (p = 1, no noise, constant rates): the
/// convergence in one synchronizing cycle of Section III-A. Noise: eq. (24).
class FtcsServo {
 public:
  using Config = FtcsConfig;

  /// Valid: validate(config) finds nothing; it is not asked here.
  explicit FtcsServo(const FtcsConfig& config = {}) noexcept : config_(config) {}

  /// One forward message; `now`: the clock when the command will take effect, not before the
  /// sample. Constant work, a few divisions.
  ///
  /// kUsed: a command, but for the first sample, which there is nothing to compare with.
  /// kDuplicate: newer on neither clock; nothing has changed. kImplausible: newer on one clock
  /// alone, or at a ratio outside plausible_ratio. Which of the two samples is wrong cannot be
  /// known: all is begun anew from this one, and the next good one commands as the first did.
  ///
  /// A command that comes later than T_c / 2 after its sample takes T_c / 2 all the same, so that
  /// the part of the rate that removes the offset never exceeds twice that of a prompt command.
  ServoUpdate update(const SyncSample& sample, const ClockReading& now) noexcept;
  /// Takes a first sample without acting: k(n) needs no path delay, so that a message from before
  /// the delay was known still counts. No effect unless the servo is empty.
  void prime(const SyncSample& sample) noexcept;
  /// Everything measured is void: the next command comes with the second sample and uses p = 1
  /// (converged_dwell 0: the p of the band).
  void reset() noexcept;
  /// As of the last sample: the perceived offset, the path delay it was given, k(n) a_l(n) as
  /// rate_ratio, and the p of the last command. No deviations: the law does not know its noise.
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return snapshot_; }

 private:
  enum class Phase : std::uint8_t { kEmpty, kPrimed, kActing };
  struct State {
    Phase phase = Phase::kEmpty;
    SampleInstant previous{};
    SampleInterval interval{};
    ConvergenceLatch converged{};
  };

  [[nodiscard]] Duration sync_interval() const noexcept;
  [[nodiscard]] double gain_for(double offset_ns) noexcept;
  [[nodiscard]] ServoUpdate steer(const SyncSample& sample, const ClockReading& now,
                                  const SampleProgress& progress) noexcept;

  FtcsConfig config_;
  State state_{};
  ServoSnapshot snapshot_{};
};

static_assert(ControlLaw<FtcsServo>);

}  // namespace ftcs
