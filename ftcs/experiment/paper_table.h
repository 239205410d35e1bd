// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "ftcs/experiment/servo_library.h"
#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/pics_servo.h"
#include "ftcs/sim/one_way.h"

namespace ftcs::experiment {

inline constexpr double kNotGiven = std::numeric_limits<double>::quiet_NaN();

/// A servo that somebody else wrote, given the row's interval and limits.
struct ExternalPaperServo {
  std::shared_ptr<const ServoLibrary> plugin;
};

/// A servo of the paper and what the paper and the model say of it.
struct PaperRow {
  std::string name;
  std::string group;     ///< what distinguishes it from a row of the same name, e.g. "T = 500 us"
  bool support = false;  ///< needed by a check, not a row of the paper's table
  sim::OneWaySpec world;
  std::variant<FtcsConfig, PicsConfig, AdaptiveConfig, ExternalPaperServo> servo;
  double paper_rms_ns = kNotGiven;
  double paper_cycles = kNotGiven;
  double model_rms_ns = kNotGiven;  ///< of the independent model, docs/paper-reproduction.md
  std::string note;

  /// Unique within its file: name, or name and group.
  [[nodiscard]] std::string key() const { return group.empty() ? name : name + ", " + group; }
};

/// What a check measures.
enum class CheckFigure : std::uint8_t {
  kRms,           ///< of each row: RMS of the perceived offset over all seeds
  kMedian,        ///< of each row: median over seeds of one run's RMS
  kTrueRms,       ///< of each row: RMS of the true time error over all seeds
  kDeviation,     ///< of each row: deviation of the perceived offset about the run's own mean, over
                  ///< all seeds
  kCycles,        ///< of each row: median cycles to converge
  kSeedRms,       ///< of each row: RMS of the published seed's run
  kSeedExact,     ///< of each row: the published seed's RMS, to the last bit
  kRatio,         ///< rms(rows[i]) / rms(over[i])
  kMedianRatio,   ///< median over seeds of the ratio of two runs with common noise
  kSpread,        ///< largest rms / smallest rms of the rows
  kProbability,   ///< share of seeds in which rows[i] has a lower RMS than over[i]
  kSettlingTime,  ///< ratio of times (not cycles) to converge, rows[i] / over[i]
};

/// A demand on figures, or a report of them.
struct PaperCheck {
  std::string name;
  CheckFigure figure = CheckFigure::kRms;
  std::string against;            ///< "model" or "paper"
  std::vector<std::string> rows;  ///< keys
  std::vector<std::string> over;  ///< keys, for figures that compare
  /// Each row's own expectation: its paper or model value, or `expected` (one for all, or one a
  /// row).
  std::vector<double> expected;
  bool expect_from_row = false;
  double relative_tolerance = kNotGiven;
  double least = kNotGiven;  ///< alternatively limits
  double most = kNotGiven;
  double minus = kNotGiven;  ///< alternatively expected - minus .. expected + plus
  double plus = kNotGiven;
  bool demanded = true;  ///< false: reported only
  std::string note;
};

/// A parameter that the paper leaves open.
struct PaperChoice {
  std::string parameter;
  std::string value;
  std::string reason;
};

struct PaperTable {
  std::string table;  ///< "table2"
  std::string title;
  std::uint64_t first_seed = 1;
  std::uint64_t seeds = 0;
  std::uint64_t published_seed = 1;
  std::uint64_t measure_from = 0;  ///< first sample of the steady state
  double converged_band_ns = 500.0;
  std::vector<PaperRow> rows;
  std::vector<PaperCheck> checks;
  std::vector<PaperChoice> choices;
  std::vector<std::string> remarks;
  std::vector<std::string> figure_rows;  ///< keys whose published run is drawn
  std::string figure;                    ///< "figure4"
};

/// Throws ScenarioError.
[[nodiscard]] PaperTable parse_paper_table(std::string_view text, const std::string& file);

}  // namespace ftcs::experiment
