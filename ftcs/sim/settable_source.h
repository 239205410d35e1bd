// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/clock/adjustable_clock.h"

namespace ftcs::sim {

/// An oscillator's face as a clock is given it: the laboratory sets what time it is.
class SettableSource final : public FreeRunningSource {
 public:
  [[nodiscard]] FreeRunningTime now() noexcept override { return now_; }
  void set(FreeRunningTime now) noexcept { now_ = now; }

 private:
  FreeRunningTime now_{};
};

}  // namespace ftcs::sim
