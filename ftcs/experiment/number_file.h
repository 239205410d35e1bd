// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace ftcs::experiment {

/// Numbers of a text file, `columns` of them a line, one after the other; between them stand
/// spaces, a comma or a semicolon. Empty lines and lines that begin with # are skipped. Throws
/// ScenarioError on anything else.
[[nodiscard]] std::vector<double> read_number_file(const std::string& path,
                                                   std::size_t columns = 1);

}  // namespace ftcs::experiment
