// SPDX-License-Identifier: MIT
#include "ftcs/node/drive_clocks.h"

#include <algorithm>

namespace ftcs::node {

void DriveClocks::cycle(const ethercat::MainDevice& main, bool settled,
                        CycleNotes& notes) noexcept {
  const std::uint16_t drive = main.last_cycle().compared;
  if (drive == ethercat::CycleReport::kNobody) return;
  Seen& seen = seen_[drive];
  const std::uint32_t now = main.network().devices[drive].system_time_difference;
  seen.last = now;
  if (!settled) return;
  ++seen.readings;
  seen.largest = std::max(seen.largest, now);
  const bool beyond = limit_.count() > 0 && std::int64_t{now} > limit_.count();
  if (beyond) ++seen.beyond;
  if (beyond != seen.is_beyond) {
    notes.add(beyond ? CycleNote::Kind::kDriveClockOff : CycleNote::Kind::kDriveClockBack, drive);
  }
  seen.is_beyond = beyond;
}

std::size_t DriveClocks::worst(std::size_t count) const noexcept {
  const auto* const end = seen_.begin() + std::min(count, seen_.size());
  const auto* const found = std::max_element(
      seen_.begin(), end, [](const Seen& a, const Seen& b) { return a.last < b.last; });
  return static_cast<std::size_t>(found - seen_.begin());
}

}  // namespace ftcs::node
