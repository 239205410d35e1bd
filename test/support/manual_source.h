// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/clock/adjustable_clock.h"

namespace ftcs::test {

/// An oscillator that shows what the test says.
struct ManualSource final : FreeRunningSource {
  FreeRunningTime instant;
  [[nodiscard]] FreeRunningTime now() noexcept override { return instant; }
};

}  // namespace ftcs::test
