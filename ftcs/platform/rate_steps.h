// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ftcs::platform {

/// The rates that a clock can really run at lie `size` apart: it goes from one to the next where
/// the command passes `threshold` plus a whole number of sizes. Commands are deviations of the rate
/// from 1, dimensionless.
struct RateSteps {
  double size = 0.0;
  double threshold = 0.0;

  /// Known so far from the threshold: a size that is some percent wrong leads astray beyond it.
  static constexpr double kReach = 1e-6;

  /// The command in the middle of those that all make the same rate, which is the one that can be
  /// relied on; beyond kReach the command itself.
  [[nodiscard]] double nearest(double command) const noexcept;
};

/// Learns how coarse the rate of a clock is. A kernel takes a rate in units of 2^-16 ppm and does
/// not say what the adapter's register made of it: one of 24 bits has steps of 119 ppb, and a clock
/// that is 60 ppb off what it was told is a nanosecond off after 17 ms.
///
/// Each supposed pair of size and threshold is a model: by it the clock gains v + q(c) on a second
/// oscillator, where v is that of the two oscillators and q the difference between the rate it
/// would make of the command c and c. A filter of second order follows v with the same gains in
/// each model, and in one of a clock that keeps to its commands (q = 0). The model whose next
/// readings come as expected, on average far better than in the one without steps, is believed.
/// One with steps that is better by a fifth then replaces it.
/// Nothing is learnt from a clock that keeps to its commands, nor where the steps make less than
/// readings are uncertain by.
///
/// Sizes of 40 to 500 ppb, to 3 %: finer ones make less than a nanosecond of a tenth of a second.
class RateStepMeter {
 public:
  RateStepMeter();

  /// The clock showed `clock_ns` when the other oscillator showed `raw_ns`; since the last change
  /// it has been told `command`.
  void on_reading(double command, std::int64_t raw_ns, std::int64_t clock_ns) noexcept;
  /// From `raw_ns` on the clock is told something else than `command`. `doubt_ns`: when that was is
  /// uncertain, and so is what the clock shows since.
  void on_change(double command, std::int64_t raw_ns, double doubt_ns) noexcept;
  /// The clock was set: what it showed says nothing about what it shows now.
  void restart() noexcept;

  /// Of what is believed; size 0: that the clock keeps to its commands.
  [[nodiscard]] const RateSteps& steps() const noexcept { return models_[believed_].steps; }

 private:
  struct Model {
    RateSteps steps{};         ///< size 0: none
    double expected_ns = 0.0;  ///< what the clock should have gained by now
    double gain = 0.0;         ///< v
    double surprise_ns = 0.0;  ///< mean size of what it was off by
  };
  /// Readings that come together are one.
  struct Burst {
    int readings = 0;
    double first_ns = 0.0, sum_ns = 0.0, sum_gained_ns = 0.0;
  };

  void begin(double command, std::int64_t raw_ns, std::int64_t clock_ns) noexcept;
  void forget() noexcept;
  void advance(double command, double to_ns) noexcept;
  void correct(double command) noexcept;
  [[nodiscard]] double largest_error_ns(const Model& model) const noexcept;
  void note_surprise(Model& model, double error_ns) const noexcept;
  void choose() noexcept;

  std::vector<Model> models_;  ///< the first one without steps
  std::size_t believed_ = 0;
  bool begun_ = false;
  std::int64_t origin_raw_ns_ = 0, origin_clock_ns_ = 0;
  double centre_ = 0.0;      ///< the models' thresholds lie around this command
  double outside_ns_ = 0.0;  ///< so long has the command been away from it
  double now_ns_ = 0.0;      ///< since the origin: what the models expect is meant for now
  double usual_ = 0.0;       ///< mean of the commands of about a second
  double corrected_ns_ = 0.0;
  int corrections_ = 0;
  Burst burst_{};
};

}  // namespace ftcs::platform
