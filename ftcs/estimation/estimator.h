// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/change_detector.h"
#include "ftcs/estimation/delay_shape.h"
#include "ftcs/estimation/early_messages.h"
#include "ftcs/estimation/evidence.h"
#include "ftcs/estimation/gate.h"
#include "ftcs/estimation/jump_watch.h"
#include "ftcs/estimation/lateness.h"
#include "ftcs/estimation/model_bank.h"
#include "ftcs/estimation/noise_learner.h"
#include "ftcs/estimation/second_opinion.h"
#include "ftcs/estimation/sorted_window.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::estimation {

/// A path delay that is known otherwise (peer delay, wiring). Unknown: sigma_ns
/// is negative.
struct KnownDelay {
  double mean_ns = 0.0;
  double sigma_ns = -1.0;
  [[nodiscard]] bool known() const noexcept { return sigma_ns >= 0.0; }
};

/// What is known of the rate before the first message, ns per cycle.
struct RatePrior {
  double mean = 0.0;
  double sigma = 0.0;
};

/// Joint estimate of offset, rate and path delay of the free-running clock
/// against the reference: the bank, its evidence, what is learnt about noise,
/// and the detection of changes. Multiple-model adaptive estimation (Magill,
/// IEEE Trans. AC-10, 1965); the parts and their sources: docs/adaptive-servo.md.
///
///     z = x + sign (d + n),   x += y t,   mean over models i under weights exp(-c_i / 2)
///
/// Units throughout: x, d in ns; y in ns per cycle; time in cycles of one sync
/// interval; covariances in units of s^2, s = scale() the noise of one
/// timestamp. The caller forms z and keeps |z| so small that a double resolves
/// it (below 2^40 ns). One that is not finite breaks every filter: all is begun
/// anew, and update() returns 0.
///
///     Estimator<FullGrid> estimator;
///     const double credit = estimator.update({.sign = +1.0, .elapsed = 1.0, .z = z});
///     estimator.estimate().x;          // ns, at the event of this message
///     estimator.offset_sigma_ns(2.5);  // two and a half cycles later
///
/// The offset and the delay are told apart by messages of both directions
/// alone; before, or with a known delay, d is held. A value: no heap, bounded
/// work; kilobytes, to be made in place.
template <class Grid>
class Estimator {
 public:
  explicit Estimator(const KnownDelay& delay = {}) noexcept : known_delay_(delay) {}
  /// Forgets everything but what is known of the delay, in place: a temporary
  /// would be kilobytes of stack.
  void restart() noexcept;

  /// Before the first message: a rate and a timestamp noise (ns) to start from.
  /// The noise is a start as any other; the rate counts as much as its sigma
  /// says.
  void expect(const RatePrior& rate, double noise_ns) noexcept;

  /// No noise is smaller than this, ns: what rounds the timestamps makes some.
  void expect_noise_of_at_least(double noise_ns) noexcept { least_noise_ = noise_ns; }

  /// Begins anew on a path of which both directions have been heard, with what
  /// is known elsewhere at the last message; covariances in units of scale_ns^2.
  void resume(const Estimate& known, double scale_ns) noexcept;

  /// The delay that was known is estimated from now on, from what it was, give
  /// or take sigma_ns: messages of the other direction will come.
  void free_delay(double sigma_ns) noexcept;
  /// It is known again. Before the first message only.
  void fix_delay() noexcept { delay_freed_ = false; }

  /// One message, in the order in which they become known; seen.elapsed may be
  /// negative. Returns the probability that the message is no outlier. Where it
  /// gives up what it believed, count() is 0 afterwards: the caller may begin
  /// with another base and give the same message again.
  double update(const Observation& seen) noexcept;

