// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace ftcs::app {

struct ExperimentFile {
  std::string path;  ///< as it is shown in messages
  std::string text;
};

struct ExperimentFolder {
  std::string origin;                 ///< where the files came from
  std::vector<ExperimentFile> files;  ///< *.toml in the order of their names
};

/// The scenario files of a folder: `name` itself if it is a folder, else ./experiments/name, else
/// what was compiled into the program. Throws std::runtime_error if there is none.
[[nodiscard]] ExperimentFolder find_experiments(const std::string& name);

}  // namespace ftcs::app
