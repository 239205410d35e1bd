// SPDX-License-Identifier: MIT
#include "ftcs/experiment/number_file.h"

#include <charconv>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "ftcs/experiment/scenario_error.h"

namespace ftcs::experiment {

std::vector<double> read_number_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw ScenarioError(fmt::format("{}: cannot be read", path));
  std::vector<double> values;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    const auto last = line.find_last_not_of(" \t\r");
    double value = 0.0;
    const char* end = line.data() + last + 1;
    const auto [stop, error] = std::from_chars(line.data() + first, end, value);
    if (error != std::errc{} || stop != end || !std::isfinite(value)) {
      throw ScenarioError(fmt::format("{}:{}: \"{}\" is not a number", path, number, line));
    }
    values.push_back(value);
  }
  return values;
}

}  // namespace ftcs::experiment
