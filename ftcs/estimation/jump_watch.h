// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/model_bank.h"

namespace ftcs::estimation {

/// What the watch is told about one message: the message itself, what the
/// filters take noise for, and what the best of them had believed before.
struct JumpMessage {
  Observation seen{};
  DelayShape shape{};
  double scale = 0.0;  ///< s, ns
  OutlierPrior outliers{};
  NoiseModel process{};     ///< of the oscillator
  bool two_way = false;     ///< messages of both directions come
  bool delay_free = false;  ///< the path delay is estimated, and may jump too
  Estimate believed{};
  double distance = 0.0;     ///< nu^2 / S of this message under it
  double log_density = 0.0;  ///< of this message under it, outliers included
};

/// One hypothesis: offset or path delay has jumped between the last message
/// that fitted and the first that did not. It starts from what was believed,
/// with the variance nu^2 of that first message added to what has jumped (an
/// offset beyond 100,000 sigma: moved by nu), and goes on as a filter of its
/// own; `lead` is what speaks for it, the logarithm of a likelihood ratio with
/// the prior in it. Where messages wait usually it begins anew from one that is
/// early by eight sigma under it: the first may have waited.
class JumpHypothesis {
 public:
  enum class Of : std::uint8_t { kOffset, kDelay };
  explicit JumpHypothesis(Of jumped) noexcept : jumped_(jumped) {}

  void follow(const JumpMessage& message) noexcept;
  void clear() noexcept { *this = JumpHypothesis{jumped_}; }

  [[nodiscard]] bool alive() const noexcept { return alive_; }
  /// Nats.
  [[nodiscard]] double lead() const noexcept { return lead_; }
  /// At the last message.
  [[nodiscard]] Estimate estimate() const noexcept { return filter_.estimate(0); }
  /// Enough speaks for it, and messages of both directions, where both come.
  [[nodiscard]] bool certain() const noexcept;

 private:
  struct OneModel {
    static constexpr std::array<NoiseModel, 1> kModels = {};
    static constexpr std::size_t kSize = kModels.size();
  };
  [[nodiscard]] bool may_start(const JumpMessage& message) const noexcept;
  void start(const JumpMessage& message) noexcept;
  void predict(const JumpMessage& message) noexcept;
  /// Hears it. Returns whether it is early by eight sigma where messages wait usually.
  bool judge(const JumpMessage& message) noexcept;

  ModelBank<OneModel> filter_{};
  double lead_ = 0.0;
  Of jumped_;
  bool alive_ = false;
  bool two_way_ = false;
  std::array<bool, 2> seen_{};  ///< a message of this direction fits
};

/// Tells jumps of the offset (a step of the reference or of the clock) and of
/// the path delay from outliers and from changes of rate (Willsky and Jones,
/// IEEE Trans. AC-21, 1976, with one start of each hypothesis at a time).
class JumpWatch {
 public:
  enum class Verdict : std::uint8_t {
    kNothing,  ///< whatever else there is may act
    kWait,     ///< a jump explains best what is seen, but is not certain
    kJumped,   ///< take over estimate()
  };

  void follow(const JumpMessage& message) noexcept;
  /// `rival`: nats by which a change of rate explains better than none.
  [[nodiscard]] Verdict judge(double rival) const noexcept;
  /// The rival is what `detector` says of the model `believed`; asked only where a jump explains
  /// anything.
  template <class Detector>
  [[nodiscard]] Verdict judge(const Detector& detector, std::size_t believed) const noexcept {
    return speaks() ? judge(detector.lead(believed)) : Verdict::kNothing;
  }
  [[nodiscard]] Estimate estimate() const noexcept { return leading().estimate(); }
  /// A jump of the offset explains what is seen better than none, and no worse than one of the
  /// delay.
  [[nodiscard]] bool seeks_offset() const noexcept { return speaks() && &leading() == &offset_; }
  void clear() noexcept;

 private:
  [[nodiscard]] bool speaks() const noexcept { return leading().alive() && leading().lead() > 0.0; }
  [[nodiscard]] const JumpHypothesis& leading() const noexcept {
    return delay_.lead() > offset_.lead() ? delay_ : offset_;
  }

  JumpHypothesis offset_{JumpHypothesis::Of::kOffset};
  JumpHypothesis delay_{JumpHypothesis::Of::kDelay};
};

/// For a grid that has no room for it.
class NoJumpWatch {
 public:
  void follow(const JumpMessage&) noexcept {}
  template <class Detector>
  [[nodiscard]] JumpWatch::Verdict judge(const Detector&, std::size_t) const noexcept {
    return JumpWatch::Verdict::kNothing;
  }
  [[nodiscard]] Estimate estimate() const noexcept { return {}; }
  void clear() noexcept {}
};

}  // namespace ftcs::estimation
