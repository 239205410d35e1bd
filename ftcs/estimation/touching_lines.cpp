// SPDX-License-Identifier: MIT
#include "ftcs/estimation/touching_lines.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numbers>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

constexpr std::size_t kCandidates = 48;
/// Cycles between the two messages of an edge, at least.
constexpr double kShortestEdge = 0.5;

/// The lower convex hull of one direction's messages: a line of any rate touches them at one of
/// its corners.
struct Hull {
  std::array<std::uint8_t, FloorMessages::kCapacity> corner;
  std::size_t size = 0;

  explicit Hull(const FloorMessages& messages) noexcept {
    const auto edge = [&](std::size_t a, std::size_t b) {
      return std::array<double, 2>{messages.time(b) - messages.time(a),
                                   messages.lifted[b] - messages.lifted[a]};
    };
    for (std::size_t k = 0; k < messages.size; ++k) {
      while (size >= 2) {
        const auto last = edge(corner[size - 2], corner[size - 1]);
        const auto next = edge(corner[size - 2], k);
        if (last[0] * next[1] - last[1] * next[0] > 0.0) break;
        --size;
      }
      corner[size++] = static_cast<std::uint8_t>(k);
    }
  }

  [[nodiscard]] double touches(const FloorMessages& messages, double rate) const noexcept {
    double least = messages.height(corner[0], rate);
    for (std::size_t k = 1; k < size; ++k) {
      least = std::min(least, messages.height(corner[k], rate));
    }
    return least;
  }
};

/// Octaves above `smallest`, the first for all below.
constexpr int kOctaves = 48;
using Counts = std::array<std::uint16_t, kOctaves>;

class Candidates {
 public:
  Candidates(const PerDirection<FloorMessages>& messages, double smallest) noexcept
      : messages_(messages),
        hulls_{Hull{messages.forward}, Hull{messages.backward}},
        smallest_(smallest),
        total_(static_cast<double>(messages.forward.size + messages.backward.size)) {}

  [[nodiscard]] TouchingLines best() noexcept {
    for (const Direction direction : kDirections) try_edges(direction);
    return best_;
  }

 private:
  void try_edges(Direction direction) noexcept {
    const FloorMessages& of = messages_[direction];
    const Hull& hull = hulls_[direction];
    for (std::size_t k = 0; k + 1 < hull.size && tried_ < kCandidates; ++k) {
      const std::size_t a = hull.corner[k];
      const std::size_t b = hull.corner[k + 1];
      const double apart = of.time(b) - of.time(a);
      if (apart < kShortestEdge) continue;
      ++tried_;
      try_rate(of.sign * (of.lifted[b] - of.lifted[a]) / apart);
    }
  }

  /// Of two heights, none below zero; the first one up to `smallest`, or of what is no number.
  [[nodiscard]] PairBits octaves_of(const Pair& heights) const noexcept {
    constexpr double kLast = 1ULL << (kOctaves - 2);  // all beyond are of the last octave
    const auto higher = std::bit_cast<PairBits>(heights > Pair{} + smallest_);
    const Pair ratio = lesser<Pair>(heights / smallest_, Pair{} + kLast);
    return ((std::bit_cast<PairBits>(ratio) >> 52U) - 1022U) & higher;
  }

  void try_rate(double rate) noexcept {
    Counts count{};
    TouchingLines lines{.rate = rate};
    double highest = 0.0;  // mean of the direction in which it is larger
    for (const Direction direction : kDirections) {
      const FloorMessages& of = messages_[direction];
      const double least = hulls_[direction].touches(of, rate);
      lines.floor[direction] = least;
      double sum = 0.0;
      for (std::size_t k = 0; k < of.size; k += 2) {
        // By rounding one that is no corner may lie below the line.
        const Pair above = larger<Pair>(Pair{}, of.heights(k, rate) - least);
        const PairBits octave = octaves_of(above);
        sum += above[0];
        ++count[static_cast<std::size_t>(octave[0])];
        if (k + 1 == of.size) break;
        sum += above[1];
        ++count[static_cast<std::size_t>(octave[1])];
      }
      lines.mean += sum / total_;
      highest = std::max(highest, sum / static_cast<double>(of.size));
    }
    score(count, lines, highest);
  }

  /// ln likelihood of the best width: `inside` messages evenly within it, the
  /// others log-uniform or exponential, whichever is likelier.
  void score(const Counts& count, TouchingLines lines, double highest) noexcept {
    const double log_unit = quick_log(kLogRange * smallest_);
    const auto unknown = [&](int octave) {  // ln density of a log-uniform wait
      return -((static_cast<double>(octave) - 0.5) * std::numbers::ln2 + log_unit);
    };
    int end = kOctaves;  // nothing lies above
    while (end > 1 && count[static_cast<std::size_t>(end - 1)] == 0) --end;
    double beyond = 0.0;
    for (int b = 1; b < end; ++b) beyond += count[static_cast<std::size_t>(b)] * unknown(b);
    double inside = 0.0;
    double width = smallest_;
    for (int b = 0; b < end; ++b) {
      const double here = count[static_cast<std::size_t>(b)];
      inside += here;
      if (b > 0) {
        beyond -= here * unknown(b);
        width *= 2.0;
      }
      if (inside < kRepeated || here == 0.0) continue;
      if (width > kSmallPart * highest && b > 1) break;
      const double rest = total_ - inside;
      double likelihood = inside * quick_log(inside / (total_ * width));
      if (rest > 0.0) {
        const double wait = lines.mean * total_ / rest;
        const double exponential = -rest * (quick_log(wait) + 1.0);
        likelihood += rest * quick_log(rest / total_) + std::max(beyond, exponential);
      }
      if (likelihood > best_score_) {
        best_score_ = likelihood;
        lines.width = width;
        best_ = lines;
      }
    }
  }

  const PerDirection<FloorMessages>& messages_;
  PerDirection<Hull> hulls_;
  double smallest_;
  double total_;
  std::size_t tried_ = 0;
  double best_score_ = -1e299;
  TouchingLines best_{};
};

}  // namespace

void FloorMessages::read(Direction direction, const RecordWindow& window, double base) noexcept {
  size = window.size;
  sign = sign_of(direction);
  for (std::size_t k = 0; k < size; ++k) {
    const RecordedMessage& m = window[k];
    lifted[k] = sign * (m.z - base);
    before[k] = static_cast<std::int32_t>(m.time - window.now);
  }
}

// Kept apart: its tables would stand beside those of the fit, in one frame beyond 4 KB.
[[gnu::noinline]] TouchingLines best_touching_lines(const PerDirection<FloorMessages>& messages,
                                                    double smallest) noexcept {
  return Candidates(messages, smallest).best();
}

}  // namespace ftcs::estimation
