// SPDX-License-Identifier: MIT
#include "ftcs/estimation/wait_density.h"

#include <algorithm>
#include <numbers>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

/// What the exponential of the start counts, in messages.
constexpr double kStart = kShortMemory;
/// Beyond it everything counts half.
constexpr auto kMemory = static_cast<float>(kLongMemory);

}  // namespace

void WaitDensity::start(double mean_wait_ns) noexcept {
  double above = 1.0;  // part of the exponential beyond the cell's lower edge
  double edge = 1.0;
  for (float& count : count_) {
    edge *= std::numbers::sqrt2;
    const double beyond = quick_exp(std::max(-edge / mean_wait_ns, kLeastExponent));
    count = static_cast<float>(kStart * (above - beyond));
    above = beyond;
  }
  mass_ = static_cast<float>(kStart);
  tabulate();
}

void WaitDensity::learn(double nu, double waited) noexcept {
  const auto part = static_cast<float>(waited);
  count_[cell_of(nu)] += part;
  mass_ += part;
  untold_ += part;
  if (mass_ > kMemory) {
    for (float& count : count_) count *= 0.5F;
    mass_ *= 0.5F;
  }
  if (untold_ >= static_cast<float>(kFew)) tabulate();
}

/// Neighbouring cells share a density until enough lies in them.
void WaitDensity::tabulate() noexcept {
  untold_ = 0.0F;
  const auto mass = static_cast<double>(mass_);
  double seen = 0.0;   // in the cells that have no density yet
  double begin = 0.0;  // ns, where they begin: the first reach down to zero
  std::size_t open = 0;
  double upper = 1.0;
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    upper *= std::numbers::sqrt2;
    seen += static_cast<double>(count_[cell]);
    if (seen < kFew) continue;
    const auto even = static_cast<float>(seen / (mass * (upper - begin)));
    for (; open <= cell; ++open) density_[open] = even;
    begin = upper;
    seen = 0.0;
  }
  // What is left, one message at least, lies in the last cells, as much in each. Now and then a
  // wait is longer than all before, by any factor.
  const double left = std::max({seen, 1.0, kNowAndThen * mass});
  const double each = left / static_cast<double>(kCells - open);
  for (double width = begin * (std::numbers::sqrt2 - 1.0); open < kCells;
       ++open, width *= std::numbers::sqrt2) {
    density_[open] = static_cast<float>(each / (mass * width));
  }
}

}  // namespace ftcs::estimation
