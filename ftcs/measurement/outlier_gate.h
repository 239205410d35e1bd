// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/time/duration.h"

namespace ftcs {

/// What is not valid() works all the same: a warm_up above kMemory as kMemory, rejections_to_exit
/// of zero as 1.
struct OutlierGateConfig {
  static constexpr std::size_t kMemory = 32;  ///< innovations that the gate remembers

  double width = 6.0;  ///< accepted distance from the usual, in robust standard deviations; > 0
  std::size_t warm_up = 8;  ///< innovations that are accepted unseen; at most kMemory
  std::size_t rejections_to_exit =
      5;  ///< so many in a row are no outliers but the truth; at least 1
  Nanoseconds resolution{
      1};  ///< of the timestamps: no spread is smaller (all innovations may be equal); above 0

  [[nodiscard]] constexpr bool valid() const noexcept {
    constexpr double kWidest = 1e9;  // also: not infinite, and a number
    return width > 0.0 && width < kWidest && warm_up <= kMemory && rejections_to_exit >= 1 &&
           resolution > Nanoseconds{0};
  }
};

enum class GateDecision : std::uint8_t {
  kAccept,
  kReject,
  kExit,  ///< accepted, because too many were rejected in a row: whatever was predicted is wrong,
          ///< start anew
};

/// Since construction; every decision is in one of them.
struct GateCounters {
  std::uint64_t accepted = 0;
  std::uint64_t rejected = 0;
  std::uint64_t exits = 0;
};

/// Tells outliers by the innovation (measured minus predicted), with a spread that it learns.
///
/// Usual value and spread are the median and 1.4826 MAD (the standard deviation of a normal
/// distribution) of the last innovations, rejected ones included: a threshold learnt from accepted
/// samples alone shuts itself. Copes with outliers in up to a quarter of the samples; follows a
/// true step after rejections_to_exit samples. No threshold in nanoseconds is ever set.
///
///     accepted:  |v - m| <= width s,   m = median(v_i),   s = 1.4826 median(|v_i - m|)
///
/// over the last 32 innovations before this one; s is at least the resolution. Six of them leave
/// out 2e-9 of normal noise. A decision costs two medians of 32 values (see order_statistic()).
class OutlierGate {
 public:
  static constexpr std::size_t kMemory = OutlierGateConfig::kMemory;

  explicit OutlierGate(const OutlierGateConfig& config = {}) noexcept : config_(config) {}

  /// Decides on one innovation and learns from it. After kExit the caller starts its prediction
  /// anew from this sample, which counts as accepted.
  [[nodiscard]] GateDecision decide(Duration innovation) noexcept;

  /// Learns from an innovation on which nothing hangs; it ends a row of rejections.
  void observe(Duration innovation) noexcept {
    rejected_in_a_row_ = 0;
    learn(innovation.ns());
  }

  /// Enough was heard to judge by.
  [[nodiscard]] bool warm() const noexcept { return size_ >= config_.warm_up || size_ == kMemory; }
  /// Learnt standard deviation in nanoseconds; the resolution until something was learnt.
  [[nodiscard]] double spread_ns() const noexcept;
  [[nodiscard]] const GateCounters& counters() const noexcept { return counters_; }

  /// Forgets the innovations, keeps the counters.
  void reset() noexcept;

 private:
  using Values = std::array<double, kMemory>;

  void learn(double innovation_ns) noexcept;
  [[nodiscard]] double median_of(Values values) const noexcept;
  [[nodiscard]] double spread_about(double centre) const noexcept;

  OutlierGateConfig config_;
  Values innovations_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
  std::size_t rejected_in_a_row_ = 0;
  GateCounters counters_{};
};

}  // namespace ftcs
