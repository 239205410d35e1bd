// SPDX-License-Identifier: MIT
#pragma once

#include <initializer_list>
#include <string>

namespace ftcs::app {

/// Writes one result file; an empty path is none, "-" is the standard output. False: it failed, and
/// standard error says why.
[[nodiscard]] bool write_result(const std::string& path, const std::string& content);

/// Before the run that leads to them: can these files be written? Empty paths and "-" can. False:
/// standard error says which cannot, and why.
[[nodiscard]] bool can_write_results(std::initializer_list<std::string> paths);

}  // namespace ftcs::app
