// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/ethercat/wire/al_state.h"

namespace ftcs::node {

/// Something that the owner of a CycleNode may want to tell: to a log, a file, a screen.
struct CycleNote {
  enum class Kind : std::uint8_t {
    kLocked,
    kLockLost,
    kOpRequested,   ///< all drives were asked for OP
    kLeftOp,        ///< a drive, with its AL status code
    kOutOfReach,    ///< a drive does not answer to its address
    kReintegrated,  ///< a drive was restarted and has its configuration back
    kBackInOp,
    kAxisFault,   ///< CiA 402: statusword in the state Fault
    kFaultReset,  ///< CiA 402: controlword bit 7 rises
    kBusLocked,   ///< the distributed clock is within the band of plant time
    kBusLockLost,
    kPlantTimeLost,  ///< holdover: the bus goes on at its last rate
    kPlantTimeBack,
    kDriveClockOff,  ///< |0x092C| of a drive is above its limit
    kDriveClockBack,
  };
  static constexpr std::uint16_t kNobody = 0xFFFF;
  Kind kind = Kind::kLocked;
  std::uint16_t drive = kNobody;  ///< position on the wire
  ethercat::AlStatusCode code = ethercat::AlStatusCode::kNoError;
};

/// The notes of one cycle, in their order. Room for several of each drive; what is beyond is lost.
class CycleNotes {
 public:
  void clear() noexcept { size_ = 0; }
  void add(CycleNote::Kind kind, std::size_t drive = CycleNote::kNobody,
           ethercat::AlStatusCode code = ethercat::AlStatusCode::kNoError) noexcept {
    if (size_ == notes_.size()) return;
    notes_[size_++] = {kind, static_cast<std::uint16_t>(drive), code};
  }
  [[nodiscard]] std::span<const CycleNote> all() const noexcept { return {notes_.data(), size_}; }

 private:
  std::array<CycleNote, 200> notes_{};
  std::size_t size_ = 0;
};

}  // namespace ftcs::node
