// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace ftcs::test {

/// Lines that a command prints.
inline std::vector<std::string> lines_of(const std::string& command) {
  std::vector<std::string> lines;
  FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return lines;
  std::array<char, 1024> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
    std::string line(buffer.data());
    line.erase(line.find_last_not_of('\n') + 1);
    lines.push_back(line);
  }
  pclose(pipe);
  return lines;
}

}  // namespace ftcs::test
