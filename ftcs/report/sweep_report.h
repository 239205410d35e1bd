// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/experiment/scenario_run.h"
#include "ftcs/report/json.h"
#include "ftcs/report/table.h"

namespace ftcs {

/// What produced a sweep: with it anybody gets the same figures again.
struct SweepOrigin {
  std::string suite;  ///< name or path
  std::string version;
};

/// One scenario's servos, best first, the known-noise bound last, and how far each is from it.
[[nodiscard]] Table ranking_table(const experiment::ScenarioResult& scenario);
/// One row for each scenario and servo, limits and verdicts beside the figures.
[[nodiscard]] Table suite_table(const experiment::SweepResult& sweep);
/// Every missed limit in a sentence.
[[nodiscard]] std::vector<std::string> missed_limits(const experiment::SweepResult& sweep);

/// How many scenarios were cut short and how many did not run, whose limits are therefore not
/// judged; empty: all ran to their end.
[[nodiscard]] std::string unjudged(const experiment::SweepResult& sweep);
/// `suite`: a list with one object for each scenario and servo. `runs_of` lists the figures of
/// every single run (what a merge needs).
[[nodiscard]] Json sweep_json(const experiment::SweepResult& sweep, const SweepOrigin& origin,
                              bool with_runs);
/// The runs of a result that was written with_runs. Throws std::runtime_error if it is something
/// else or of other scenarios.
[[nodiscard]] experiment::SweepResult sweep_from_json(
    const Json& json, const std::vector<experiment::Scenario>& scenarios);
[[nodiscard]] std::string sweep_html(const experiment::SweepResult& sweep,
                                     const SweepOrigin& origin,
                                     const std::vector<experiment::RunTrace>& traces);

}  // namespace ftcs
