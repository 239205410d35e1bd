// SPDX-License-Identifier: MIT
#include "ftcs/experiment/number_file.h"

#include <fstream>
#include <string_view>

#include <fmt/format.h>

#include "ftcs/experiment/scenario_error.h"
#include "ftcs/record/fields.h"

namespace ftcs::experiment {

std::vector<double> read_number_file(const std::string& path, std::size_t columns) {
  std::ifstream file(path);
  if (!file) throw ScenarioError(fmt::format("{}: cannot be read", path));
  std::vector<double> values;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') continue;
    const auto fields = split_fields(text, separator_of(text));
    if (fields.size() != columns) {
      throw ScenarioError(fmt::format("{}:{}: expected {} number{}, got \"{}\"", path, number,
                                      columns, columns == 1 ? "" : "s", line));
    }
    for (const std::string_view field : fields) {
      const auto value = parse_decimal(field);
      if (!value)
        throw ScenarioError(fmt::format("{}:{}: \"{}\" is not a number", path, number, field));
      values.push_back(*value);
    }
  }
  return values;
}

}  // namespace ftcs::experiment
