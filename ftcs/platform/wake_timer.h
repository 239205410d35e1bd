// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/platform/kernel.h"

namespace ftcs::platform {

/// Wakes poll(2) at a moment finer than its milliseconds.
class WakeTimer {
 public:
  explicit WakeTimer(Kernel& kernel) noexcept
      : kernel_(kernel), timer_(kernel, kernel.open_timer()) {}

  /// Negative: there is none, and poll's own timeout must do.
  [[nodiscard]] int descriptor() const noexcept { return timer_.get(); }
  void set(std::int64_t from_now_ns) noexcept {
    if (timer_.is_open()) (void)kernel_.set_timer(timer_.get(), from_now_ns);
  }
  /// After it has woken us. Not to be called before: some simulators take that for an error.
  void acknowledge() noexcept {
    std::array<std::uint8_t, sizeof(std::uint64_t)> expirations{};
    if (timer_.is_open()) (void)kernel_.read(timer_.get(), expirations);
  }

 private:
  Kernel& kernel_;
  Descriptor timer_;
};

}  // namespace ftcs::platform
