// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/time/instant.h"
#include "ftcs/time/rate.h"

namespace ftcs {

/// The four stamps of a two-way exchange, IEEE 1588-2019, 11.3 (paper Fig. 1). t1 and t4 are
/// corrected by the messages' correctionFields. `Timescale` is that of the receiver's stamps:
/// local, or free running.
template <class Timescale>
struct BasicTwoWayExchange {
  ReferenceTime t1;       ///< Sync left the time transmitter
  Instant<Timescale> t2;  ///< Sync arrived
  Instant<Timescale> t3;  ///< Delay_Req left
  ReferenceTime t4;       ///< Delay_Req arrived at the time transmitter
};

using TwoWayExchange = BasicTwoWayExchange<LocalTimescale>;
using FreeRunningTwoWayExchange = BasicTwoWayExchange<FreeRunningTimescale>;

/// Mean path delay, paper eq. (2) corrected and rate-compensated:
///   d = ((t4 - t1) - r (t3 - t2)) / 2,   r = rate of the reference in units of the clock that took
///   t2 and t3.
/// Without r, a turn-around of 100 ms on a clock that is 50 ppm fast makes the delay 2.5 us wrong.
template <class Timescale>
[[nodiscard]] constexpr Duration mean_path_delay(const BasicTwoWayExchange<Timescale>& exchange,
                                                 Rate reference_per_receiver = {}) noexcept {
  return (exchange.t4 - exchange.t1 - scale(exchange.t3 - exchange.t2, reference_per_receiver))
      .half();
}

/// Delay from the time transmitter to the receiver, IEEE 1588-2019, 7.4.2: t_ms = meanPathDelay +
/// delayAsymmetry. delayAsymmetry is positive when this direction is the slower one.
[[nodiscard]] constexpr Duration forward_delay(Duration mean_path_delay,
                                               Duration delay_asymmetry) noexcept {
  return mean_path_delay + delay_asymmetry;
}

struct PathEstimate {
  Duration offset;           ///< local minus reference at t2
  Duration mean_path_delay;  ///< without the asymmetry
};

/// Offset and mean path delay of one exchange, paper eq. (1) and (2) corrected (as printed they do
/// not give what they say): offset = t2 - t1 - (meanPathDelay + delayAsymmetry). With r = 1 and no
/// asymmetry that is
/// ((t2 - t1) - (t4 - t3)) / 2.
[[nodiscard]] constexpr PathEstimate estimate_path(const TwoWayExchange& exchange,
                                                   Duration delay_asymmetry = {},
                                                   Rate reference_per_local = {}) noexcept {
  const Duration mean = mean_path_delay(exchange, reference_per_local);
  return {offset_from_reference(exchange.t2, exchange.t1 + forward_delay(mean, delay_asymmetry)),
          mean};
}

}  // namespace ftcs
