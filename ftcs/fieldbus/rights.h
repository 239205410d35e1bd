// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/fieldbus/run_options.h"
#include "ftcs/platform/confinement.h"

namespace ftcs::daemon {

/// What a run, and a segment, need of the system: the table in docs/security.md.
[[nodiscard]] platform::Confinement rights_of(const RunOptions& options);
[[nodiscard]] platform::Confinement rights_of_segment(bool raw, bool writes_file);

}  // namespace ftcs::daemon
