// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/time/instant.h"

namespace ftcs::node {

/// Whether what a reference shows may steer at all: asked of every message before the servo sees
/// it. Virtual because the answer (UtcFollower) needs readings of clocks that the node does not
/// have.
class ReferenceGate {
 public:
  virtual ~ReferenceGate() = default;
  /// `event`: the same instant on the free-running oscillator. False: the message is dropped.
  [[nodiscard]] virtual bool admits(ReferenceTime reference, FreeRunningTime event) noexcept = 0;
  /// Whether the reference may advance by so much more than the oscillator, as far as that alone
  /// says.
  [[nodiscard]] virtual bool admits_change(Duration) const noexcept { return true; }

 protected:
  ReferenceGate() = default;
  ReferenceGate(const ReferenceGate&) = default;
  ReferenceGate& operator=(const ReferenceGate&) = default;
};

}  // namespace ftcs::node
