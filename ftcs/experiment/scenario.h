// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ftcs/experiment/run_figures.h"
#include "ftcs/sim/two_way.h"

namespace ftcs::experiment {

class ServoLibrary;

/// A servo under a name; everything but the servo itself is the scenario's.
struct ScenarioServo {
  std::string name;
  ServoConfig config;
  bool clean_only = false;  ///< an oracle: it hears only messages that met nothing but jitter
  std::shared_ptr<const ServoLibrary> plugin{};  ///< where somebody else wrote it
};

/// The name of the known-noise Kalman filter: the last row of every comparison.
inline constexpr std::string_view kBoundName = "bound";
/// The same filter where messages wait, hearing only those that did not: what a servo could reach
/// that knew which ones waited. It stands in the bound's place where [path] has a load or stalls.
inline constexpr std::string_view kOracleName = "oracle";

/// Is it the row that others are measured by, and no servo that anybody could use?
[[nodiscard]] constexpr bool is_bound(std::string_view servo) noexcept {
  return servo == kBoundName || servo == kOracleName;
}

/// Bounds of one figure over the seeds; not a number = none.
struct FigureLimit {
  const FigureName* figure = nullptr;
  double median = kNoLimit;
  double worst = kNoLimit;
  double within = kNoLimit;  ///< ... in at least `share` of the runs
  double share = kNoLimit;
  double least = kNoLimit;            ///< of the median, from below
  double median_of_bound = kNoLimit;  ///< median over the median of the bound (or oracle)
  double worst_of_bound = kNoLimit;   ///< worst over the worst of the bound

  static constexpr double kNoLimit = std::numeric_limits<double>::quiet_NaN();
};

/// What a servo must reach.
struct ScenarioLimit {
  std::string servo;
  bool required = true;
  std::vector<FigureLimit> figures;
  std::string note;
};

/// What is measured, and from when.
struct MeasurementPlan {
  double from_cycle = 0.0;
  double to_cycle = 0.0;
  double converged_band_ns = 500.0;  ///< c5: five times the noise
  double converged_dwell_cycles = 60.0;
  std::optional<double> event_s;  ///< true time of a disturbance whose aftermath is measured
  bool at_samples =
      false;  ///< truth at the instants of forward messages instead of over the whole cycle
};

/// A world, the servos that live in it, and what they must reach there.
struct Scenario {
  std::string name;  ///< file name without extension, with the grid's values
  std::string file;
  std::string title;
  std::string network;    ///< "two-way", "one-way" or "ptp"
  sim::TwoWaySpec world;  ///< disciplines are filled in for each servo
  MeasurementPlan plan;
  std::uint64_t first_seed = 1;
  std::uint64_t seeds = 1;
  std::uint64_t fresh_seeds = 0;      ///< how many a median needs elsewhere; 0: as many as here
  std::vector<ScenarioServo> servos;  ///< the bound is the last one, where there is one
  std::vector<ScenarioLimit> limits;
  std::vector<std::string> notes;
};

/// A file is one scenario, or one for each point of its [grid]. Throws ScenarioError.
[[nodiscard]] std::vector<Scenario> parse_scenarios(std::string_view text, const std::string& file);
[[nodiscard]] std::vector<Scenario> load_scenarios(const std::string& path);

}  // namespace ftcs::experiment
