// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/daemon/phc/phc_options.h"
#include "ftcs/daemon/ptp_options.h"
#include "ftcs/platform/confinement.h"

namespace ftcs::daemon {

/// What a run needs of the system, and nothing beside it: the table in docs/security.md.
[[nodiscard]] platform::Confinement rights_of(const PtpOptions& options);
[[nodiscard]] platform::Confinement rights_of(const PhcOptions& options);

/// Parts of it, for runs made of several.
void add_network_rights(platform::Confinement& rights, const PtpOptions& options);
void add_watch_rights(platform::Confinement& rights, const WatchOptions& options);
/// Files of other users' folders, as long as we are root.
void add_file_rights(platform::Confinement& rights, bool writes);

}  // namespace ftcs::daemon
