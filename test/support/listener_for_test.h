// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/estimation/load_aware_estimator.h"
#include "test/support/loaded_path.h"

namespace ftcs::estimation {

/// Feeds an estimator as the servo does.
template <class Heard>
class ListenerTo {
 public:
  explicit ListenerTo(const test::LoadedPath& path, const KnownDelay& delay = {})
      : estimator_(delay), delay_(delay.mean_ns), interval_(path.interval_ns()) {
    estimator_.expect_noise_of_at_least(0.4);
  }
  void hear(const test::PathMessage& message) {
    (void)estimator_.update(observe(message));
    if (estimator_.count() > 0) return;
    started_ = false;  // it has given up: this message is the first
    (void)estimator_.update(observe(message));
  }
  [[nodiscard]] double offset_ns(double now) const {
    const Estimate& e = estimator_.estimate();
    return base_ + e.x + e.y * (now - time_) / interval_;
  }
  [[nodiscard]] const Heard& estimator() const { return estimator_; }
  [[nodiscard]] double sigma_ns(double now) const {
    return estimator_.offset_sigma_ns((now - time_) / interval_);
  }

 private:
  Observation observe(const test::PathMessage& message) {
    if (!started_) base_ = message.reading;
    const double time = message.time_ns + sign_of(message.direction) * delay_;
    const double elapsed = started_ ? (time - time_) / interval_ : 0.0;
    started_ = true;
    time_ = time;
    return {sign_of(message.direction), elapsed, message.reading - base_};
  }

  Heard estimator_;
  double delay_;
  double interval_;
  double base_ = 0.0;
  double time_ = 0.0;
  bool started_ = false;
};

using Listener = ListenerTo<LoadAwareEstimator<FullGrid>>;

}  // namespace ftcs::estimation
