// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <csignal>

namespace ftcs::platform {

/// SIGINT and SIGTERM ask a long computation to end; finished runs are kept. One at a time; a
/// second signal kills.
class Interrupt {
 public:
  Interrupt() noexcept {
    raised() = false;
    previous_interrupt_ = std::signal(SIGINT, handle);
    previous_terminate_ = std::signal(SIGTERM, handle);
  }
  ~Interrupt() {
    std::signal(SIGINT, previous_interrupt_);
    std::signal(SIGTERM, previous_terminate_);
  }
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  [[nodiscard]] const std::atomic<bool>& flag() const noexcept { return raised(); }

 private:
  static std::atomic<bool>& raised() noexcept {
    static std::atomic<bool> flag{false};
    static_assert(std::atomic<bool>::is_always_lock_free);
    return flag;
  }
  static void handle(int signal) noexcept {
    raised() = true;
    std::signal(signal, SIG_DFL);
  }

  void (*previous_interrupt_)(int) = nullptr;
  void (*previous_terminate_)(int) = nullptr;
};

}  // namespace ftcs::platform
