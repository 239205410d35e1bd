// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/estimation/floor_record.h"
#include "ftcs/estimation/model_bank.h"

namespace ftcs::estimation {

/// Density of the delay of one direction above its floor, as a fit of few
/// messages can know it:
///
///     p(nu) = w N(nu; 0, sigma^2) + (1 - w) (0.9 Exp(nu; tau) + 0.1 U(nu))      nu > 0
///
/// w is the share of messages that wait for nothing, tau the mean wait of the
/// others, U log-uniform over e^10. Early (nu < 0) there is 1e-5 U in place of
/// the waits.
struct FloorNoise {
  double share = 0.5;
  double sigma = 0.0;      ///< ns
  double mean_wait = 0.0;  ///< ns

  /// Probability that the message is at the floor; writes its density, 1/ns.
  [[nodiscard]] double at_floor(double nu, double& density) const noexcept;
};

/// A line through the floor of both directions' delays.
struct FloorFit {
  bool found = false;      ///< enough messages, sharp, lasting: what follows is valid
  bool has_rate = false;   ///< estimate.y at least is worth something
  float mean_wait = 0.0F;  ///< ns, of both directions together
  Estimate estimate{};     ///< at `now` of the windows; covariances in units of sigma^2
  double drift = 0.0;      ///< of the rate, ns per cycle^2; 0: a line fits as well
  PerDirection<FloorNoise> noise{};
  PerDirection<double> members{};  ///< messages at the floor
  /// Nats by which the floor explains the messages of one direction better than waits without one
  /// do; what the choice of the unknowns is worth is taken off: of its level from each, and of the
  /// rate and its drift, which both share, from the one that says more. Where both have waits it is
  /// the mean of both, and at most twice that of the direction that has less; one that has none
  /// needs no proof, and has told the rate.
  double evidence = 0.0;
  double log_likelihood = 0.0;  ///< of all messages
  double said = 0.0;            ///< the same by the filters that heard them

  [[nodiscard]] double sigma() const noexcept { return noise.forward.sigma; }
  /// ns, `time` cycles from `now`.
  [[nodiscard]] double offset_at(double time) const noexcept {
    return estimate.x + (estimate.y + 0.5 * drift * time) * time;
  }
  /// Time passes, cycles.
  void elapse(double time) noexcept {
    const double x = offset_at(time);
    estimate.elapse(time, {});
    estimate.x = x;
    estimate.y += drift * time;
  }
  /// Standard deviation of the offset, ns.
  [[nodiscard]] double offset_sigma_ns() const noexcept;
  /// Hardly any message of this direction is late: its floor needs no proof.
  [[nodiscard]] bool clear(Direction direction) const noexcept;
};

/// Finds offset, rate and delay where messages queue, without any memory: the
/// messages that waited for nothing lie on one line in each direction, and
/// nothing lies before it.
///
/// 1. Lines of one rate that touch both directions from below (touching_lines.h).
/// 2. From the messages' heights above them a first level, noise and mean wait.
/// 3. Expectation and maximisation (Dempster, Laird and Rubin, 1977) of line, sigma, shares and one
///    mean wait of both directions under FloorNoise.
/// 4. The same with a drift of the rate, since the oscillator wanders while a floor is looked for
///    that few messages reach. It is taken where the floor is then more evident, and where it moves
///    the line by less than messages wait: more is no wander that a line all but fits.
/// 5. A mean wait for each direction, where they differ beyond chance: ports of 1 Gbit/s and 100
///    Mbit/s lie on one path. (The line is found before: two scales more let it settle anywhere.)
///
/// `least_noise`: no sigma is smaller, ns. found is false where the windows
/// hold too few messages, or no line is sharp enough.
[[nodiscard]] FloorFit fit_floor(const PerDirection<RecordWindow>& windows,
                                 double least_noise) noexcept;

}  // namespace ftcs::estimation
