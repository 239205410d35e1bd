// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

#include "ftcs/daemon/watch/watch.h"

namespace ftcs::app {

/// --metrics, --metrics-file, --metrics-names and --web of a daemon. `options` must outlive
/// `command`.
void add_watch_flags(CLI::App& command, daemon::WatchOptions& options);

}  // namespace ftcs::app
