// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/node/cycle_notes.h"

namespace ftcs::node {

/// How far the clock of each drive is from the reference's: |0x092C|, the mean difference as the
/// drive's own controller filters it, read from one drive in each cycle (ETG.1000.4, Distributed
/// Clocks: system time difference). With n drives each is looked at every n cycles. Judged from
/// `settled` on, which is some time after the start.
class DriveClocks {
 public:
  /// Of one drive, ns.
  struct Seen {
    std::optional<std::uint32_t> last{};  ///< none: it was not looked at yet
    std::uint32_t largest = 0;
    std::uint64_t readings = 0;  ///< that were judged
    std::uint64_t beyond = 0;    ///< of them above the limit
    bool is_beyond = false;      ///< the last one
  };

  /// `limit`: above it a drive counts as off; zero: none is.
  explicit DriveClocks(Nanoseconds limit) noexcept : limit_(limit) {}

  /// Once in a cycle, after its frame.
  void cycle(const ethercat::MainDevice& main, bool settled, CycleNotes& notes) noexcept;
  [[nodiscard]] const Seen& operator[](std::size_t drive) const noexcept { return seen_[drive]; }
  /// Position of the drive that is furthest off at present, of so many; zero: none was looked at.
  [[nodiscard]] std::size_t worst(std::size_t count) const noexcept;

 private:
  Nanoseconds limit_;
  std::array<Seen, ethercat::kMaxSubDevices> seen_{};
};

}  // namespace ftcs::node
