// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/model_bank.h"

namespace ftcs::estimation {

/// What a fresh fit of the last messages says: offset, rate and delay at the
/// newest of them, with covariances in units of scale^2.
struct FreshFit {
  bool better = false;  ///< it contradicts the filters and is far more precise
                        ///< than they are
  Estimate estimate{};
  double scale_ns = 0.0;
};

struct OpinionQuestion {
  bool delay_free = true;  ///< estimate d too; otherwise it is
  double known_delay = 0.0;
  /// The fit is better if it leaves residuals so many times below the
  /// innovations; with few messages more is needed.
  double contradiction = 10.0;
  /// Noise that stamps have in any case, ns (rounding): innovations not far above it need no fit.
  double least_noise = kLeastNoise;
};

/// So many as can make filters diverge.
struct LastMessages {
  std::array<Observation, 7> messages{};
  std::size_t count = 0;
};

/// Keeps the last messages and, now and then, fits them anew without any
/// memory:
///
///     z = x + y t + sign d,   least trimmed squares over three quarters of
///     them (Rousseeuw, J. Am. Stat. Assoc. 79, 1984; concentration steps from
///     elemental starts)
///
/// Filters that have swallowed a gross error (a spike among the first messages,
/// a jump, hostile input) take the size of their errors for noise and trust new
/// messages too little. If the fit leaves residuals far below the filters' own
/// innovations they must start again, from the fit.
template <std::size_t Capacity>
class SecondOpinion {
 public:
  void push(const Observation& seen, double innovation) noexcept;
  /// Whether all its places are taken.
  [[nodiscard]] bool full() const noexcept { return size_ == Capacity; }
  /// How many innovations in a row, of either direction, hardly differ from
  /// their predecessor: noise is not like that.
  [[nodiscard]] int serial() const noexcept { return std::max(alike_[0], alike_[1]); }
  [[nodiscard]] FreshFit consult(const OpinionQuestion& question) const noexcept;
  /// The last messages, the newest last.
  [[nodiscard]] LastMessages last() const noexcept;
  /// The filters start again from `line`: what they had thought of these
  /// messages is void.
  void adopt(const Estimate& line) noexcept;
  void clear() noexcept { *this = SecondOpinion{}; }
  /// The unit of time becomes `factor` times as long.
  void rescale_time(double factor) noexcept;
  void shift_offset(double shift_ns) noexcept;

 private:
  struct Message {
    double time = 0.0;  ///< cycles
    double z = 0.0;
    double sign = 1.0;
    double innovation = 0.0;
  };
  struct Kept {
    std::array<std::uint8_t, Capacity> members{};
    std::size_t count = 0;
    double squares = 0.0;
  };

  [[nodiscard]] Estimate fit(const Kept& kept, bool delay_free, double known_delay) const noexcept;
  [[nodiscard]] Estimate through(std::size_t a, std::size_t b, bool delay_free,
                                 double known_delay) const noexcept;
  [[nodiscard]] Kept closest(const Estimate& line) const noexcept;
  [[nodiscard]] bool typically_beyond(double sign, double limit) const noexcept;
  [[nodiscard]] bool all_beyond(double sign, double limit) const noexcept;
  [[nodiscard]] double left_by(const Estimate& line, const Kept& kept, double sign) const noexcept;
  [[nodiscard]] double roughness(double sign) const noexcept;
  [[nodiscard]] bool contradicted(double forward, double backward) const noexcept;
  [[nodiscard]] double residual(const Message& message, const Estimate& line) const noexcept;

  std::array<Message, Capacity> messages_{};
  std::array<double, 2> latest_{};  ///< innovation of each direction
  std::array<std::uint8_t, 2> alike_{};
  std::size_t size_ = 0;
  std::size_t next_ = 0;
  double time_ = 0.0;
};

/// Never asked.
template <>
class SecondOpinion<0> {
 public:
  void push(const Observation&, double) noexcept {}
  [[nodiscard]] bool full() const noexcept { return true; }
  [[nodiscard]] int serial() const noexcept { return 0; }
  [[nodiscard]] FreshFit consult(const OpinionQuestion&) const noexcept { return {}; }
  [[nodiscard]] LastMessages last() const noexcept { return {}; }
  void adopt(const Estimate&) noexcept {}
  void rescale_time(double) noexcept {}
  void shift_offset(double) noexcept {}
};

extern template class SecondOpinion<16>;

}  // namespace ftcs::estimation
