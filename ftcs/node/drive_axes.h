// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/csp_axis.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/node/circle_path.h"
#include "ftcs/node/cycle_notes.h"

namespace ftcs::node {

/// What the axes do. Positions are relative: an axis starts from where it stands.
struct DriveAxesConfig {
  bool move = true;          ///< false: all axes stay disabled
  double radius = 10'000.0;  ///< of the circles, counts
  double turn_s = 2.0;       ///< above zero
  double start_s = 0.0;      ///< reference time at which the circles begin; zero: at once
  /// How often the fault of one axis (CiA 402) is reset in a run. A drive that faults has a reason
  /// that somebody should look at before it moves again: zero, unless asked for.
  std::uint32_t fault_resets = 0;
};

/// The axes of all drives in cyclic synchronous position, two by two on circles: from the inputs of
/// a cycle to the outputs of the next. A drive whose process data is not that of csp_objects() is
/// left alone.
class DriveAxes {
 public:
  /// Bit 7 of the controlword stays down so many cycles before a reset is tried again.
  static constexpr std::uint64_t kCyclesBetweenResets = 100;

  explicit DriveAxes(const DriveAxesConfig& config) noexcept
      : config_(config), path_(config.radius, config.turn_s, config.start_s) {}

  /// One cycle. `in_op`: the drives take outputs; `time_s`: reference time that the outputs are
  /// for.
  void cycle(ethercat::MainDevice& main, bool in_op, double time_s, CycleNotes& notes) noexcept;

  [[nodiscard]] const ethercat::CspAxis& operator[](std::size_t n) const noexcept {
    return axes_[n];
  }
  [[nodiscard]] const CirclePath& path() const noexcept { return path_; }

 private:
  [[nodiscard]] bool all_enabled(ethercat::MainDevice& main) const noexcept;
  [[nodiscard]] bool take_reset(std::size_t n, bool fault) noexcept;

  DriveAxesConfig config_;
  CirclePath path_;
  std::array<ethercat::CspAxis, ethercat::kMaxSubDevices> axes_{};
  std::array<std::uint32_t, ethercat::kMaxSubDevices> resets_{};
  std::array<std::uint64_t, ethercat::kMaxSubDevices> next_reset_{};
  std::uint64_t cycles_ = 0;
};

}  // namespace ftcs::node
