// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/report/write_file.h"

namespace ftcs::app {

struct ExperimentFile {
  std::string path;  ///< as it is shown in messages
  std::string text;
};

struct ExperimentFolder {
  std::string origin;                 ///< where the files came from
  std::vector<ExperimentFile> files;  ///< *.toml in the order of their names
  bool built_in = false;              ///< their paths are then no files
};

/// The scenario files of a folder: `name` itself if it is a folder, else ./experiments/name, else
/// what was compiled into the program. Throws std::runtime_error if there is none.
[[nodiscard]] ExperimentFolder find_experiments(const std::string& name);

/// Its files on a disk, each with the option that named the folder.
[[nodiscard]] std::vector<NamedFile> inputs_of(const ExperimentFolder& folder,
                                               const std::string& option);

}  // namespace ftcs::app
