// SPDX-License-Identifier: MIT
#include "apps/ftcs/output.h"

#include <cstdio>

#include <fmt/core.h>

#include "ftcs/report/write_file.h"

namespace ftcs::app {

bool write_result(const std::string& path, const std::string& content) {
  if (path.empty()) return true;
  if (path == "-") return std::fwrite(content.data(), 1, content.size(), stdout) == content.size();
  if (const auto error = write_file(path, content)) {
    fmt::print(stderr, "ftcs: {}\n", error->message);
    return false;
  }
  return true;
}

bool can_write_results(std::initializer_list<std::string> paths) {
  for (const std::string& path : paths) {
    if (path.empty() || path == "-") continue;
    if (const auto error = check_writable(path)) {
      fmt::print(stderr, "ftcs: {}\n", error->message);
      return false;
    }
  }
  return true;
}

}  // namespace ftcs::app
