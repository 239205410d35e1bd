// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/servo/servo.h"
#include "ftcs/sim/oscillator.h"
#include "ftcs/sim/quantiser.h"
#include "ftcs/sim/random.h"
#include "ftcs/sim/settable_source.h"
#include "ftcs/time/relabel.h"

namespace ftcs::sim {

/// The paper's Section IV: the reference sends its time every interval over a path whose delay is
/// known, and the receive timestamp carries white noise. The reference is true time.
struct OneWaySpec {
  Duration interval = Nanoseconds{100'000};
  OscillatorSpec oscillator;
  Duration initial_offset{};        ///< local minus reference at true time 0
  double timestamp_noise_ns = 0.0;  ///< standard deviation, gaussian
  Duration tick = Nanoseconds{1};   ///< granularity of the receive timestamp
  RateLimits limits{};              ///< of the clock
  std::uint64_t samples = 0;
};

/// What happened at one sample instant.
struct OneWaySample {
  std::uint64_t index = 0;
  double perceived_offset_ns = 0.0;  ///< local minus reference as the servo saw it
  double time_error_ns = 0.0;        ///< local minus reference in truth
  bool acted = false;                ///< the servo commanded the clock at this sample
  Rate rate;  ///< commanded correction rate, local per free running; 1 if it did not act
};

/// Runs a control law on a virtual clock, one sample after the other; memory does not depend on the
/// length.
///
///   F_n = F(n T + N(n)), cut to the tick;  sample = (n T, local_at(F_n), F_n);  command applied at
///   F(n T)
///
/// `law` has update(const SyncSample&, const ClockReading&), as any ControlLaw; `observe` is called
/// with a OneWaySample.
template <class Law, class Observer>
void run_one_way(const OneWaySpec& spec, std::uint64_t seed, Law& law, Observer&& observe) {
  Oscillator oscillator(spec.oscillator, seed);
  RandomStream noise(seed, "timestamp noise");
  const Quantiser quantise(spec.tick);
  SettableSource source;
  const LocalTime start{spec.initial_offset};
  VirtualClock clock(source, {oscillator.reading_at(TrueTime{}), start, Rate{}, spec.limits});

  TrueTime now{};
  for (std::uint64_t index = 0; index < spec.samples; ++index, now = now + spec.interval) {
    const auto [reading, rate] = oscillator.state_at(now);
    source.set(reading);
    const ClockReading truth{reading, clock.local_at(reading)};
    const auto reference = relabel<ReferenceTime>(now);
    // The noise is a length of true time (it stands for delay), so the oscillator stretches it.
    const double noise_ns = spec.timestamp_noise_ns * noise.normal();
    const FreeRunningTime stamp = quantise(reading + Duration::from_ns(noise_ns * rate.ratio()));
    const SyncSample sample{reference, Duration{}, clock.local_at(stamp), stamp};
    const ServoUpdate update = law.update(sample, truth);
    OneWaySample seen{index, sample.offset().ns(),
                      offset_from_reference(truth.local, reference).ns(), false, Rate{}};
    if (update.has_command) {
      seen.acted = clock.apply_at(reading, update.command).ok();
      seen.rate = update.command.correction_rate;
    }
    observe(seen);
  }
}

}  // namespace ftcs::sim
