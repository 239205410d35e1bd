// SPDX-License-Identifier: MIT
#include "ftcs/estimation/second_opinion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/line_sums.h"
#include "ftcs/measurement/order_statistic.h"

namespace ftcs::estimation {
namespace {

/// Concentration steps per start: convergence is that fast on a line.
constexpr int kSteps = 3;
constexpr double kFullFreedom = 9.0;
/// Luck in one direction alone is more frequent.
constexpr double kOneSided = 3.0;

/// Brings the `wanted` smallest of `count` values to the front, in order. For
/// the few values here selection is as quick as anything, and needs nothing of
/// a C library (std::nth_element: memmove).
template <class Value, class Less>
void smallest_first(Value* values, std::size_t count, std::size_t wanted, Less less) noexcept {
  for (std::size_t k = 0; k < wanted; ++k) {
    std::size_t least = k;
    for (std::size_t j = k + 1; j < count; ++j) {
      if (less(values[j], values[least])) least = j;
    }
    std::swap(values[k], values[least]);
  }
}

/// The value of the given rank among the first `count`, which are reordered;
/// infinite if there are none.
template <std::size_t Capacity>
double ranked(std::array<double, Capacity>& values, std::size_t count, std::size_t rank) noexcept {
  if (count == 0) return std::numeric_limits<double>::infinity();
  return order_statistic(values, static_cast<std::ptrdiff_t>(count),
                         static_cast<std::ptrdiff_t>(rank));
}

}  // namespace

template <std::size_t Capacity>
void SecondOpinion<Capacity>::push(const Observation& seen, double innovation) noexcept {
  if (!(std::abs(seen.elapsed) < kLongestGap)) clear();
  time_ += seen.elapsed;
  messages_[next_] = {time_, seen.z, seen.sign, innovation};
  next_ = next_ + 1 == Capacity ? 0 : next_ + 1;
  size_ = std::min(size_ + 1, Capacity);
  const std::size_t side = seen.sign > 0.0 ? 0 : 1;
  const bool same = std::abs(innovation - latest_[side]) < kSmallPart * std::abs(innovation);
  alike_[side] = same ? static_cast<std::uint8_t>(std::min(alike_[side] + 1, 100)) : 0;
  latest_[side] = innovation;
}

template <std::size_t Capacity>
void SecondOpinion<Capacity>::rescale_time(double factor) noexcept {
  time_ /= factor;
  for (Message& message : messages_) message.time /= factor;
}

template <std::size_t Capacity>
void SecondOpinion<Capacity>::shift_offset(double shift_ns) noexcept {
  for (Message& message : messages_) message.z += shift_ns;
}

template <std::size_t Capacity>
double SecondOpinion<Capacity>::residual(const Message& message,
                                         const Estimate& line) const noexcept {
  return message.z - line.x - line.y * (message.time - time_) - message.sign * line.d;
}

template <std::size_t Capacity>
void SecondOpinion<Capacity>::adopt(const Estimate& line) noexcept {
  for (Message& message : messages_) message.innovation = residual(message, line);
}

template <std::size_t Capacity>
LastMessages SecondOpinion<Capacity>::last() const noexcept {
  LastMessages last;
  last.count = std::min(size_, last.messages.size());
  double before = 0.0;
  for (std::size_t k = 0; k < last.count; ++k) {
    const Message& m = messages_[(next_ + Capacity - last.count + k) % Capacity];
    last.messages[k] = {m.sign, k == 0 ? 0.0 : m.time - before, m.z};
    before = m.time;
  }
  return last;
}

/// Least squares of z on (1, t, sign), time relative to the newest message;
/// covariance in units of the squared residual scale.
template <std::size_t Capacity>
Estimate SecondOpinion<Capacity>::fit(const Kept& kept, bool delay_free,
                                      double known_delay) const noexcept {
  LineSums sums;
  for (std::size_t k = 0; k < kept.count; ++k) {
    const Message& m = messages_[kept.members[k]];
    sums.add(m.sign, m.time - time_, delay_free ? m.z : m.z - m.sign * known_delay);
  }
  Estimate e;
  if (!delay_free) e.d = known_delay;
  const bool solved = delay_free ? sums.solve(e) : sums.solve_with_known_delay(e);
  return solved ? e : Estimate{};
}

/// The line through two messages of one direction; the delay from the median of
/// what is left on the other side.
template <std::size_t Capacity>
Estimate SecondOpinion<Capacity>::through(std::size_t a, std::size_t b, bool delay_free,
                                          double known_delay) const noexcept {
  const Message& first = messages_[a];
  const Message& second = messages_[b];
  Estimate line;
  line.y = (second.z - first.z) / (second.time - first.time);
  const double level = first.z - line.y * (first.time - time_);  // x + sign d
  line.d = known_delay;
  if (delay_free) {
    std::array<double, Capacity> others{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < size_; ++k) {
      const Message& m = messages_[k];
      if (m.sign != first.sign) others[count++] = m.z - line.y * (m.time - time_);  // x - sign d
    }
    const double middle = ranked(others, count, count / 2);
    if (count > 0) line.d = first.sign * (level - middle) / 2.0;
  }
  line.x = level - first.sign * line.d;
  return line;
}

/// Three quarters of the messages of each direction, those closest to the line:
/// each direction by itself, because a loaded one would otherwise lend its
/// messages to the trimming of the other.
template <std::size_t Capacity>
typename SecondOpinion<Capacity>::Kept SecondOpinion<Capacity>::closest(
    const Estimate& line) const noexcept {
  std::array<double, Capacity> squares{};
  for (std::size_t k = 0; k < size_; ++k) {
    const double r = residual(messages_[k], line);
    squares[k] = r * r;
  }
  Kept kept;
  for (const double sign : {1.0, -1.0}) {
    const std::size_t begin = kept.count;
    std::size_t end = begin;
    for (std::size_t k = 0; k < size_; ++k) {
      if (messages_[k].sign == sign) kept.members[end++] = static_cast<std::uint8_t>(k);
    }
    const std::size_t count = (end - begin) - (end - begin) / 4;
    if (count == 0) continue;
    smallest_first(&kept.members[begin], end - begin, count,
                   [&squares](std::uint8_t x, std::uint8_t y) { return squares[x] < squares[y]; });
    kept.count += count;
    for (std::size_t k = begin; k < kept.count; ++k) kept.squares += squares[kept.members[k]];
  }
  return kept;
}

/// Whether the typical innovation of one direction, their median, exceeds `limit`; so it does where
/// there are none.
template <std::size_t Capacity>
bool SecondOpinion<Capacity>::typically_beyond(double sign, double limit) const noexcept {
  std::size_t count = 0;
  std::size_t beyond = 0;
  for (std::size_t k = 0; k < size_; ++k) {
    const bool asked = messages_[k].sign == sign;
    count += static_cast<std::size_t>(asked);
    beyond += static_cast<std::size_t>(asked && std::abs(messages_[k].innovation) > limit);
  }
  return beyond >= count - count / 2;
}

/// Whether all innovations of one direction exceed `limit`, and they are not too few to tell.
template <std::size_t Capacity>
bool SecondOpinion<Capacity>::all_beyond(double sign, double limit) const noexcept {
  std::size_t count = 0;
  for (std::size_t k = 0; k < size_; ++k) {
    if (messages_[k].sign != sign) continue;
    if (!(std::abs(messages_[k].innovation) > limit)) return false;
    ++count;
  }
  return count >= kRepeated;
}

/// Root mean square of what `line` leaves of the kept messages of one
/// direction.
template <std::size_t Capacity>
double SecondOpinion<Capacity>::left_by(const Estimate& line, const Kept& kept,
                                        double sign) const noexcept {
  double squares = 0.0;
  double members = 0.0;
  for (std::size_t k = 0; k < kept.count; ++k) {
    const Message& m = messages_[kept.members[k]];
    if (m.sign != sign) continue;
    const double r = residual(m, line);
    squares += r * r;
    members += 1.0;
  }
  return std::max(kLeastNoise, std::sqrt(squares / std::max(members, 1.0)));
}

/// Distance of a message from the chord of its neighbours of the same
/// direction, lower quartile: noise without any model. One outlier spoils three
/// chords, hence not the median.
template <std::size_t Capacity>
double SecondOpinion<Capacity>::roughness(double sign) const noexcept {
  std::array<double, Capacity> distances{};
  std::size_t count = 0;
  const Message* before = nullptr;
  const Message* middle = nullptr;
  for (std::size_t k = 0; k < size_; ++k) {
    const Message& m = messages_[(next_ + Capacity - size_ + k) % Capacity];
    if (m.sign != sign) continue;
    if (before != nullptr && m.time != before->time) {
      const double share = (middle->time - before->time) / (m.time - before->time);
      distances[count++] = std::abs(middle->z - before->z - share * (m.z - before->z));
    }
    before = middle;
    middle = &m;
  }
  return count == 0 ? 0.0 : ranked(distances, count, count / 4);
}

/// Innovations far above `forward` and `backward`: the typical ones of both
/// directions, or one that is merely loaded would do; or all of one direction.
template <std::size_t Capacity>
bool SecondOpinion<Capacity>::contradicted(double forward, double backward) const noexcept {
  // Coarse stamps of one direction can agree to the digit: it must not set the
  // measure for itself.
  const double one_sided = kOneSided * std::max(forward, backward);
  return (typically_beyond(1.0, forward) && typically_beyond(-1.0, backward)) ||
         all_beyond(1.0, one_sided) || all_beyond(-1.0, one_sided);
}

template <std::size_t Capacity>
FreshFit SecondOpinion<Capacity>::consult(const OpinionQuestion& question) const noexcept {
  const bool delay_free = question.delay_free;
  const double known_delay = question.known_delay;
  FreshFit result;
  // No fit leaves much less than the roughness, which is the larger part of the noise: where
  // innovations are not far above that, save the work. Messages on a line to the digit have none,
  // and are no reason to begin anew.
  const double worth = (1.0 - kOften) * question.contradiction;
  const auto rough = [&](double sign) {
    return worth * std::max(question.least_noise, roughness(sign));
  };
  const double forward = rough(1.0);
  // Whatever the roughness of the other direction is: without one of these two nothing is.
  if (!typically_beyond(1.0, forward) && !all_beyond(-1.0, kOneSided * forward)) return result;
  if (!contradicted(forward, rough(-1.0))) return result;
  const std::size_t unknowns = delay_free ? 3 : 2;
  double best = -1.0;
  Kept best_kept;
  // Elemental starts: every message with the one that is half a window later,
  // if of one direction.
  for (std::size_t a = 0; a < size_; ++a) {
    const std::size_t b = (a + size_ / 2) % size_;
    if (a >= b || messages_[a].sign != messages_[b].sign ||
        messages_[a].time == messages_[b].time) {
      continue;
    }
    Kept kept = closest(through(a, b, delay_free, known_delay));
    if (kept.count < unknowns + kFew) return result;
    Estimate line;
    for (int step = 0; step < kSteps; ++step) {
      line = fit(kept, delay_free, known_delay);
      kept = closest(line);
    }
    if (line.xx > 0.0 && (best < 0.0 || kept.squares < best)) {
      best = kept.squares;
      best_kept = kept;
      result.estimate = line;
    }
  }
  if (best < 0.0) return result;
  const double freedom = static_cast<double>(best_kept.count - unknowns);
  result.scale_ns = std::max(kLeastNoise, std::sqrt(best / freedom));
  const double needed = question.contradiction * std::sqrt(std::max(1.0, kFullFreedom / freedom));
  result.better = contradicted(needed * left_by(result.estimate, best_kept, 1.0),
                               needed * left_by(result.estimate, best_kept, -1.0));
  return result;
}

template class SecondOpinion<16>;

}  // namespace ftcs::estimation
