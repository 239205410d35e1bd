// SPDX-License-Identifier: MIT
#include "apps/ftcs/experiment_files.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/ftcs/embedded_experiments.h"
#include "ftcs/experiment/toml_table.h"

namespace ftcs::app {
namespace {

namespace fs = std::filesystem;

ExperimentFolder read_folder(const fs::path& folder) {
  ExperimentFolder result{folder.string(), {}, false};
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".toml") continue;
    result.files.push_back(
        {entry.path().string(), experiment::read_text_file(entry.path().string())});
  }
  return result;
}

ExperimentFolder read_embedded(const std::string& name) {
  ExperimentFolder result{name + " (built in)", {}, true};
  for (const EmbeddedExperiment& file : embedded_experiments()) {
    const std::string path(file.path);
    if (path.rfind(name + "/", 0) == 0) result.files.push_back({path, file.text()});
  }
  return result;
}

}  // namespace

ExperimentFolder find_experiments(const std::string& name) {
  const fs::path here = fs::path("experiments") / name;
  std::error_code ignored;
  ExperimentFolder folder = fs::is_directory(name, ignored)   ? read_folder(name)
                            : fs::is_directory(here, ignored) ? read_folder(here)
                                                              : read_embedded(name);
  if (folder.files.empty()) {
    throw std::runtime_error(fmt::format("no scenario files (*.toml) in {}", folder.origin));
  }
  std::sort(folder.files.begin(), folder.files.end(),
            [](const ExperimentFile& a, const ExperimentFile& b) { return a.path < b.path; });
  return folder;
}

std::vector<NamedFile> inputs_of(const ExperimentFolder& folder, const std::string& option) {
  std::vector<NamedFile> inputs;
  if (folder.built_in) return inputs;
  for (const ExperimentFile& file : folder.files) inputs.push_back({option, file.path});
  return inputs;
}

}  // namespace ftcs::app
