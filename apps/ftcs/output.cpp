// SPDX-License-Identifier: MIT
#include "apps/ftcs/output.h"

#include <cstdio>

#include <fmt/core.h>

#include "apps/ftcs/commands.h"

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

int check_results(const std::vector<NamedFile>& results, const std::vector<NamedFile>& inputs) {
  if (const auto error = check_distinct(results, inputs)) {
    fmt::print(stderr, "ftcs: {}\n", error->message);
    return kUsageError;
  }
  for (const NamedFile& result : results) {
    if (result.path.empty() || result.path == "-") continue;
    if (const auto error = check_writable(result.path)) {
      fmt::print(stderr, "ftcs: {}\n", error->message);
      return kRuntimeError;
    }
  }
  return kSuccess;
}

}  // namespace ftcs::app
