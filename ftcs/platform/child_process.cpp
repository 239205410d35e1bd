// SPDX-License-Identifier: MIT
#include "ftcs/platform/child_process.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace ftcs::platform {

Result<ChildProcess, OsError> ChildProcess::start(const std::function<int()>& body) {
  std::fflush(nullptr);  // or both processes would write what is buffered
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) return os_error(errno, "starting a second process");
  if (pid > 0) return ChildProcess(pid);
  (void)setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(0);  // it died before the line above
  const int code = body();
  std::fflush(nullptr);
  _exit(code);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)), code_(other.code_) {}

void ChildProcess::take(int status) noexcept {
  constexpr int kSignalBase = 128;  // as a shell reports it
  code_ = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalBase + WTERMSIG(status);
  pid_ = 0;
}

std::optional<int> ChildProcess::ended() {
  if (pid_ == 0) return code_;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_) take(status);
  return code_;
}

int ChildProcess::stop() {
  if (pid_ == 0) return code_.value_or(0);
  kill(pid_, SIGTERM);
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  take(status);
  return *code_;
}

}  // namespace ftcs::platform
