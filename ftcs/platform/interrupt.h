// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <csignal>
#include <cstdint>
#include <ctime>

#include "ftcs/time/duration.h"

namespace ftcs::platform {

/// SIGINT and SIGTERM ask a long computation to end; finished runs are kept. One at a time; a
/// second signal kills, if it comes half a second later or more: timeout(1) sends the same one
/// twice.
class Interrupt {
 public:
  Interrupt() noexcept {
    raised() = false;
    first() = 0;
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
  /// ns on CLOCK_MONOTONIC; 0: no signal has come.
  static std::atomic<std::int64_t>& first() noexcept {
    static std::atomic<std::int64_t> time{0};
    static_assert(std::atomic<std::int64_t>::is_always_lock_free);
    return time;
  }
  static void handle(int signal) noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    const std::int64_t time = now.tv_sec * kNsPerSecond + now.tv_nsec;
    std::int64_t before = 0;
    if (first().compare_exchange_strong(before, time)) {
      raised() = true;
    } else if (time - before >= kNsPerSecond / 2) {
      std::signal(signal, SIG_DFL);
      std::raise(signal);
    }
  }

  void (*previous_interrupt_)(int) = nullptr;
  void (*previous_terminate_)(int) = nullptr;
};

}  // namespace ftcs::platform