  /// At the event of the last message; covariances in units of scale()^2.
  [[nodiscard]] const Estimate& estimate() const noexcept { return mixed_; }
  /// s: noise of one timestamp, ns.
  [[nodiscard]] double scale() const noexcept { return scale_; }
  /// ln density that the best model gave the last message, outliers included.
  [[nodiscard]] double log_density() const noexcept { return static_cast<double>(said_); }
  /// By how much the last message was late, ns, as the best model saw it.
  [[nodiscard]] double innovation_ns() const noexcept { return static_cast<double>(innovation_); }
  /// Nothing has changed for long, and the noise of both directions is learnt.
  [[nodiscard]] bool settled() const noexcept;
  [[nodiscard]] const ModelBank<Grid>& bank() const noexcept { return bank_; }
  [[nodiscard]] const Evidence<Grid>& evidence() const noexcept { return evidence_; }
  /// Honest standard deviation of the offset `cycles` after the last message,
  /// ns: what the filters believe, grown by the process noise that they cannot
  /// exclude, what the last message shows beyond noise, and what the shape of the
  /// delay noise leaves open.
  [[nodiscard]] double offset_sigma_ns(double cycles) const noexcept;
  /// Of the rate, ns per cycle, and of the path delay, ns, at the last message.
  [[nodiscard]] double rate_sigma_ns() const noexcept;
  [[nodiscard]] double delay_sigma_ns() const noexcept;
  /// Noise of one timestamp of the given direction, ns.
  [[nodiscard]] double noise_ns(Direction direction) const noexcept;
  /// Of the worse direction, ns.
  [[nodiscard]] double spread_ns() const noexcept {
    return std::max(noise_ns(Direction::kForward), noise_ns(Direction::kBackward));
  }
  [[nodiscard]] KnownDelay known_delay() const noexcept {
    return delay_freed_ ? KnownDelay{} : known_delay_;
  }
  /// A delay was given at first: what is estimated since is the difference to it, of either sign.
  [[nodiscard]] bool delay_was_known() const noexcept { return known_delay_.known(); }
  /// Messages of both directions have come.
  [[nodiscard]] bool two_way() const noexcept { return seen_[0] && seen_[1]; }
  /// Messages since the last start.
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// Gain of the last raw innovation on the offset: the effective p.
  [[nodiscard]] double gain() const noexcept { return static_cast<double>(gain_); }
  /// The unit of time becomes `factor` times as long.
  void rescale_time(double factor) noexcept;
  /// Every offset, past ones included, grows by `shift_ns`.
  void shift_offset(double shift_ns) noexcept;

 private:
  using Bank = ModelBank<Grid>;
  using Row = typename Bank::Row;
  using Innovations = typename Bank::Innovations;
  static constexpr std::size_t kSize = Grid::kSize;

  double step(const Observation& seen) noexcept;
  void heed(const Observation& seen, const Innovations& innovations) noexcept;
  void learn_noise(std::size_t side, double innovation, const Innovations& innovations) noexcept;
  void begin(std::size_t side) noexcept;
  void connect_second_direction(std::size_t side) noexcept;
  void unpin_delay(double first_sign, double variance) noexcept;
  void detect_changes(const Row& log_density, const ChangeTrust& trust) noexcept;
  [[nodiscard]] bool follow_gate(std::size_t side, double credit, double innovation) noexcept;
  void hear_again(const Observation& seen, const OutlierPrior& outliers) noexcept;
  void choose() noexcept;
  [[nodiscard]] double edge_bias_ns(std::size_t side) const noexcept;
  void mix() noexcept;
  void follow_scale() noexcept;
  void adopt_shapes() noexcept;
  void doubt_delay() noexcept;
  void seek_second_opinion(const Observation& seen, double innovation) noexcept;
  void begin_anew(const Estimate& start) noexcept;
  void start_again(const FreshFit& fit) noexcept;
  [[nodiscard]] bool observable() const noexcept;
  /// The path delay is estimated, not given or pinned.
  [[nodiscard]] bool delay_free() const noexcept { return two_way() && !known_delay().known(); }
  void follow_surprise(std::size_t side, const Innovations& innovations) noexcept;
  [[nodiscard]] double floor_doubt_ns() const noexcept;

  KnownDelay known_delay_{};
  Bank bank_{};
  ChangeDetector<Grid> detector_{};
  std::conditional_t<Grid::kWatchesJumps, JumpWatch, NoJumpWatch> jumps_{};
  Lateness lateness_{};
  std::conditional_t<Grid::kWatchesJumps, EarlyMessages, NoEarlyMessages> early_{};
  std::array<NoiseLearner<Grid::kNoiseWindow>, 2> learner_{};
  std::array<DelayShape, 2> shape_{};
  std::array<bool, 2> seen_{};
  std::uint8_t wild_ = 0;  ///< messages in a row with one of the wildest models believed
  Gate gate_{};
  SortedWindow<Grid::kResidualWindow> residuals_{};
  SecondOpinion<Grid::kOpinionWindow> second_opinion_{};

  Evidence<Grid> evidence_{};
  Row weight_{};
  std::size_t best_ = Grid::kStart;
  std::uint32_t count_ = 0;
  std::uint32_t since_change_ = 0;
  bool diverged_ = false;
  bool delay_freed_ = false;
  bool pinned_ = false;        ///< one direction alone has been heard, and its delay is not known
  std::uint8_t surprise_ = 0;  ///< messages for which the second opinion is still sought
  float said_ = 0.0F;          ///< ln density of the last message
  double scale_ = 100.0;
  double robust_scale_ = 100.0;
  double least_noise_ = kLeastNoise;
  float gain_ = 1.0F;
  float innovation_ = 0.0F;   ///< of the last message
  double unexplained_ = 0.0;  ///< ns^2, of the last innovation squared
  NoiseModel process_{};      ///< mean of the models' noise as far as it is in doubt
  Estimate mixed_{};
};

}  // namespace ftcs::estimation
