// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "ftcs/sim/drives/subdevice.h"

namespace ftcs::ethercat {

/// How a SubDevice hangs on the others: its port 0 is joined to a port of `parent` by a cable.
struct Wiring {
  static constexpr int kMainDevice = -1;
  int parent = kMainDevice;     ///< number in the order of add(); the first has the MainDevice
  unsigned parent_port = 1;     ///< 1, 2 or 3
  Nanoseconds cable{};          ///< one way
  Nanoseconds processing{300};  ///< from port 0 through the processing unit to the next port
  Nanoseconds forwarding{300};  ///< from any other port to the next one
};

enum class SegmentError : std::uint8_t {
  kFull,          ///< kMaxSubDevices reached
  kNoSuchParent,  ///< the parent must have been added before
  kPortTaken,     ///< something hangs there already, or there is no such port
};

/// SubDevices and the wires between them. A value of fixed size: a frame and its start-of-frame
/// instant in, the processed frame and the instant at which it is back out. Deterministic.
class Segment {
 public:
  static constexpr std::size_t kMaxSubDevices = 64;

  /// Adds a SubDevice; returns its number (order of adding, not the position on the wire).
  [[nodiscard]] Result<std::size_t, SegmentError> add(const SubDeviceConfig& config,
                                                      const Wiring& wiring,
                                                      LocalOscillator& oscillator) noexcept;

  struct Passage {
    bool returned = false;  ///< false: nothing is connected, or the frame was lost
    WireTime at;            ///< start of the returning frame at the MainDevice
  };
  Passage pass(const FrameView& frame, WireTime sof) noexcept;
  /// Lets time pass without a frame: SYNC0 and watchdogs go on.
  void advance(WireTime now) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] SubDevice& operator[](std::size_t number) noexcept { return *devices_[number]; }
  [[nodiscard]] const SubDevice& operator[](std::size_t number) const noexcept {
    return *devices_[number];
  }
  /// Order in which frames visit them: number of the SubDevice at a position on the wire.
  [[nodiscard]] std::size_t at_position(std::size_t position) const noexcept;
  [[nodiscard]] std::size_t reachable() const noexcept { return reachable_; }
  /// True one-way delay from port 0 of the first SubDevice to port 0 of this one.
  [[nodiscard]] Duration delay_to(std::size_t number) const noexcept;

  /// Fault injection. Cut or mend the cable above a SubDevice: the port beyond closes by itself and
  /// everything behind it is out of reach.
  void set_cut(std::size_t number, bool cut) noexcept;
  void power_cycle(std::size_t number, WireTime now) noexcept {
    devices_[number]->power_cycle(now);
  }
  /// Another SubDevice is put in its place and switched on.
  void replace(std::size_t number, const SubDeviceConfig& config, LocalOscillator& oscillator,
               WireTime now) noexcept;

 private:
  /// One station on a frame's way: it arrives at this port so long after the first arrival.
  struct Hop {
    std::uint8_t device = 0;
    std::uint8_t port = 0;
    Duration after{};
  };
  void plan() noexcept;
  [[nodiscard]] int child(std::size_t device, unsigned port) const noexcept;

  std::array<std::optional<SubDevice>, kMaxSubDevices> devices_;
  std::array<Wiring, kMaxSubDevices> wiring_{};
  std::array<bool, kMaxSubDevices> cut_{};
  std::size_t count_ = 0;
  std::array<Hop, 2 * kMaxSubDevices> hops_{};
  std::size_t hop_count_ = 0;
  std::size_t reachable_ = 0;
  Duration total_{};
};

}  // namespace ftcs::ethercat
