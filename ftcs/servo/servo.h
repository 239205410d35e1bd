// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "ftcs/time/servo_command.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs {

/// What a servo is doing. linuxptp's users know these as s0, s1 and s2; s3 is not used.
enum class ServoState : std::uint8_t {
  kUnlocked,  ///< s0: collecting, no command yet
  kJump,      ///< s1: this command steps the clock
  kLocked,    ///< s2: steering
  kHoldover,  ///< samples stopped; the last good rate is kept
};

/// What became of the message that was fed.
enum class SampleVerdict : std::uint8_t {
  kUsed,
  kRejected,    ///< taken for an outlier, or alone (no exchange holds it): it never steers
  kDuplicate,   ///< not newer than its predecessor
  kImplausible  ///< time went backward, absurd delay or interval
};

/// What a servo believes: small, plain, copied by the one thread that owns the servo. Not known =
/// not a number; a Duration is then zero and a Rate 1. Standard deviations are one sigma; servos
/// that filter state them, a classic servo leaves them unknown.
struct ServoSnapshot {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  ServoState state = ServoState::kUnlocked;
  bool offset_known = false;  ///< a path delay and a sample are there: offset means something
  Duration offset{};      ///< latest offset, local minus reference: perceived by classic servos,
                          ///< filtered by others
  Duration path_delay{};  ///< latest mean path delay
  Rate rate_ratio;        ///< reference per free running: k(n) a_l(n), the rate that tracks
  double offset_gain = kUnknown;  ///< effective p of the latest command
  double offset_sigma_ns =
      kUnknown;                      ///< honest standard deviation of offset, if the servo knows it
  double rate_sigma_ppb = kUnknown;  ///< of rate_ratio
  double path_delay_sigma_ns = kUnknown;  ///< of path_delay; an asymmetry is in nobody's sigma
  double timestamp_noise_ns = kUnknown;   ///< learnt noise of one timestamp
};

/// What a servo makes of one message. `command` means something only where has_command is true;
/// then it replaces the last one entirely (ServoCommand).
struct ServoUpdate {
  SampleVerdict verdict = SampleVerdict::kUsed;
  bool has_command = false;  ///< a backward message or a rejected one usually commands nothing
  ServoCommand command{};
};

/// A control law driven by offsets: FTCS (Table 1), PICS (eq. 26), the linuxptp-compatible PI. A
/// value: no heap, no I/O, no logging, deterministic. `now` is the clock at the moment the command
/// will be applied, so that what the clock did between sample and command (8,000 ppm over a few ms
/// is microseconds) is known.
///
///     struct Integrator {                       // examples/02_your_own_servo.cpp, shortened
///       struct Config {};
///       explicit Integrator(const Config&) noexcept {}
///       ServoUpdate update(const SyncSample& sample, const ClockReading&) noexcept {
///         ppb -= sample.offset().ns() / 8.0;    // ns removed in 8 s are ppb
///         const Rate pull = Rate::from_ppb(ppb - sample.offset().ns() / 2.0);
///         return {.has_command = true, .command = {pull, Duration{1s}, Rate::from_ppb(ppb), {}}};
///       }
///       void reset() noexcept { ppb = 0.0; }
///       ServoSnapshot snapshot() const noexcept { return {}; }
///       double ppb = 0.0;
///     };
///
/// What a law must bear: a sample that is repeated or late (kDuplicate; nothing may change), clocks
/// that went backward or jumped (kImplausible), gaps of any length. What it need not do: keep to
/// the clock's limits (whoever applies the command cuts it), end its own correction, measure the
/// path delay. update() may run in a cycle of 100 us: its work is bounded and does not grow with
/// time.
///
/// Two functions are optional, and used where they are there: prime(sample), a sample from before
/// the path delay was known; on_step(step), the clock was stepped by somebody else.
template <class S>
concept ControlLaw = std::is_trivially_copyable_v<S> &&
    std::is_trivially_copyable_v<typename S::Config> &&
    requires(S law, const S& observed, const SyncSample& sample, const ClockReading& now) {
  { law.update(sample, now) }
  noexcept->std::same_as<ServoUpdate>;
  { law.reset() }
  noexcept->std::same_as<void>;
  { observed.snapshot() }
  noexcept->std::same_as<ServoSnapshot>;
};

/// A whole servo: timestamp pairs of either direction in, commands out. TwoWayServo makes one of
/// any ControlLaw (path-delay filter and gate in front); the adaptive servo is one by itself.
/// Everything above a servo (BasicClockDiscipline, the nodes) takes any type of this concept.
///
/// Pairs come as they become known: backward ones later than forward ones that were sent after
/// them, both directions at any ratio, none for any time. Each is news for its direction: who has
/// no discipline asks that by InOrder (in_order.h). A servo states its verdict on each, and
/// mostly commands on forward ones; the adaptive servo commands on both.
///
/// Optional: on_step(step), as above; on_new_epoch(), a clock was set back, and what was measured
/// before is void (without it: reset()); snapshot_at(now), what it believes at a later moment, with
/// the deviation grown until then; free_path_delay(sigma_ns), the delay that was given is to be
/// estimated from now on; path_delay_known(), for a servo that may hear an answer and not know the
/// delay yet.
template <class S>
concept ClockServo = std::is_trivially_copyable_v<S> &&
    requires(S servo, const S& observed, const TimestampPair& pair, const ClockReading& now) {
  { servo.update(pair, now) }
  noexcept->std::same_as<ServoUpdate>;
  { servo.reset() }
  noexcept->std::same_as<void>;  // a new reference: everything learnt about it is void
  { observed.snapshot() }
  noexcept->std::same_as<ServoSnapshot>;
};

}  // namespace ftcs
