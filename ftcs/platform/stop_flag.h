// SPDX-License-Identifier: MIT
#pragma once

#include <csignal>

namespace ftcs::platform {

/// Turns SIGINT and SIGTERM into a flag for as long as it lives; one at a time. A signal also ends
/// a poll(2).
class StopFlag {
 public:
  StopFlag();
  ~StopFlag();
  StopFlag(const StopFlag&) = delete;
  StopFlag& operator=(const StopFlag&) = delete;

  [[nodiscard]] bool is_set() const noexcept;

 private:
  struct sigaction previous_interrupt_ {};
  struct sigaction previous_terminate_ {};
};

}  // namespace ftcs::platform
