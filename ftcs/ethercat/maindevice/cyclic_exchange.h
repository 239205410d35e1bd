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
  std::uint16_t expected = 0;  ///< of the SubDevices that take part at present
  std::uint16_t whole = 0;     ///< of all that were configured
  bool has_reference = false;
  /// System time of the reference when the start of this frame passed it. As long as the frame is
  /// known: no wrap, no phase.
  ReferenceTime reference;
  /// Upper bound of |0x092C| over all SubDevices (their magnitudes OR-ed), ns.
  std::uint32_t difference_bound_ns = 0;
  /// Whose own |0x092C| this frame brought (SubDeviceInfo has it); kNobody: nobody's.
  static constexpr std::uint16_t kNobody = 0xFFFF;
  std::uint16_t compared = kNobody;
  std::uint16_t answering = 0;  ///< SubDevices that this frame passed
  std::uint16_t states = 0;     ///< AL states OR-ed, error flag included
  /// Everybody who answered is in OP, without an error.
  [[nodiscard]] bool all_operational() const noexcept {
    return states == static_cast<std::uint16_t>(AlState::kOp);
  }
};

/// The cyclic frame: FRMW of the system time first (its latch is the start of frame), where the
/// bus is moved the reference's system time offset, LRW of the process image, BRD of 0x092C, BRD of
/// the AL status, and for one SubDevice in turn its 0x092C and AL status, or its AL control; after
/// a wrong working counter the states of several, so that whoever is missing is soon known. A
/// SubDevice that does not answer takes no part until it is admitted again: its process data is
/// zero and nobody expects it in the working counter.
class CyclicExchange {
 public:
  /// All SubDevices take part; the image is zero.
  void start(const Network& network) noexcept;
  /// Writes the frame of a cycle; what follows in the writer is the caller's.
  void request(FrameWriter& writer, const Network& network) noexcept;
  /// Takes the answer to the last request, whose structure the caller has checked.
  [[nodiscard]] CycleReport reply(const FrameView& frame, Network& network) noexcept;

  /// AL control for one SubDevice, sent in its turn with a later frame.
  void request_state(std::size_t position, std::uint16_t control) noexcept {
    if (takes_part_[position]) control_[position] = control;
  }
  [[nodiscard]] bool takes_part(std::size_t position) const noexcept {
    return takes_part_[position];
  }
  /// From the next frame on it is expected in the working counter, or it is not.
  void admit(const Network& network, std::size_t position) noexcept {
    set_part(network, position, true);
  }
  void dismiss(const Network& network, std::size_t position) noexcept {
    set_part(network, position, false);
  }
  /// What the reference will show when the next frame passes it, as the MainDevice knows it: should
  /// the reference be missing, the other clocks are given this instead of zero.
  void set_reference_estimate(ReferenceTime estimate) noexcept { estimate_ = estimate; }
  /// The reference's system time offset has changed (0x0920): sent until it was taken.
  void write_system_time_offset() noexcept { offset_changed_ = true; }
  /// The next frame tells the reference this system time (0x0910), as a drift datagram does to the
  /// others: its own control loop follows.
  void write_system_time(ReferenceTime time) noexcept {
    written_time_ = time;
    writes_time_ = true;
  }
  /// Datagrams of the last request.
  [[nodiscard]] std::size_t datagrams() const noexcept { return datagrams_; }
  [[nodiscard]] Bytes outputs(const SubDeviceInfo& device) noexcept {
    return Bytes{image_}.subspan(device.outputs.offset, device.outputs.size);
  }
  [[nodiscard]] ConstBytes inputs(const SubDeviceInfo& device) const noexcept {
    return ConstBytes{image_}.subspan(device.inputs.offset, device.inputs.size);
  }

 private:
  void set_part(const Network& network, std::size_t position, bool part) noexcept;
  [[nodiscard]] bool asks_reference(const Network& network) const noexcept {
    return network.has_reference() && takes_part_[network.reference];
  }
  void take_reference(const Datagram& time, const Network& network, CycleReport& report) noexcept;
  [[nodiscard]] ReferenceTime unwrap(ConstBytes data, bool wide) noexcept;
  void ask_in_turn(FrameWriter& writer, const Network& network) noexcept;
  void take_turns(const FrameView& turns, Network& network) noexcept;

  std::array<std::uint8_t, kMaxImageSize> image_{};
  std::size_t image_size_ = 0;
  std::size_t input_start_ = 0;
  std::uint16_t expected_ = 0;
  std::uint16_t whole_ = 0;
  std::array<bool, kMaxSubDevices> takes_part_{};
  ReferenceTime estimate_;
  std::uint64_t told_ = 0;  ///< of it, in the frame that is out
  bool odd_frame_ = false;
  bool offset_changed_ = false;
  bool writes_offset_ = false;  ///< in the frame that is out
  ReferenceTime written_time_;
  bool writes_time_ = false;  ///< in the next frame
  bool wrote_time_ = false;   ///< in the frame that is out
  std::size_t datagrams_ = 0;
  std::array<std::uint16_t, kMaxSubDevices> control_{};  ///< zero: nothing to send
  std::size_t turn_ = 0;
  std::size_t turns_ = 0;  ///< SubDevices asked in this frame, turn_ the first
  bool turn_is_control_ = false;
  bool compares_ = false;  ///< 0x092C of SubDevice turn_ is asked for in this frame
  bool hurry_ = false;     ///< the last working counter was wrong
  std::uint64_t last_reference_ = 0;
};

}  // namespace ftcs::ethercat
