// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "ftcs/estimation/estimator.h"
#include "ftcs/estimation/floor_estimator.h"
#include "ftcs/estimation/lucky_level.h"

namespace ftcs::estimation {

/// Two pictures of the same path, and the one that predicts better is believed:
///
/// - every message is the delay and noise around it, outliers apart
///   (Estimator);
/// - some messages wait for nothing and all others are late by any amount
///   (FloorEstimator), once a floor has been found.
///
/// The choice is a cumulative sum (Page) over the messages of
///
///     ln [(w N + (1 - w)(q T + (1 - q) p)) / p]
///
/// p the density by the first picture, w N and T the floor and the waits by the
/// second, q the part of the waits that the learnt T explains better than p
/// does: whether there is a floor where the second picture says is tested
/// *beside* whatever the first predicts, so that the shapes of tails do not
/// decide. A message that is early for the floor, and none of the first picture's outliers, has
/// its outliers for T and nothing of p beside them: no wait makes a message early. w by a long and
/// by a short memory, the better one: a load that changes must not cost the floor.
///
/// To the outside it is an Estimator, with the same functions and units; which
/// picture answers is told by follows_floor() (decision 0020).
template <class Grid>
class LoadAwareEstimator {
 public:
  explicit LoadAwareEstimator(const KnownDelay& delay = {}) noexcept : plain_(delay) {}
  // As Estimator's, of the same names.
  void restart() noexcept {
    plain_.restart();
    forget_floor();
  }
  void expect(const RatePrior& rate, double noise_ns) noexcept { plain_.expect(rate, noise_ns); }
  void expect_noise_of_at_least(double noise_ns) noexcept {
    plain_.expect_noise_of_at_least(noise_ns);
    floor_.expect_noise_of_at_least(noise_ns);
  }
  void free_delay(double sigma_ns) noexcept { plain_.free_delay(sigma_ns); }
  void fix_delay() noexcept { plain_.fix_delay(); }

  /// Returns the probability that the message is no outlier.
  double update(const Observation& seen) noexcept;

  /// The floor is followed.
  [[nodiscard]] bool follows_floor() const noexcept { return believed_; }
  [[nodiscard]] const Estimate& estimate() const noexcept {
    return believed_ ? floor_.estimate() : plain_.estimate();
  }
  [[nodiscard]] double scale() const noexcept {
    return believed_ ? floor_.scale() : plain_.scale();
  }
  [[nodiscard]] double offset_sigma_ns(double cycles) const noexcept {
    return believed_ ? floor_.offset_sigma_ns(cycles) : plain_.offset_sigma_ns(cycles);
  }
  [[nodiscard]] double rate_sigma_ns() const noexcept {
    return believed_ ? floor_.rate_sigma_ns() : plain_.rate_sigma_ns();
  }
  [[nodiscard]] double delay_sigma_ns() const noexcept {
    return believed_ ? floor_.delay_sigma_ns() : plain_.delay_sigma_ns();
  }
  [[nodiscard]] double noise_ns(Direction direction) const noexcept {
    return believed_ ? floor_.noise_ns(direction) : plain_.noise_ns(direction);
  }
  [[nodiscard]] double gain() const noexcept { return believed_ ? floor_.gain() : plain_.gain(); }
  [[nodiscard]] KnownDelay known_delay() const noexcept { return plain_.known_delay(); }
  [[nodiscard]] bool two_way() const noexcept { return plain_.two_way(); }
  [[nodiscard]] std::uint32_t count() const noexcept { return plain_.count(); }
  void rescale_time(double factor) noexcept {
    plain_.rescale_time(factor);
    floor_.rescale_time(factor);
  }
  void shift_offset(double shift_ns) noexcept {
    plain_.shift_offset(shift_ns);
    floor_.shift_offset(shift_ns);
  }

 private:
  void forget_floor() noexcept;
  [[nodiscard]] double plain_noise_ns() const noexcept;
  [[nodiscard]] double bare_sigma_ns() const noexcept;
  [[nodiscard]] double apart_ns(double ahead = 0.0) const noexcept;
  [[nodiscard]] double believed_credit(double own) const noexcept;
  [[nodiscard]] double give_up(const Observation& seen) noexcept;
  [[nodiscard]] bool agree() const noexcept;
  [[nodiscard]] bool impossible() const noexcept;
  [[nodiscard]] bool begins_to_wait(double credit) noexcept;
  [[nodiscard]] bool start_floor(double wait) noexcept;
  [[nodiscard]] bool finds_lucky(Direction direction, double credit) noexcept;
  void compare(double credit, double own, bool anew) noexcept;
  void doubt_floor() noexcept;
  [[nodiscard]] bool welcome() noexcept;
  void follow_lead(Direction direction, bool explains) noexcept;
  [[nodiscard]] double lead() const noexcept { return std::max(lead_, recent_lead_); }

  Estimator<Grid> plain_;
  FloorEstimator floor_{};
  LuckyLevel lucky_{};
  double lead_ = 0.0;         ///< nats, w by its long memory
  double recent_lead_ = 0.0;  ///< by its short one
  /// q: a density that has learnt nothing yet says little.
  PerDirection<double> learnt_part_{kNowAndThen, kNowAndThen};
  double contest_ = 0.0;       ///< nats by which the first picture leads while the two contradict
  std::uint8_t late_ = 0;      ///< messages for which a late one is remembered
  std::uint8_t given_up_ = 0;  ///< messages in a row at which the first picture gave up
  bool believed_ = false;
  bool together_ = false;  ///< both pictures said the same at the last message
};

extern template class LoadAwareEstimator<FullGrid>;

}  // namespace ftcs::estimation
