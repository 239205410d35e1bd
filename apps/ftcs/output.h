// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "ftcs/report/write_file.h"

namespace ftcs::app {

/// Writes one result file; an empty path is none, "-" is the standard output. False: it failed, and
/// standard error says why.
[[nodiscard]] bool write_result(const std::string& path, const std::string& content);

/// Before the run that leads to them: kSuccess if these results can be written, and none of them
/// over another or over what is read. Else standard error says which cannot, and why: kUsageError,
/// two options with one file; kRuntimeError, a file that cannot be written.
[[nodiscard]] int check_results(const std::vector<NamedFile>& results,
                                const std::vector<NamedFile>& inputs = {});

}  // namespace ftcs::app
