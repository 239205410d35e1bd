// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include "ftcs/estimation/belief.h"

namespace ftcs::estimation {

/// One hypothesis of how clock and path wander. Dimensionless: variances in
/// units of s^2 (s = noise of one timestamp), time in cycles (one sync
/// interval).
struct NoiseModel {
  double white_fm = 0.0;        ///< a: variance added to the offset per cycle
  double random_walk_fm = 0.0;  ///< b: variance added to the rate (per cycle) per cycle
  double delay_walk = 0.0;      ///< variance added to the path delay per cycle
};

/// One parameter of all models, plus `added`.
template <std::size_t size>
[[nodiscard]] constexpr std::array<double, size> column(const std::array<NoiseModel, size>& models,
                                                        double NoiseModel::*parameter,
                                                        double added = 0.0) noexcept {
  std::array<double, size> values{};
  for (std::size_t i = 0; i < size; ++i) values[i] = models[i].*parameter + added;
  return values;
}

/// The full bank, ordered from calm to wild: a model may take over the state of
/// any model behind it. Random-walk FM by decades: the gain of a filter goes
/// with b^(1/4), so that half a decade off costs below one per cent. White FM
/// matters only above sqrt(b); there the gain goes with a^(1/2).
///
/// In the field's units, with noise s (ns) and a sync interval of T seconds:
/// the Allan deviation of white FM at tau = T is sqrt(a) s / T ns/s, and the
/// rate walks by sqrt(b) s / T ns/s from one interval to the next (NIST SP
/// 1065, power laws of FM noise).
struct FullGrid {
  static constexpr std::size_t kResidualWindow = 32;  ///< innovations behind the robust scale
  static constexpr std::size_t kNoiseWindow =
      kResidualWindow;                               ///< of the noise learner, per direction
  static constexpr std::size_t kOpinionWindow = 16;  ///< messages of the second opinion
  static constexpr bool kWatchesJumps = true;
  static constexpr bool kFollowsFloor = true;  ///< where messages queue
  static constexpr std::size_t kStart = 13;    ///< the model that is believed before any evidence
  static constexpr double kCalmFavour = 0.0;
  static constexpr std::size_t kFavoured = 7;  ///< believed a little more than its neighbours
  static constexpr std::size_t kSudden = 25;   ///< from here on models explain any single message
  [[nodiscard]] static constexpr double places_from_start(std::size_t i) noexcept {
    return static_cast<double>(i) - static_cast<double>(kStart);
  }
  static constexpr auto kModels = std::to_array<NoiseModel>({
      {0.0, 0.0, 0.0},   {0.0, 1e-14, 0.0},  {0.0, 1e-13, 0.0}, {0.0, 1e-12, 0.0},
      {0.0, 1e-11, 0.0}, {0.0, 1e-10, 0.0},  {1e-5, 0.0, 0.0},  {0.0, 1e-9, 0.0},
      {0.0, 1e-8, 0.0},  {1e-4, 1e-10, 0.0}, {0.0, 1e-7, 0.0},  {0.0, 1e-6, 0.0},
      {1e-3, 1e-9, 0.0}, {0.0, 1e-5, 0.0},   {0.0, 1e-4, 0.0},  {1e-2, 1e-8, 0.0},
      {1e-2, 1e-6, 0.0}, {0.0, 1e-3, 0.0},   {0.0, 1e-2, 0.0},  {1e-1, 1e-7, 0.0},
      {1e-1, 1e-4, 0.0}, {0.0, 1e-1, 0.0},   {0.0, 1e0, 0.0},   {1e0, 1e-6, 0.0},
      {1e0, 1e-3, 0.0},  {0.0, 1e1, 0.0},    {0.0, 1e2, 0.0},   {0.0, 1e3, 0.0},
  });
  static constexpr std::size_t kSize = kModels.size();
};

/// Beside the full bank, for the messages that wait for nothing on a path where
/// others queue. They are few, and tell less finely how the oscillator wanders:
/// half of the full bank's models. The wildest is among them: it alone explains the
/// early messages of a rate that has changed by 10 ppm.
struct FloorGrid {
  /// Their places in the full bank.
  static constexpr auto kInFull =
      std::to_array<std::size_t>({0, 7, 8, 9, 10, 11, 13, 14, 15, 17, 18, 21, 25, 27});
  static constexpr std::size_t kSize = kInFull.size();
  static constexpr auto kPlaceOf = [](std::size_t in_full) constexpr noexcept {
    std::size_t i = 0;
    while (kInFull[i] < in_full) ++i;
    return i;
  };
  static constexpr std::size_t kStart = kPlaceOf(FullGrid::kStart);
  static constexpr std::size_t kFavoured = kPlaceOf(FullGrid::kFavoured);
  static constexpr std::size_t kSudden = kPlaceOf(FullGrid::kSudden);
  /// Twice nats for the one that stands for seven nearly constant ones of the
  /// full bank: 2 ln 7.
  static constexpr double kCalmFavour = 3.9;
  [[nodiscard]] static constexpr double places_from_start(std::size_t i) noexcept {
    return FullGrid::places_from_start(kInFull[i]);
  }
  static constexpr std::array<NoiseModel, kSize> kModels = []() constexpr {
    std::array<NoiseModel, kSize> models{};
    for (std::size_t i = 0; i < kSize; ++i) models[i] = FullGrid::kModels[kInFull[i]];
    return models;
  }
  ();
};

/// For microcontrollers: three models four decades apart, the gate and the
/// detection of changes, but neither learnt noise shapes nor a second opinion.
/// What that costs: docs/adaptive-servo.md.
struct SmallGrid {
  static constexpr std::size_t kResidualWindow = kLately;
  static constexpr std::size_t kNoiseWindow = 0;
  static constexpr std::size_t kOpinionWindow = 0;
  static constexpr bool kWatchesJumps = false;
  static constexpr bool kFollowsFloor = false;
  static constexpr std::size_t kStart = 1;
  static constexpr double kCalmFavour = 0.0;
  [[nodiscard]] static constexpr double places_from_start(std::size_t i) noexcept {
    return static_cast<double>(i) - static_cast<double>(kStart);
  }
  static constexpr auto kModels =
      std::to_array<NoiseModel>({{0.0, 1e-9, 0.0}, {0.0, 1e-4, 0.0}, {0.0, 1e1, 0.0}});
  static constexpr std::size_t kSize = kModels.size();
  static constexpr std::size_t kFavoured = kSize;  // none
  static constexpr std::size_t kSudden = kSize;
};

}  // namespace ftcs::estimation
