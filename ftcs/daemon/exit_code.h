// SPDX-License-Identifier: MIT
#pragma once

namespace ftcs::daemon {

/// What a run comes to, as the program's exit code (docs/ptp.md); stable.
enum ExitCode : int {
  kSuccess = 0,       ///< done; a time receiver: locked when it stopped
  kRuntimeError = 1,  ///< the system refused something, or the reference is not usable
  kUsageError = 2,    ///< a wrong flag, value or configuration file
  kNotLocked = 3,     ///< stopped in good order, but not locked
};

}  // namespace ftcs::daemon
