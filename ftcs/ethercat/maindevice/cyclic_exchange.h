// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/configurator.h"
#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/time/instant.h"

namespace ftcs::ethercat {

/// What one cycle brought.
struct CycleReport {
  bool inputs_valid = false;  ///< the working counter is as expected: inputs are of this cycle
  std::uint16_t working_counter = 0;
  std::uint16_t expected = 0;
  bool has_reference = false;
  /// System time of the reference when the start of this frame passed it. As long as the frame is
  /// known: no wrap, no phase.
  ReferenceTime reference;
  /// Upper bound of |0x092C| over all SubDevices (their magnitudes OR-ed), ns.
  std::uint32_t difference_bound_ns = 0;
  std::uint16_t answering = 0;  ///< SubDevices that this frame passed
  std::uint16_t states = 0;     ///< AL states OR-ed, error flag included
  [[nodiscard]] bool all_operational() const noexcept {
    return states == static_cast<std::uint16_t>(AlState::kOp);
  }
};

/// The cyclic frame: FRMW of the system time first (its latch is the start of frame), LRW of the
/// process image, BRD of 0x092C, BRD of the AL status, and one datagram for the AL control or
/// status of one SubDevice in turn.
class CyclicExchange {
 public:
  void start(const Network& network) noexcept;
  void request(FrameWriter& writer, const Network& network) noexcept;
  [[nodiscard]] CycleReport reply(const FrameView& frame, Network& network) noexcept;

  /// AL control for one SubDevice, sent in its turn with a later frame.
  void request_state(std::size_t position, std::uint16_t control) noexcept {
    control_[position] = control;
  }
  [[nodiscard]] Bytes outputs(const SubDeviceInfo& device) noexcept {
    return Bytes{image_}.subspan(device.outputs.offset, device.outputs.size);
  }
  [[nodiscard]] ConstBytes inputs(const SubDeviceInfo& device) const noexcept {
    return ConstBytes{image_}.subspan(device.inputs.offset, device.inputs.size);
  }
  [[nodiscard]] std::uint16_t expected_working_counter() const noexcept { return expected_; }

 private:
  [[nodiscard]] ReferenceTime unwrap(ConstBytes data, bool wide) noexcept;
  void take_status(const Datagram& datagram, Network& network) noexcept;

  std::array<std::uint8_t, kMaxImageSize> image_{};
  std::size_t image_size_ = 0;
  std::size_t input_start_ = 0;
  std::uint16_t expected_ = 0;
  std::array<std::uint16_t, kMaxSubDevices> control_{};  ///< zero: nothing to send
  std::size_t turn_ = 0;
  bool turn_is_control_ = false;
  std::uint64_t last_reference_ = 0;
};

}  // namespace ftcs::ethercat
