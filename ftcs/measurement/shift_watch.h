// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

namespace ftcs {

/// The chance of an outlier on one side, learnt. One that follows another is likelier where each
/// value is a median of the last few, as ptp4l's are.
class OutlierChance {
 public:
  /// That the next value is one; at least 0.005. It begins with a tenth.
  [[nodiscard]] constexpr double chance() const noexcept {
    return std::max({run_ > 0.0 ? again_ : 0.0, share_, kLeast});
  }
  constexpr void learn(bool outlier) noexcept {
    values_ = std::min(values_ + 1.0, kMemory);
    share_ += ((outlier ? 1.0 : 0.0) - share_) / values_;
    if (outlier) run_ = std::min(run_ + 1.0, kMemory);
    if (outlier || run_ == 0.0) return;
    runs_ = std::min(runs_ + run_, kMemory);
    again_ += (run_ - 1.0 - again_ * run_) / runs_;
    run_ = 0.0;
  }

 private:
  static constexpr double kMemory = 300.0;
  static constexpr double kLeast = 0.005;
  double share_ = 0.1;
  double values_ = 20.0;
  double run_ = 0.0;     ///< outliers in a row
  double again_ = 0.03;  ///< chance that another follows
  double runs_ = 10.0;   ///< outliers that this was learnt from
};

/// Whether values that should lie around a centre have moved to one side of it. Two tests, one for
/// jumps and one for small shifts; both reckon that nothing has changed for a million values and
/// more. Values count by side and distance alone, in units of `limit` (about one sigma):
///
///   run on one side, a sequential test (Wald, Ann. Math. Stat. 16, 1945), begun anew by a value on
///   the other: of outliers alone L := L c, c being their chance; of all values
///     L := L c / 0.5 for an outlier, L 0.16 / 0.4 beyond the limit, L 0.34 / 0.1 within
///   cumulative sum (Page, Biometrika 41, 1954): S := max(0, S + clamp(difference / limit) - 0.3)
class ShiftWatch {
 public:
  /// One value, as the caller's centre and limit see it.
  struct Value {
    double part = 0.0;  ///< of the limit, -1 to 1
    bool outlier = false;
    double late_chance = 0.0;  ///< of an outlier
    double early_chance = 0.0;
    double correlation = 1.0;  ///< values in a row that are worth one independent one
  };
  /// The longest run that is asked for.
  static constexpr int kLongestRun = 10;

  /// How many of the newest values contradict the centre; 0: none.
  [[nodiscard]] constexpr int add(const Value& value) noexcept {
    return std::max(late_.add(value, value.part, value.late_chance),
                    early_.add(value, -value.part, value.early_chance));
  }
  /// Neither side has gathered half of what an alarm takes.
  [[nodiscard]] constexpr bool calm() const noexcept {
    return std::max(late_.sum, early_.sum) < kAlarm / 2.0;
  }

 private:
  static constexpr int kLeastRun = 4;
  static constexpr double kLuck = 1e-6;
  static constexpr double kDrift = 0.3;
  static constexpr double kAlarm = 14.0;

  struct Side {
    int run = 0;
    int outliers = 0;  ///< in a row
    double outlier_luck = 1.0;
    double luck = 1.0;
    double sum = 0.0;

    constexpr int add(const Value& value, double part, double chance) noexcept {
      if (!value.outlier) {
        outliers = 0;
        outlier_luck = 1.0;
        sum = std::max(0.0, sum + part - kDrift);
      }
      if (part <= 0.0) {
        *this = Side{.sum = sum};
        return 0;
      }
      ++run;
      if (value.outlier) {
        ++outliers;
        outlier_luck *= chance;
      }
      luck = std::min(1.0, luck * ratio(value, part, chance));
      if (outliers >= kLongestRun) return outliers;
      if (outliers >= kLeastRun && outlier_luck < kLuck) return outliers;
      if (run >= kLeastRun && luck < kLuck) return run;
      return sum > kAlarm * value.correlation ? kLongestRun : 0;
    }
    /// Of the probabilities without and with a shift of some sigma.
    static constexpr double ratio(const Value& value, double part, double chance) noexcept {
      if (value.outlier) return std::min(1.0, chance / 0.5);
      return 1.0 + ((part < 1.0 ? 0.34 / 0.1 : 0.16 / 0.4) - 1.0) / value.correlation;
    }
  };
  Side late_{};
  Side early_{};
};

}  // namespace ftcs
