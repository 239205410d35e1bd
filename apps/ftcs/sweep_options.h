// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ftcs/experiment/scenario_run.h"
#include "ftcs/experiment/servo_library.h"
#include "ftcs/report/write_file.h"

namespace CLI {
class App;
}

namespace ftcs::app {

/// What `simulate` and `compare` have in common.
struct SweepOptions {
  std::uint64_t seeds = 0;          ///< 0: as the file says
  std::uint64_t first_seed = 0;     ///< 0: as the file says
  std::vector<std::string> servos;  ///< empty: as the file says
  bool medians_only = false;        ///< worst-seed limits belong to the file's own seeds
  unsigned threads = 0;
  std::string shard;
  std::vector<std::string> merge;
  std::string json;
  std::string csv;
  std::string html;
  std::string trace;  ///< sample by sample, the first seed of a single scenario
  bool quiet = false;
};

using ServoLibraries = std::vector<std::shared_ptr<const experiment::ServoLibrary>>;

/// The servos of `--servo` that are files, loaded; their paths are taken out of `servos`. Throws
/// std::runtime_error, also where two rows would have one name.
[[nodiscard]] ServoLibraries load_servos(std::vector<std::string>& servos);
/// After the runs: says of which servos the figures are not to be believed.
void say_doubts(const ServoLibraries& libraries);

void add_sweep_options(CLI::App& command, SweepOptions& options);

/// Can the results be written, none of them over another or over what is read: `inputs`, servos of
/// one's own, shards? As check_results().
[[nodiscard]] int check_sweep_results(const SweepOptions& options, std::vector<NamedFile> inputs);

/// Where the scenarios came from.
struct SweepSource {
  std::string name;
  std::vector<NamedFile> files;
};

/// Runs, prints and writes; the exit code.
[[nodiscard]] int run_and_report(std::vector<experiment::Scenario> scenarios,
                                 const SweepSource& source, const SweepOptions& options);

}  // namespace ftcs::app
