// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/analysis/convergence.h"
#include "ftcs/clock/skewed_source.h"
#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"

namespace ftcs::experiment {

/// Where the reference truly is: known only because both clocks of a trial stand on one oscillator.
/// reference = underlying oscillator + offset.
struct TrueReference {
  Duration offset{};

  [[nodiscard]] ReferenceTime at(FreeRunningTime underlying) const noexcept {
    return ReferenceTime{underlying.since_epoch() + offset};
  }
};

/// The figures of one servo. Offsets and errors are local minus reference.
struct TrialResult {
  std::string servo;
  bool locked = false;
  /// Control intervals after the servo's first action until |true offset| stays inside the band for
  /// kLockDwell samples; absent if that never came.
  std::optional<std::uint64_t> cycles_to_lock;
  /// The first Sync of those samples, from 1: one origin for all servos, whenever each began to
  /// act.
  std::optional<std::uint64_t> locked_at_sync;
  std::uint64_t excursions = 0;  ///< times the true offset left the band after that
  double rms_perceived_offset_ns =
      0.0;  ///< at the sample instants, from lock to the end; noise included
  double rms_time_error_ns =
      0.0;  ///< true, kPointsPerInterval times an interval, from lock to the end
  double rate_error_ppb =
      0.0;  ///< RMS of the true rate error of the tracking rate, from lock to the end
  double final_time_error_ns = 0.0;
  std::uint64_t samples = 0;
  std::uint64_t rejected = 0;
  /// The true error over the second half of the run: the same messages whenever a servo locked.
  double rms_second_half_ns = 0.0;
  double mean_second_half_ns = 0.0;     ///< of the same error: what the path's asymmetry leaves
  std::vector<double> true_offsets_ns;  ///< at each sample
};

/// One servo on its own virtual clock, fed with the packets that all trials share, and judged by
/// the truth.
class ServoTrial {
 public:
  /// Samples in the band that count as locked.
  static constexpr std::uint64_t kLockDwell = 8;
  /// The true error is taken between the samples too: a servo that only looks right when asked is
  /// found out.
  static constexpr int kPointsPerInterval = 8;

  struct Setup {
    std::string name;
    DisciplineConfig discipline;
    VirtualClockConfig clock;
    TrueReference truth;
  };

  /// The source must outlive the trial.
  ServoTrial(const Setup& setup, SkewedSource& source);
  ServoTrial(const ServoTrial&) = delete;
  ServoTrial& operator=(const ServoTrial&) = delete;

  void on_pair(const EventPair& pair);
  void on_new_reference() noexcept { discipline_.on_new_reference(); }

  [[nodiscard]] const std::string& name() const noexcept { return setup_.name; }
  [[nodiscard]] const Telemetry& latest() const noexcept { return discipline_.latest(); }
  [[nodiscard]] std::vector<double> const& true_offsets_ns() const noexcept {
    return true_at_samples_;
  }
  [[nodiscard]] TrialResult result(double lock_band_ns) const;

 private:
  [[nodiscard]] double true_offset_ns(FreeRunningTime underlying) const noexcept;
  void record_truth_since_last(FreeRunningTime underlying);

  Setup setup_;
  SkewedSource& source_;
  VirtualClock clock_;
  ClockDiscipline discipline_;
  std::optional<FreeRunningTime> last_sample_;
  std::optional<std::uint64_t> first_action_;
  // Index n of each: the n-th forward message. true_between_ has kPointsPerInterval values for
  // each.
  std::vector<double> perceived_;
  std::vector<double> true_at_samples_;
  std::vector<double> true_between_;
  std::vector<double> rate_error_ppb_;
};

}  // namespace ftcs::experiment
