// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <csignal>

namespace ftcs::platform {

/// Turns SIGINT, SIGTERM, SIGHUP and SIGQUIT into a flag for as long as it lives; one at a time. A
/// signal also ends a poll(2). SIGPIPE is ignored meanwhile: a reader of our output that goes away
/// must not end the program before it has left its clock at a good rate.
class StopFlag {
 public:
  StopFlag();
  ~StopFlag();
  StopFlag(const StopFlag&) = delete;
  StopFlag& operator=(const StopFlag&) = delete;

  [[nodiscard]] bool is_set() const noexcept;

 private:
  static constexpr std::array<int, 5> kSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE};

  std::array<struct sigaction, kSignals.size()> previous_{};
};

}  // namespace ftcs::platform
