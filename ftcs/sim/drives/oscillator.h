// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs::ethercat {

/// The time of the wire itself: simulated time, or the stamps of a kernel or a network card.
struct WireTimescale;
using WireTime = Instant<WireTimescale>;

/// The crystal of one SubDevice, injected: what it shows when the wire's time is `instant`. Must be
/// continuous and rising, and must answer for instants a few milliseconds back (frames that overlap
/// return later than their successor arrives).
class LocalOscillator {
 public:
  [[nodiscard]] virtual Duration reading(WireTime instant) noexcept = 0;

 protected:
  LocalOscillator() = default;
  LocalOscillator(const LocalOscillator&) = default;
  LocalOscillator& operator=(const LocalOscillator&) = default;
  // Not virtual: nobody deletes through the base, and operator delete needs a heap.
  ~LocalOscillator() = default;
};

/// reading = initial + rate * (instant - start); the rate may be changed on the way.
class AffineOscillator final : public LocalOscillator {
 public:
  AffineOscillator() noexcept = default;
  explicit AffineOscillator(Rate rate, Duration initial = {}) noexcept
      : rate_(rate), initial_(initial) {}

  [[nodiscard]] Duration reading(WireTime instant) noexcept override {
    return initial_ + scale(instant - start_, rate_);
  }
  void set_rate(Rate rate, WireTime from) noexcept {
    initial_ = reading(from);
    start_ = from;
    rate_ = rate;
  }

 private:
  Rate rate_;
  Duration initial_{};
  WireTime start_;
};

}  // namespace ftcs::ethercat
