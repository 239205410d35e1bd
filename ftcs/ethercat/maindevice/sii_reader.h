// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/procedure.h"

namespace ftcs::ethercat {

/// Reads words of one SubDevice's SII, two or four of them at a time (0x0502, 0x0508), and waits
/// while the interface is busy.
class SiiReader {
 public:
  void start(Nanoseconds timeout) noexcept {
    timeout_ = timeout;
    deadline_set_ = false;
    poll_ = false;
  }
  /// The words from `word` on.
  void request(FrameWriter& writer, const SubDeviceInfo& device, std::size_t word) const noexcept;
  /// Done: `words` has what came, within the frame; otherwise the same is to be asked again.
  [[nodiscard]] Progress reply(const FrameView& frame, std::size_t position, FreeRunningTime now,
                               ConstBytes& words, Failure& failure) noexcept;

 private:
  Nanoseconds timeout_{};
  FreeRunningTime deadline_;
  bool deadline_set_ = false;
  bool poll_ = false;  ///< the command is out, the answer is not there yet
};

}  // namespace ftcs::ethercat
