// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ftcs/measurement/outlier_gate.h"
#include "ftcs/measurement/path_delay_estimator.h"
#include "ftcs/servo/servo.h"
#include "ftcs/servo/servo_config_error.h"
#include "ftcs/time/relabel.h"

namespace ftcs {

/// What every classic servo needs in front of its control law. Valid: validate() finds nothing.
struct TwoWayConfig {
  PathDelayConfig path_delay{};
  /// A path delay known otherwise (peer delay, wiring): backward messages are then not used. May be
  /// set to zero.
  std::optional<Nanoseconds> fixed_path_delay{};
  /// Has an effect only where the path delay is rate compensated: without that, there is no rate to
  /// predict by.
  bool gate_enabled = true;
  OutlierGateConfig gate{};
};

/// The first thing that is wrong: kPathDelay (where none is fixed), kOutlierGate (where it is
/// enabled).
[[nodiscard]] constexpr std::optional<ServoConfigError> validate(
    const TwoWayConfig& config) noexcept {
  if (!config.fixed_path_delay && !config.path_delay.valid()) return ServoConfigError::kPathDelay;
  if (config.gate_enabled && !config.gate.valid()) return ServoConfigError::kOutlierGate;
  return std::nullopt;
}

/// A ClockServo made of a control law: path-delay estimator and outlier gate in front of it.
///
/// The gate judges a forward message against the prediction in free-running time (last accepted
/// message plus elapsed time times rate ratio), not the control error: steering cannot look like an
/// outlier. A rejected message reaches neither the law nor the path delay. When the gate gives way,
/// the law starts anew, while the clock keeps its last command.
///
///     innovation = t1_a + r (t2 - t2_a) - t1        r: rate ratio of the last forward messages,
///                                                   a: last accepted message; positive: late
///
/// A forward message, which is news (in_order.h), passes in this order:
///
///     the gate       once two messages have told the rate; kRejected, or the row's last: exit
///     path delay     becomes the partner of backward messages near to it
///     the law        origin, path delay, local and free-running stamp, as one SyncSample
///
/// The law is silent until a path delay is known: given, or measured by one exchange. Its first
/// sample may then be the message before (prime()), so that FTCS commands with the first exchange
/// and one more Sync. Whether its interval is possible the law judges.
///
///     TwoWayServo<FtcsServo> servo({.fixed_path_delay = 10us}, {.offset_gain = 1.0 / 8.0});
template <ControlLaw Law>
class TwoWayServo {
 public:
  /// Valid: validate(config) and validate(law) find nothing; not asked here.
  TwoWayServo(const TwoWayConfig& config, const typename Law::Config& law) noexcept
      : config_(config), delay_(config.path_delay), gate_(config.gate), law_(law) {}

  /// Messages come in order (in_order.h). Forward: the law's verdict and command; kRejected by the
  /// gate. Backward: never a command; kImplausible where the path delay it tells is impossible
  /// (PathDelayConfig), kRejected where no forward message is near enough to it, else kUsed: it may
  /// still be kept for the next forward message.
  ServoUpdate update(const TimestampPair& pair, const ClockReading& now) noexcept {
    return pair.direction == Direction::kForward ? on_forward(pair, now) : on_backward(pair);
  }

  /// Another reference: messages, delays and what the gate has learnt are void.
  void reset() noexcept {
    delay_.reset();
    gate_.reset();
    law_.reset();
    law_fed_ = false;
  }

  /// A clock was set back: what was measured across it is void, the path delay stands.
  void on_new_epoch() noexcept {
    gate_.reset();
    delay_.restart();
    if constexpr (requires { law_.on_new_epoch(); }) {
      law_.on_new_epoch();
    } else {
      law_.reset();
    }
  }

  /// The clock has been stepped by somebody else, by so much (positive: ahead). Path delay and gate
  /// live in free-running time and need not know.
  void on_step(Duration step) noexcept {
    if constexpr (requires { law_.on_step(step); }) law_.on_step(step);
  }

  [[nodiscard]] bool path_delay_known() const noexcept {
    return config_.fixed_path_delay.has_value() || delay_.known();
  }
  /// The law's, with the path delay as known now and offset_known: the law has been fed.
  [[nodiscard]] ServoSnapshot snapshot() const noexcept {
    ServoSnapshot snapshot = law_.snapshot();
    snapshot.offset_known = law_fed_;
    snapshot.path_delay = path_delay();
    return snapshot;
  }

 private:
  [[nodiscard]] Duration path_delay() const noexcept {
    return config_.fixed_path_delay.has_value() ? Duration{*config_.fixed_path_delay}
                                                : delay_.path_delay();
  }
  /// The stamp that the path delay is measured with. Not rate compensated means as linuxptp does
  /// it: on the steered clock, whatever was done to it in the meantime.
  [[nodiscard]] FreeRunningTime delay_stamp(const TimestampPair& pair) const noexcept {
    return config_.path_delay.rate_compensated ? pair.free_running
                                               : relabel<FreeRunningTime>(pair.local);
  }
  [[nodiscard]] SyncSample sample_of(const TimestampPair& pair) const noexcept {
    return {pair.reference, path_delay(), pair.local, pair.free_running};
  }

  [[nodiscard]] GateDecision judge(const TimestampPair& pair) noexcept {
    const bool rate_known = config_.path_delay.rate_compensated && delay_.rate_known();
    if (!config_.gate_enabled || !rate_known) return GateDecision::kAccept;
    const ReferenceTime predicted =
        accepted_.reference +
        scale(pair.free_running - accepted_.free_running, delay_.rate_ratio());
    return gate_.decide(predicted - pair.reference);  // positive: arrived late
  }

  ServoUpdate on_forward(const TimestampPair& pair, const ClockReading& now) noexcept {
    const GateDecision decision = judge(pair);
    if (decision == GateDecision::kReject) return {SampleVerdict::kRejected, false, {}};
    if (decision == GateDecision::kExit) {
      law_.reset();
      delay_.restart();
    }
    const TimestampPair previous = accepted_;
    accepted_ = pair;
    const bool was_known = path_delay_known();
    delay_.on_forward(pair.reference, delay_stamp(pair));
    if (!path_delay_known()) return {};
    if constexpr (requires { law_.prime(sample_of(previous)); }) {
      // A forward message makes the delay known only by completing an exchange with its
      // predecessor.
      if (!was_known) law_.prime(sample_of(previous));
    }
    law_fed_ = true;
    return law_.update(sample_of(pair), now);
  }

  ServoUpdate on_backward(const TimestampPair& pair) noexcept {
    if (config_.fixed_path_delay.has_value()) return {};
    switch (delay_.on_backward(delay_stamp(pair), pair.reference).verdict) {
      case PathDelayVerdict::kUsed:
      case PathDelayVerdict::kDeferred:
        return {};
      case PathDelayVerdict::kNoPartner:
        return {SampleVerdict::kRejected, false, {}};
      case PathDelayVerdict::kNegative:
      case PathDelayVerdict::kAbsurd:
        break;
    }
    return {SampleVerdict::kImplausible, false, {}};
  }

  TwoWayConfig config_;
  PathDelayEstimator delay_;
  OutlierGate gate_;
  Law law_;
  bool law_fed_ = false;
  TimestampPair accepted_{};  ///< newest forward message that was not rejected
};

}  // namespace ftcs
