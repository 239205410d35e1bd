// SPDX-License-Identifier: MIT
#include "ftcs/node/bridge_clock.h"

#include <algorithm>

namespace ftcs::node {

namespace {
LocalTime instant_of(std::uint64_t system_time) noexcept {
  return LocalTime::from_ns(static_cast<std::int64_t>(system_time));
}
}  // namespace

void BridgeClock::on_frame(LocalTime dc, std::int64_t offset_ns) noexcept {
  frames_[count_++ % kKept] = {dc, offset_ns};
}

/// What had been added when the reference showed `instant`: between two frames that are kept, or
/// before them on the line through all.
Duration BridgeClock::offset_at(LocalTime instant) const noexcept {
  std::size_t back = 0;
  const std::size_t oldest = std::min(count_, kKept) - 1;
  while (back < oldest && instant < frame(back + 1).dc) ++back;
  const bool is_older = back == oldest;
  if (oldest == 0 || (is_reference_ && !is_older)) {
    return Duration::from_whole_ns(frame(back).offset_ns);
  }
  const Frame& after = frame(is_older ? 0 : back);
  const Frame& before = frame(is_older ? oldest : back + 1);
  const double step_ns = static_cast<double>(after.offset_ns - before.offset_ns);
  const double part = std::min((instant - before.dc).ns() / (after.dc - before.dc).ns(), 1.0);
  return Duration::from_whole_ns(before.offset_ns) + Duration::from_ns(step_ns * part);
}

void BridgeClock::on_inputs(const ethercat::bridge::Inputs& inputs) noexcept {
  if (inputs.alone) {
    toggle_.reset();
    return;
  }
  // The first pair may be as old as the terminal is.
  const bool fresh = toggle_ && *toggle_ != inputs.updated;
  toggle_ = inputs.updated;
  if (!fresh || count_ == 0) return;
  const LocalTime internal = instant_of(inputs.internal);
  // What is not of these frames is of another time: the terminal's clock was set since.
  if (abs(frame(0).dc - internal) > Duration{kLargestAge}) return;
  crystal_ = internal - offset_at(internal);
  plant_ = ReferenceTime::from_ns(static_cast<std::int64_t>(inputs.external));
  known_ = true;
}

std::optional<ReferenceTime> BridgeClock::plant(Rate tracking) const noexcept {
  if (!known_) return std::nullopt;
  const Frame& now = frame(0);
  const Duration gone = now.dc - Duration::from_whole_ns(now.offset_ns) - crystal_;
  if (gone > Duration{kLargestAge}) return std::nullopt;
  return plant_ + scale(gone, tracking);
}

}  // namespace ftcs::node
