// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/discipline/lock_detector.h"
#include "ftcs/measurement/outlier_gate.h"
#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/pics_servo.h"

namespace ftcs {

/// What follows the reference.
enum class CycleLaw : std::uint8_t {
  kNone,     ///< nothing: phase and lock are told
  kFtcs,     ///< eq. 25: k(n) from two samples, E removed in one interval outside B
  kPics,     ///< eq. 26: incremental PI
  kAdaptive  ///< the adaptive servo, at each cycle; nothing to tune
};

/// What a trigger is taken for when its cycle is compared with the reference.
enum class TriggerModel : std::uint8_t {
  kKnown,  ///< lateness and tick rounding are the sender's own: it knows them, they are no noise
  kIdeal,  ///< as the paper: as if it had fired at its virtual instant
};

/// A cycle and its servo. Above zero must be: cycle, resolution, cycles_per_sync; not below zero:
/// gates, gains (offset_gain at most 1); limits.valid(). BasicCycleServo does not check.
struct CycleServoConfig {
  CycleLaw law = CycleLaw::kFtcs;
  Nanoseconds cycle{1'000'000};  ///< in reference time; above zero
  /// Triggers shall come so long after the whole multiples of the cycle in reference time: the
  /// phase is the same after each start.
  Nanoseconds shift{0};
  Nanoseconds resolution{1};  ///< of the timer; 10 us is the paper's; above zero
  /// FTCS and PICS take one sample in so many cycles (the paper's T_sync); the adaptive servo all.
  std::uint32_t cycles_per_sync = 500;
  double offset_gain = 1.0 / 16.0;  ///< FTCS: p inside the band
  /// FTCS: B. The paper's 20 us are two ticks of its timer. Here the tick is known and the stamps
  /// scatter by less than 1 us: whatever is further off than 5 us is no noise, and eq. 18 removes
  /// in one interval what p inside the band would trickle away.
  ConvergedBand band{Nanoseconds{5'000}, Nanoseconds{5'000}};
  std::uint32_t converged_dwell = 1;  ///< FTCS: samples within B before p is offset_gain
  /// PICS: k_p and k_i of eq. 26 times the cycles per interval. 1 and 1 is deadbeat.
  double proportional_gain = 1.0;
  double integral_gain = 1.0;
  /// F. A hundredth is far beyond any crystal; it bounds how the cycle is bent to remove a phase.
  RateLimits limits = RateLimits::symmetric_ppb(1e7);
  /// What the steered clock runs at before the first command, per host time: a crystal known from
  /// before.
  Rate initial_rate{};
  /// From the stamp `sent` to the latch at the reference: known wiring, stamping point.
  Nanoseconds transit{0};
  /// Gates: a cycle that was later, or a frame that took longer, is coasted over. Zero: no gate.
  Nanoseconds largest_lateness{200'000};
  Nanoseconds largest_round_trip{200'000};
  /// One stamp of a busy host in two hundred is ten or forty microseconds off, with a round trip
  /// like the others'. Where it would be half of a k(n), or break a lock, the next cycle is asked;
  /// five in a row are the truth.
  OutlierGateConfig outliers{};
  LockConfig lock{{Nanoseconds{5'000}, Nanoseconds{20'000}}, 20};
  /// Cycles without a usable sample before a lock is called lost.
  std::uint32_t coast_limit = 2000;
  /// True: the first sample moves the trigger onto its phase. False: the phase is removed by the
  /// servo (a cycle is never bent by more than F).
  bool align_at_start = true;
  TriggerModel trigger = TriggerModel::kKnown;
};

/// What is known about one cycle. Times of the host are readings of one clock that nobody steers
/// (FreeRunningTime): the one that the wake-up uses.
struct CycleSample {
  bool has_reference = false;  ///< false: the frame was lost
  ReferenceTime reference;     ///< 0x0910, latched when the frame passed; 64 bits, no wrap
  FreeRunningTime sent;        ///< as close to the wire as there is a stamp; always set
  bool has_received = false;   ///< false: no frame is called slow
  FreeRunningTime received;
  /// The wake-up of the cycle that sent the frame, where that is not the latest one: loops that
  /// take a frame back when the next cycle begins.
  bool has_scheduled = false;
  FreeRunningTime scheduled;
};

/// How the cycle stands to its reference.
enum class CycleState : std::uint8_t {
  kWaiting,    ///< no reference time yet
  kAcquiring,  ///< not yet in phase, or not yet long enough
  kLocked,
  kCoasting,  ///< was locked; no usable sample for coast_limit cycles
};

/// What became of the last sample; only kUsed reaches law and lock (kDoubtful the adaptive law too,
/// which weighs for itself).
///
/// A single verdict other than kUsed does no harm: the cycle goes on at the last rate. Many of one
/// kind are a set-up to be looked at: kLost the cable, kLate the host's scheduling, kSlow the
/// network adapter, kImpossible a reference that somebody sets, kDoubtful the stamps.
enum class CycleVerdict : std::uint8_t {
  kUsed,        ///< phase known
  kLost,        ///< no reference time
  kLate,        ///< gated by the lateness of the sender
  kSlow,        ///< gated by the round trip
  kImpossible,  ///< the reference jumped or went backward
  kDoubtful,    ///< phase known, but alone among its neighbours: no law and no lock hears it
};

/// What comes of a cycle. phase_error is that of the last good sample, where this one is none.
struct CycleDecision {
  FreeRunningTime wake;             ///< of the next trigger, on the timer's grid
  FreeRunningTime virtual_instant;  ///< where it would be without the grid
  CycleState state = CycleState::kWaiting;
  CycleVerdict verdict = CycleVerdict::kLost;
  /// E of eq. 25: positive when the cycle comes early. Of the virtual trigger (kKnown).
  Duration phase_error{};
  Duration lateness{};        ///< of this frame against its trigger: sent minus scheduled
  Rate rate;                  ///< reference per host time that is being followed; 1 until commanded
  bool commanded = false;     ///< the law acted
  std::uint64_t skipped = 0;  ///< cycles that a stall passed over
};

/// Since construction, a cycle each but for the last two.
struct CycleServoCounters {
  std::uint64_t cycles = 0;
  std::uint64_t used = 0;
  std::uint64_t lost = 0;
  std::uint64_t late = 0;
  std::uint64_t slow = 0;
  std::uint64_t impossible = 0;
  std::uint64_t doubtful = 0;
  std::uint64_t skipped = 0;
  std::uint64_t resyncs = 0;  ///< the phase had to be found anew
};

}  // namespace ftcs
