// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace ftcs::experiment {

/// Numbers of a text file, one a line; empty lines and lines that begin with # are skipped. Throws
/// ScenarioError on anything else.
[[nodiscard]] std::vector<double> read_number_file(const std::string& path);

}  // namespace ftcs::experiment
