// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// The four stamps of a two-way exchange, IEEE 1588-2019, 11.3 (paper Fig. 1). t1 and t4 are
/// corrected by the messages' correctionFields. `Timescale` is that of the receiver's stamps:
/// local, or free running.
///
/// With the delays d_rl (transmitter to receiver) and d_lr, the offset theta = local - reference,
/// and a receiver that runs at the reference's rate:
///
///     t2 = t1 + d_rl + theta,   t4 = t3 - theta + d_lr
///
/// Two equations, three unknowns: the difference of the delays cannot be told from an offset.
template <class Timescale>
struct BasicTwoWayExchange {
  ReferenceTime t1;       ///< Sync left the time transmitter
  Instant<Timescale> t2;  ///< Sync arrived
  Instant<Timescale> t3;  ///< Delay_Req left
  ReferenceTime t4;       ///< Delay_Req arrived at the time transmitter
};

using TwoWayExchange = BasicTwoWayExchange<LocalTimescale>;
using FreeRunningTwoWayExchange = BasicTwoWayExchange<FreeRunningTimescale>;

/// Mean path delay (d_rl + d_lr) / 2, IEEE 1588-2019, 11.3.2; paper eq. (2) corrected and
/// rate-compensated:
///
///     d = ((t4 - t1) - r (t3 - t2)) / 2,   r = rate of the reference in units of the clock that
///                                          took t2 and t3
///
/// In reference time; exact to 2^-32 ns but for the error of r: a turn-around of 100 ms on a clock
/// that is 50 ppm fast, with r left at 1, makes the delay 2.5 us wrong. Any stamps are taken;
/// noise, or stamps that belong to different exchanges, may make the result negative
/// (PathDelayEstimator refuses what is impossible).
template <class Timescale>
[[nodiscard]] constexpr Duration mean_path_delay(const BasicTwoWayExchange<Timescale>& exchange,
                                                 Rate reference_per_receiver = {}) noexcept {
  return (exchange.t4 - exchange.t1 - scale(exchange.t3 - exchange.t2, reference_per_receiver))
      .half();
}

/// Delay from the time transmitter to the receiver, IEEE 1588-2019, 7.4.2: t_ms = meanPathDelay +
/// delayAsymmetry. delayAsymmetry is positive when this direction is the slower one. It is half of
/// the difference of the two delays, and has to be known from elsewhere (calibration, lengths of
/// fibres): left out, it puts the local clock behind the reference by as much.
[[nodiscard]] constexpr Duration forward_delay(Duration mean_path_delay,
                                               Duration delay_asymmetry) noexcept {
  return mean_path_delay + delay_asymmetry;
}

/// What one exchange tells; the noise of four stamps is in it.
struct PathEstimate {
  Duration offset;           ///< local minus reference at t2
  Duration mean_path_delay;  ///< without the asymmetry
};

/// Offset and mean path delay of one exchange, paper eq. (1) and (2) corrected (as printed they do
/// not give what they say, docs/symbols.md): offset = t2 - t1 - (meanPathDelay + delayAsymmetry).
/// With r = 1 and no asymmetry that is ((t2 - t1) - (t4 - t3)) / 2.
///
///     estimate_path({.t1 = 0, .t2 = 150, .t3 = 1150, .t4 = 1100})   // in ns, shortened
///     offset 100, mean_path_delay 50
///
/// For a single exchange on a steered clock; a stream of messages is PathDelayEstimator's.
[[nodiscard]] constexpr PathEstimate estimate_path(const TwoWayExchange& exchange,
                                                   Duration delay_asymmetry = {},
                                                   Rate reference_per_local = {}) noexcept {
  const Duration mean = mean_path_delay(exchange, reference_per_local);
  return {offset_from_reference(exchange.t2, exchange.t1 + forward_delay(mean, delay_asymmetry)),
          mean};
}

}  // namespace ftcs
