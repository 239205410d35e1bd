// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <sys/types.h>

#include "ftcs/platform/os_error.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// A copy of this program that runs one function and ends with its result; told to stop (SIGTERM)
/// and waited for when this goes out of scope, and by the kernel should the parent die first.
/// In a process group of its own: Ctrl-C at a terminal goes to a group, and only the parent must
/// hear it, which would find its child dead and call that an error else.
class ChildProcess {
 public:
  [[nodiscard]] static Result<ChildProcess, OsError> start(const std::function<int()>& body);
  ~ChildProcess() { (void)stop(); }
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Its exit code if it has ended of itself; 128 + signal if a signal ended it.
  [[nodiscard]] std::optional<int> ended();
  /// SIGTERM, then its exit code.
  int stop();

 private:
  explicit ChildProcess(pid_t pid) noexcept : pid_(pid) {}
  void take(int status) noexcept;

  pid_t pid_ = 0;
  std::optional<int> code_{};
};

}  // namespace ftcs::platform
