// SPDX-License-Identifier: MIT
#include "ftcs/estimation/floor_search.h"

#include <algorithm>

#include "ftcs/estimation/belief.h"
#include "ftcs/estimation/quick_math.h"

namespace ftcs::estimation {
namespace {

/// Messages between two looks at first, and at most.
constexpr std::uint32_t kShortestPause = kLately;
constexpr std::uint32_t kLongestPause = 256;
constexpr std::uint16_t kShortestWindow = kLately;
constexpr std::size_t kMostStride = FloorSearch::Record::kCapacity / 2;
/// Times the usual distance of two messages at the floor: an entry then mostly
/// holds two of them.
constexpr double kFineAbove = 2.0;

/// Another floor is looked for without an alarm.
bool sought(const FloorSearch::Rival& rival) noexcept { return !rival.found || rival.uneven; }

}  // namespace

void FloorSearch::restart() noexcept {
  record_.clear();
  recent_.clear();
  messages_ = not_before_ = 0;
  pause_ = kShortestPause;
  alarm_ = false;
  wanted_ = best_wanted_ = 0;
  has_rate_ = fresh_ = clear_ = false;
  rate_ = 0.0;
  best_ = {};
}

void FloorSearch::hear(const Record::Message& message, double elapsed) noexcept {
  record_.elapse(elapsed);
  recent_.elapse(elapsed);
  if (best_wanted_ > 0) best_.elapse(elapsed);
  (void)recent_.push({message.direction, message.z, message.said, false, message.rate});
  fresh_ = record_.push(message) || fresh_;
  ++messages_;
}

void FloorSearch::wake() noexcept {
  pause_ = kShortestPause;
  not_before_ = std::min(not_before_, messages_ + kShortestPause);
}

std::size_t FloorSearch::stride() const noexcept { return best_in_recent_ ? 1 : record_.stride(); }

/// Of both directions from the same moment on, as far as there are enough: before it one alone
/// would show a rate that has changed since as messages that waited.
PerDirection<RecordWindow> FloorSearch::windows(std::size_t wanted, bool recent) const noexcept {
  PerDirection<RecordWindow> out;
  for (const Direction direction : kDirections) {
    out[direction] = recent ? recent_.window(direction, wanted) : record_.window(direction, wanted);
  }
  if (std::min(out.forward.size, out.backward.size) == 0) return out;
  for (const Direction direction : kDirections) {
    RecordWindow& window = out[direction];
    const double since = out[opposite(direction)].oldest();
    while (window.size > kShortestWindow && window.time(window[1]) < since) window.drop_oldest();
  }
  return out;
}

void FloorSearch::begin() noexcept {
  best_wanted_ = 0;
  scan_has_rate_ = clear_ = false;
  const bool coarse_due = record_.stride() == 1 || fresh_ || alarm_;
  in_recent_ = !coarse_due;
  wanted_ = kShortestWindow;
  if (!in_recent_ && record_.stride() > 1) wanted_ = 2 * kShortestWindow;
  fresh_ = false;
}

/// True: wanted_ and in_recent_ say which. Windows grow until one holds all
/// there is.
bool FloorSearch::next_window() noexcept {
  if (holds_window()) return true;
  if (in_recent_ || record_.stride() == 1) return false;
  in_recent_ = true;
  wanted_ = kShortestWindow;
  return holds_window();
}

/// Of the wanted length, or all there is.
bool FloorSearch::holds_window() const noexcept {
  const std::size_t longest = in_recent_ ? Recent::kCapacity : Record::kCapacity;
  const std::size_t held =
      in_recent_ ? std::min(recent_.size(Direction::kForward), recent_.size(Direction::kBackward))
                 : std::min(record_.size(Direction::kForward), record_.size(Direction::kBackward));
  return held >= kShortestWindow && wanted_ <= longest && wanted_ / 2U < held;
}

void FloorSearch::fit_window(const Rival& rival, double least_noise) noexcept {
  const FloorFit fit = fit_floor(windows(wanted_, in_recent_), least_noise);
  if (fit.has_rate) {
    rate_ = fit.estimate.y;
    has_rate_ = scan_has_rate_ = true;
  }
  clear_ = clear_ || (fit.clear(Direction::kForward) && fit.clear(Direction::kBackward));
  // That there is a floor has been told, by a search or by a path that was settled, where a finer
  // one is looked for.
  const bool finer = rival.uneven && kMuch * fit.sigma() < rival.noise;
  if (!fit.found || (fit.evidence < kConvincing && !finer)) return;
  const double sigma = fit.offset_sigma_ns();
  if (rival.there) {  // it must explain more, and lie elsewhere or know more
    const double own = rival.offset_sigma * rival.offset_sigma;
    const double off = fit.estimate.x - rival.offset;
    const bool contradicts =
        off * off > kFiveSigma2 * (own + sigma * sigma) || own > kFiveSigma2 * sigma * sigma;
    // Where the load has grown, entries that waited are taken for a floor of much noise.
    const bool blurred = fit.sigma() > kMuch * rival.noise;
    // The earliest of one direction from before a step, those of the other from after it.
    const bool too_early = fit.estimate.d < rival.least_delay;
    const bool better = fit.log_likelihood - fit.said >= kCertain;
    if (!better || !contradicts || blurred || too_early) return;
  }
  if (best_wanted_ > 0 && best_.offset_sigma_ns() <= sigma) return;
  best_ = fit;
  best_wanted_ = wanted_;
  best_in_recent_ = in_recent_;
}

bool FloorSearch::look(const Rival& rival, double least_noise) noexcept {
  if (wanted_ == 0) {
    const bool in_doubt = rival.there && alarm_;
    const bool asked = sought(rival) && messages_ % kShortestPause == 0 && messages_ >= not_before_;
    if (!in_doubt && !asked) return false;
    begin();
  }
  // As much as one window of full length, or all the shorter ones.
  std::size_t work = 0;
  while (next_window()) {
    if (work > 0 && work + wanted_ > Record::kCapacity) return false;
    work += wanted_;
    fit_window(rival, least_noise);
    wanted_ = static_cast<std::uint16_t>(2U * wanted_);
  }
  end(rival);
  return best_wanted_ > 0;
}

void FloorSearch::end(const Rival& rival) noexcept {
  wanted_ = 0;
  alarm_ = false;
  if (best_wanted_ > 0) return;
  const auto stride = static_cast<double>(record_.stride());
  if (sought(rival)) {  // asked again after twice as long, or when something is late
    pause_ = std::min(2U * pause_, kLongestPause);
    if (messages_ > kLongestPause) not_before_ = messages_ + pause_;
  }
  if (rival.there) {
    const double usual = 1.0 / std::min(rival.share.forward, rival.share.backward);
    if (stride < kSmallPart * usual && record_.stride() < kMostStride) {
      record_.coarsen(rival.rate);
    } else if (stride > kFineAbove * usual) {
      record_.refine();
    }
    return;
  }
  if (clear_) {
    record_.refine();
  } else if (record_.full() && record_.stride() < kMostStride) {
    record_.coarsen(rate_);
  }
}

void FloorSearch::adopt() noexcept {
  const auto said = [&](Direction direction, double time, double z) {
    const double nu = sign_of(direction) * (z - best_.offset_at(time)) - best_.estimate.d;
    double density = 0.0;
    (void)best_.noise[direction].at_floor(nu, density);
    return quick_log(density);
  };
  record_.say(said);
  recent_.say(said);
  best_wanted_ = 0;
  alarm_ = false;
  pause_ = kShortestPause;
}

void FloorSearch::rescale_time(double factor) noexcept {
  record_.rescale_time(factor);
  recent_.rescale_time(factor);
  rate_ *= factor;
  wanted_ = best_wanted_ = 0;
}

void FloorSearch::shift_offset(double shift_ns) noexcept {
  record_.shift_offset(shift_ns);
  recent_.shift_offset(shift_ns);
  best_.estimate.x += shift_ns;
}

}  // namespace ftcs::estimation
