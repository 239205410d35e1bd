// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

namespace ftcs {

/// What a settling time is counted from. The choice is worth one sample: FTCS first acts on its
/// second sample (a rate needs two), PICS on its first.
enum class ConvergenceOrigin : std::uint8_t {
  kFirstMessage,  ///< the first sample fed
  kFirstAction,   ///< the sample at which the servo first changed the clock's rate
};

/// Settling of an offset record, by sample index. An index is absent when the thing never happened.
struct Convergence {
  std::uint64_t samples = 0;
  std::optional<std::uint64_t> first_action;
  /// First sample from which |offset| < band for ever, that is to the end of the record. Not absent
  /// only because the last sample lies in the band; `samples - settled` says how long that was.
  std::optional<std::uint64_t> settled;
  /// First sample of the first unbroken run of `dwell` samples in the band.
  std::optional<std::uint64_t> dwelt;

  /// settled - origin; 0 when the record was in the band before the origin. Absent if it never
  /// settled or the origin never came.
  [[nodiscard]] std::optional<std::uint64_t> cycles_to_converge(
      ConvergenceOrigin origin) const noexcept;
  /// The same for `dwelt`.
  [[nodiscard]] std::optional<std::uint64_t> cycles_to_dwell(
      ConvergenceOrigin origin) const noexcept;
};

/// Watches |offset| < band in constant memory. A missing offset (not a number) counts as outside
/// the band: what was not seen is not vouched for.
class ConvergenceTracker {
 public:
  /// band > 0 in the unit of the offsets (Section IV of the paper: 500 ns); dwell >= 1 samples.
  explicit ConvergenceTracker(double band, std::uint64_t dwell = 1) noexcept
      : band_(band), dwell_(dwell == 0 ? 1 : dwell) {}

  /// `acted`: at this sample the servo changed the clock's rate. Only the first one counts.
  void add(double offset, bool acted = false) noexcept {
    if (acted && !state_.first_action) state_.first_action = state_.samples;
    if (!(std::abs(offset) < band_)) {
      state_.settled.reset();
      run_ = 0;
    } else {
      if (run_ == 0) state_.settled = state_.samples;
      ++run_;
      if (run_ == dwell_ && !state_.dwelt) state_.dwelt = state_.settled;
    }
    ++state_.samples;
  }

  [[nodiscard]] const Convergence& result() const noexcept { return state_; }

 private:
  double band_;
  std::uint64_t dwell_;
  std::uint64_t run_ = 0;  // samples in the band since it was last left
  Convergence state_;
};

/// The tracker over a whole record; no action is known.
[[nodiscard]] Convergence find_convergence(std::span<const double> offsets, double band,
                                           std::uint64_t dwell = 1) noexcept;

}  // namespace ftcs
