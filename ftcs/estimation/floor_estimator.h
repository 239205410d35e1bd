// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/change_detector.h"
#include "ftcs/estimation/evidence.h"
#include "ftcs/estimation/floor_search.h"
#include "ftcs/estimation/jump_watch.h"
#include "ftcs/estimation/model_bank.h"
#include "ftcs/estimation/quick_math.h"
#include "ftcs/estimation/wait_density.h"

namespace ftcs::estimation {

/// Offset, rate and delay where messages queue: a bank of Kalman filters under
/// a density with an atom. Of the messages of each direction a share w waits
/// for nothing and is known to r ns; the others wait, and how long is learnt:
///
///     p(nu) = w N(nu; 0, S) + (1 - w) T(nu)       nu > 0
///             early (nu < 0) an error of any size, hardly ever, in place of the waits
///     credit c = w N / p,   slope c nu / S,   curvature: judge()
///
/// While w is not tiny this reaches the filter that knows which messages
/// waited: near the floor T is flat and thin, so that a message there is
/// recognised as soon as the prediction is good. What it cannot do is begin;
/// the start comes from FloorSearch.
class FloorEstimator {
 public:
  /// What the last message said of this picture.
  struct Testimony {
    double at_floor = 0.0;  ///< density of a message that waits for nothing, 1/ns
    double waiting = 0.0;   ///< of one that waits
    double share = 0.5;     ///< of messages at the floor in its direction, by a long memory
    double recent_share = 0.5;
    bool late = false;
    bool waited = false;       ///< late, where waiting is usual
    bool offset_jump = false;  ///< a jump of the offset explains it, and those before, better
    /// ln density of one that waits as the last few did
    float like_last = static_cast<float>(kLeastExponent);
  };

  /// No floor, and nothing recorded.
  void restart() noexcept;
  /// As Estimator's.
  void expect_noise_of_at_least(double ns) noexcept { least_noise_ = ns; }

  /// `rate`: ns per cycle, believed elsewhere. Returns the probability that the
  /// message was at the floor; 0 while none is known.
  double update(const Observation& seen, double rate) noexcept;
  /// Only remembers it.
  void record(const Observation& seen, double rate) noexcept;

  /// A floor is followed; until then estimate() and the deviations mean nothing.
  [[nodiscard]] bool locked() const noexcept { return locked_; }
  /// The last message has made it start from a new floor.
  [[nodiscard]] bool adopted() const noexcept { return adopted_; }
  /// Others, who have heard every message, say the same of this floor, and know
  /// it better.
  void take_from(const ModelBank<FullGrid>& bank, const Evidence<FullGrid>& evidence,
                 double scale) noexcept;
  /// A path on which nothing has waited, known to others: what they know is the
  /// floor, should messages wait from now on. `wait`: of the first that did, ns.
  void start_from(const ModelBank<FullGrid>& bank, const Evidence<FullGrid>& evidence, double scale,
                  const PerDirection<double>& noise, double wait) noexcept;
  /// Just started so: the floor of one direction is `ns` lower, and a `share` of
  /// its messages is there.
  void lower(Direction direction, double ns, double share) noexcept;
  /// What is followed is not the floor: to be found anew.
  void unlock() noexcept { locked_ = false; }
  /// Messages wait, as others see it.
  void wake() noexcept { search_.wake(); }

  /// Messages of both directions have been seen there, those that the fit was made of included.
  [[nodiscard]] bool proven() const noexcept;
  /// Too few messages have been heard since it was begun to tell it from one that is seen for good.
  [[nodiscard]] bool recent() const noexcept;
  /// Not proven, or too few for what is taken for waits to be no path that has changed.
  [[nodiscard]] bool young() const noexcept;
  /// Begun, not found, and surmised.
  [[nodiscard]] bool just_begun() const noexcept { return !found_ && surmised(); }
  /// It was found, and no message of either direction has been seen there since: 14 nats each.
  [[nodiscard]] bool never_seen() const noexcept;
  /// None has been for so long that it is no chance, by so many nats.
  [[nodiscard]] bool dry(double nats) const noexcept;
  /// Dry, and waits alone do not explain it: a message was early, and not by next to nothing beside
  /// the waits, as one would be if a clock had jumped; or the direction that would tell has not
  /// been heard since.
  [[nodiscard]] bool lost() const noexcept;

  /// The last message of a direction was there, and as many of it are as before, whatever the other
  /// waits.
  [[nodiscard]] bool seen_one_way() const noexcept;
  /// One of the last few messages was early: it may be finding a change of the clock.
  [[nodiscard]] bool early_lately() const noexcept { return early_ > 0; }
  /// That a clock has jumped explains best what is seen, but is not certain.
  [[nodiscard]] bool seeks_jump() const noexcept {
    return jumps_.judge(kConvincing) == JumpWatch::Verdict::kWait;
  }
  /// ln of the density p above that the last message had, 1/ns.
  [[nodiscard]] double log_density() const noexcept { return said_; }
  [[nodiscard]] const Testimony& testimony() const noexcept { return testimony_; }
  [[nodiscard]] const Estimate& estimate() const noexcept { return mixed_; }
  [[nodiscard]] double scale() const noexcept { return scale_; }
  [[nodiscard]] double gain() const noexcept { return gain_; }
  /// ns, of the messages that waited when the floor was found.
  [[nodiscard]] double mean_wait() const noexcept { return mean_wait_; }
  [[nodiscard]] double noise_ns(Direction direction) const noexcept;
  [[nodiscard]] double share(Direction direction) const noexcept { return paths_[direction].share; }
  [[nodiscard]] double offset_sigma_ns(double cycles) const noexcept;
  /// The same now by the likeliest model alone: of a floor just found even the wildest are thought
  /// possible, by which the clock may be anywhere.
  [[nodiscard]] double likeliest_sigma_ns() const noexcept;
  [[nodiscard]] double rate_sigma_ns() const noexcept;
  [[nodiscard]] double delay_sigma_ns() const noexcept;

