// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "ftcs/measurement/message_order.h"
#include "ftcs/servo/servo.h"

namespace ftcs {

/// The one question in front of every servo: is this message news? A repeated, late or impossible
/// one does not reach it. Where refused messages themselves advance a clock was set back: what the
/// servo measured before is void (on_new_epoch(), or reset() where a servo has none), and the
/// message is the first.
template <ClockServo Servo>
ServoUpdate update_in_order(MessageOrder& order, Servo& servo, const TimestampPair& pair,
                            const ClockReading& now) noexcept {
  using Verdict = MessageOrder::Verdict;
  const Verdict verdict = order.judge(pair);
  if (verdict == Verdict::kDuplicate) return {SampleVerdict::kDuplicate, false, {}};
  if (verdict == Verdict::kImplausible) return {SampleVerdict::kImplausible, false, {}};
  if (verdict == Verdict::kNewEpoch) {
    if constexpr (requires { servo.on_new_epoch(); }) {
      servo.on_new_epoch();
    } else {
      servo.reset();
    }
  }
  return servo.update(pair, now);
}

/// A servo with that question in front of it, for whoever uses one without a discipline.
template <ClockServo Servo>
class InOrder {
 public:
  template <class... Configs>
  explicit InOrder(const Configs&... configs) noexcept : servo_(configs...) {}

  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept {
    return update_in_order(order_, servo_, pair, now);
  }
  void reset() noexcept {
    order_.reset();
    servo_.reset();
  }
  [[nodiscard]] ServoSnapshot snapshot() const noexcept { return servo_.snapshot(); }
  [[nodiscard]] ServoSnapshot snapshot_at(const ClockReading& now) const noexcept {
    if constexpr (requires { servo_.snapshot_at(now); }) return servo_.snapshot_at(now);
    return servo_.snapshot();
  }

 private:
  MessageOrder order_{};
  Servo servo_;
};

}  // namespace ftcs
