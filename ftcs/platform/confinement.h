// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <linux/capability.h>  // CAP_..., for who says which rights it needs
#include <optional>
#include <string>
#include <vector>

namespace ftcs::platform {

/// What a command may ask the kernel for, beside what every program needs. A new kind of work (an
/// HTTP server, say) is a new name here, a list in confinement.cpp, and a row of the command's
/// table.
enum class SystemCalls : std::uint8_t {
  kFiles,         ///< open, write beside and rename, lock
  kNetwork,       ///< sockets
  kSharedMemory,  ///< System V: NTP's SHM
  kSteering,      ///< clock_adjtime and timers
  kRealTime,      ///< mlockall, schedulers
  kThreads,       ///< of this process; never another process
  kServer,        ///< accept: who lets others connect
};

/// The rights that a process keeps.
struct Confinement {
  std::vector<int> capabilities{};  ///< CAP_...; those that it does not have are no error
  std::vector<SystemCalls> calls{};
  /// become_user() will be called: until then the rights to do so are kept.
  bool will_change_user = false;
  /// Of data and heap together (RLIMIT_DATA). Zero: as it was.
  std::uint64_t most_memory = std::uint64_t{1} << 30;
};

/// From here on this process and its threads have these rights and no others, for ever:
/// capabilities (libcap-ng), no new privileges, and a filter of system calls (libseccomp) under
/// which any other call ends the process (SIGSYS). Returns what failed. Programs built with
/// sanitizers have no filter: those make calls of their own.
[[nodiscard]] std::optional<std::string> confine(const Confinement& confinement);

struct User {
  std::string name;
  unsigned uid = 0;
  unsigned gid = 0;
};

/// None: there is no such user.
[[nodiscard]] std::optional<User> find_user(const std::string& name);

/// Once everything is open that only root may open. Keeps the confinement's capabilities.
[[nodiscard]] std::optional<std::string> become_user(const User& user,
                                                     const std::vector<int>& capabilities);

}  // namespace ftcs::platform
