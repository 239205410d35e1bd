// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace ftcs::app {

/// Writes one result file; an empty path is none, "-" is the standard output. False: it failed, and
/// standard error says why.
[[nodiscard]] bool write_result(const std::string& path, const std::string& content);

}  // namespace ftcs::app