  void rescale_time(double factor) noexcept;
  void shift_offset(double shift_ns) noexcept;

 private:
  using Bank = ModelBank<FloorGrid>;
  using Row = Bank::Row;

  /// Messages at a floor that was found, those of the fit (all but two of them at most) included.
  static constexpr double kProven = 12.0;
  /// Messages of each direction that a new floor must have heard: until then what is taken for
  /// waits may be a path that has changed.
  static constexpr double kSurmised = kProven - 2.0;

  /// What is known of one direction.
  struct Path {
    double share = 0.5;         ///< w
    double recent_share = 0.5;  ///< the same by the last two dozen messages
    double variance = 1.0;      ///< r^2, ns^2
    double members = 0.0;       ///< messages at the floor behind the variance
    double heard = 0.0;
    double dry = 0.0;         ///< nats: how unlikely it is that none of the last was at
                              ///< the floor
    std::uint8_t unseen = 0;  ///< messages at the floor until a change is confirmed
    bool there = false;       ///< the last one was, and since the other direction is dry
    bool pending = false;     ///< an early one that later ones have not explained
    WaitDensity waits{};
    float early = 0.0F;      ///< share of early outliers, learnt
    float mean_wait = 0.0F;  ///< ns, when the floor was found
    float late_by = 0.0F;    ///< ns, the mean of the last few
    float told = 0.0F;       ///< w, by the fit, until a message is seen at the floor

    /// Probability of an early outlier.
    [[nodiscard]] double early_outliers() const noexcept {
      return std::max(kHardlyEver, static_cast<double>(early));
    }
  };

  /// Messages since it was begun, of the direction that has fewer.
  [[nodiscard]] double heard() const noexcept;
  /// By how much messages may seem to arrive before they were sent at a floor whose delay was above
  /// zero: small beside the waits. (What ends one that is followed, by stamps whose latency nobody
  /// calibrated, is larger: LoadAwareEstimator::impossible.) ns.
  [[nodiscard]] double early_arrival() const noexcept { return mean_wait_ / kFarLarger; }
  /// Too few to tell waits from a path that has changed.
  [[nodiscard]] bool surmised() const noexcept { return heard() < kSurmised; }
  double follow(const Observation& seen) noexcept;
  [[nodiscard]] Bank::Innovations judge(const Observation& seen, const Path& path) const noexcept;
  void watch_jumps(const Observation& seen, const Path& path, const Bank::Innovations& in) noexcept;
  [[nodiscard]] bool shows_in_early(const Estimate& after) const noexcept;
  [[nodiscard]] Estimate after_jump() noexcept;
  void expect_confirmation() noexcept;
  void confirm(Path& path) noexcept;
  void detect_changes(const Bank::Innovations& in) noexcept;
  void learn(Path& path, Path& other, const Bank::Innovations& in) noexcept;
  static void learn_dry(Path& path, Path& other, double credit) noexcept;
  static void learn_early(Path& path, double nu, double credit) noexcept;
  void choose() noexcept;
  void mix() noexcept;
  void look() noexcept;
  void adopt(const FloorFit& fit) noexcept;
  void begin(double scale, double wait) noexcept;
  void begin_path(Path& path, double share, double members, double wait) noexcept;
  void hear_members_again(const FloorFit& fit) noexcept;
  [[nodiscard]] FloorSearch::Rival rival() const noexcept;

  Bank bank_{};
  Evidence<FloorGrid> evidence_{};
  ChangeDetector<FloorGrid> detector_{};
  JumpWatch jumps_{};
  FloorSearch search_{};
  PerDirection<Path> paths_{};
  Row weight_{};
  Testimony testimony_{};
  Estimate mixed_{};
  NoiseModel process_{};
  std::size_t best_ = FloorGrid::kStart;
  std::uint32_t count_ = 0;
  double scale_ = 100.0;
  double least_noise_ = kLeastNoise;
  double gain_ = 1.0;
  double said_ = 0.0;       ///< ln density of the last message
  double mean_wait_ = 0.0;  ///< ns, when the floor was found
  int early_ = 0;           ///< messages for which an early one is remembered
  float early_by_ = 0.0F;   ///< ns, of the earliest that is remembered
  float jumped_ = 0.0F;     ///< ns, offset that the last jump brought, until it is confirmed
  bool found_ = false;      ///< by a fit or by lucky messages, not begun where a path was settled
  bool locked_ = false;
  bool adopted_ = false;
};

}  // namespace ftcs::estimation
