// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/delay_shape.h"
#include "ftcs/estimation/sorted_window.h"

namespace ftcs::estimation {

/// What the learner is told about one message, by the model believed best.
struct NoiseSample {
  double innovation = 0.0;    ///< nu, raw, ns
  double predicted = 0.0;     ///< h P h', units of s^2
  double robust_scale = 0.0;  ///< median scale of all innovations, ns
  bool settled = false;       ///< no recent change was noticed
  double step = 0.0;          ///< of the stamps, ns: what innovations may be multiples of
};

/// Learns size and shape of the delay noise of one direction.
///
/// Mean m1 and variance m2 of the innovations, by growing memory of at most
/// 1,000 samples, each square scaled by R / (h P h' + R) so that the estimate's
/// own error is not taken for noise. Whether part of it is queueing (late only)
/// is decided by the likelihood ratio of three shapes against the normal one;
/// the size of the tail then follows from m2: tail = k sqrt(m2).
///
/// Medians are taken of innovations dithered by a step of the stamps: without noise beside the
/// rounding most are one value, and their median deviation is nothing.
template <std::size_t Window>
class NoiseLearner {
 public:
  /// Returns whether the sample was taken.
  bool learn(const NoiseSample& sample, const DelayShape& shape) noexcept;
  void restart() noexcept { *this = NoiseLearner{}; }
  /// The reference point of the delay moved by `shift` ns (mean to floor or
  /// back).
  void move_mean(double shift) noexcept {
    mean_ += shift;
    body_mean_ += static_cast<float>(shift);
  }

  /// variance(), ns^2, is worth more than the common median scale.
  [[nodiscard]] bool mature() const noexcept { return count_ >= kShortMemory; }
  [[nodiscard]] double count() const noexcept { return count_; }
  [[nodiscard]] double variance() const noexcept { return variance_; }
  [[nodiscard]] bool has_tail() const noexcept { return has_tail_; }
  /// What speaks for each of three shapes with a queue, against noise and
  /// outliers, in nats. Two directions that are alike add theirs.
  struct Case {
    std::array<double, 3> queue{};
    double outliers = 0.0;
    void add(const Case& other) noexcept {
      for (std::size_t i = 0; i < queue.size(); ++i) queue[i] += other.queue[i];
      outliers += other.outliers;
    }
  };
  [[nodiscard]] Case plead() const noexcept;
  /// Decides normal or late, with hysteresis, and returns the shape in ns
  /// (scale 1).
  [[nodiscard]] DelayShape decide(const Case& said) noexcept;
  /// Probability, roughly, that a learnt tail is none, and the floor of the
  /// delay not where it says.
  [[nodiscard]] double tail_doubt() const noexcept;

 private:
  static constexpr std::array<double, 3> kTailShares = {0.99, 0.9, 0.75};

  SortedWindow<Window> recent_;
  std::uint32_t heard_ = 0;
  double count_ = 0.0;
  double mean_ = 0.0;
  double variance_ = 0.0;
  std::array<float, 3> ratio_{};  ///< ln likelihood, late against normal
  float spoilt_ = 0.0F;           ///< the same, normal with outliers against normal
  float body_mean_ = 0.0F;        ///< slow means of the window's median and its deviation
  float body_deviation_ = 0.0F;
  float lead_ = 0.0F;  ///< of queueing over the better alternative, nats
  bool has_tail_ = false;
};

/// Learns nothing: both directions have normal noise of one common scale.
template <>
class NoiseLearner<0> {
 public:
  bool learn(const NoiseSample&, const DelayShape&) noexcept { return false; }
  void restart() noexcept {}
  void move_mean(double) noexcept {}
  [[nodiscard]] bool mature() const noexcept { return false; }
  [[nodiscard]] double count() const noexcept { return 0.0; }
  [[nodiscard]] double variance() const noexcept { return 1.0; }
  struct Case {
    void add(const Case&) noexcept {}
  };
  [[nodiscard]] Case plead() const noexcept { return {}; }
  [[nodiscard]] DelayShape decide(const Case&) noexcept { return {}; }
  [[nodiscard]] double tail_doubt() const noexcept { return 0.0; }
};

extern template class NoiseLearner<32>;

}  // namespace ftcs::estimation
