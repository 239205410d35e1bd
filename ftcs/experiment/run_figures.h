// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <span>
#include <string_view>

namespace ftcs::experiment {

/// The figures of one run: one scenario, one servo, one seed. Not a number = does not apply;
/// infinite = never.
struct RunFigures {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double rms_time_error_ns = kNone;  ///< truth, over the measurement window
  double max_time_error_ns = kNone;  ///< max |TE| there
  double mean_time_error_ns = kNone;
  double rms_perceived_offset_ns = kNone;  ///< what the servo reports as offset, there
  double rms_first_ten_ns = kNone;  ///< truth, over ten cycles from one after the first command
  double c5_cycles = kNone;         ///< first Sync to the start of the first dwell inside the band
  double rate_error_ppb = kNone;    ///< RMS of the tracking rate against true time, there
  double event_cycles = kNone;  ///< event to the start of the first dwell inside the band after it
  double event_max_ns = kNone;  ///< max |TE| after the event
  double event_overshoot_ns =
      kNone;  ///< largest |TE| of the other sign than the first one after the event
  double within_1_sigma = kNone;  ///< share of estimates inside the reported deviation, there
  double within_2_sigma = kNone;
  double within_3_sigma = kNone;
  double steps = kNone;           ///< steps of the clock
  double backward_steps = kNone;  ///< of these, back in time
  double rejected = kNone;        ///< messages taken for outliers
  double holdovers = kNone;
};

/// A figure by its name in files: "rms_time_error".
struct FigureName {
  std::string_view name;  ///< in limits
  std::string_view json;  ///< in results
  double RunFigures::*figure;
  bool is_time;  ///< limits are times with a unit; otherwise plain numbers
};

[[nodiscard]] std::span<const FigureName> figure_names() noexcept;
[[nodiscard]] const FigureName* find_figure(std::string_view name) noexcept;

}  // namespace ftcs::experiment
