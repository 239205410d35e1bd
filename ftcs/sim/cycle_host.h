// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "ftcs/node/cycle_node.h"
#include "ftcs/sim/drives/segment.h"
#include "ftcs/sim/oscillator.h"

namespace ftcs::sim {

/// The host of a segment of modelled drives, in simulated time: it runs the CycleNode that ships,
/// and is late where a test or an experiment says so. Replaces socket and clock, nothing between.
class CycleHost {
 public:
  /// What the host believes plant time to be when its clock shows so much; none: it does not know.
  using PlantClock = std::function<std::optional<ReferenceTime>(FreeRunningTime)>;

  /// A frame of the bring-up follows the last one after so long.
  static constexpr Nanoseconds kBringUpRoundTrip{20'000};
  /// From sending a cycle's frame to the servo's update.
  static constexpr Nanoseconds kReplyTime{60'000};

  /// `crystal`: what the host's clock shows of true time; none: true time itself. Segment and
  /// crystal must outlive the host. `start`: when it is switched on.
  CycleHost(const node::CycleNodeConfig& config, ethercat::Segment& segment,
            ethercat::WireTime start, Oscillator* crystal = nullptr);

  void set_plant_clock(PlantClock clock) { plant_ = std::move(clock); }
  /// Noise of the stamps that the host has of its frames, set anew for each.
  void set_stamp_noise(std::function<Duration()> noise) { noise_ = std::move(noise); }
  /// From reading the clock to the frame on the wire, drawn anew for each cycle.
  void set_stack_delay(std::function<Duration()> delay) { stack_ = std::move(delay); }
  /// What becomes of a frame on its way back from the drives; false: it is lost.
  using WayBack = std::function<bool(const ethercat::FrameView&)>;
  void set_way_back(WayBack way_back) { way_back_ = std::move(way_back); }
  /// Until the cyclic part; false: it came to an end before, node().main().failure() tells why.
  bool bring_up();
  /// One cycle whose task wakes `late` after its trigger, and whose frame does not come back if it
  /// is `lost` (nor reach the drives).
  const CycleDecision& cycle(Duration late, bool lost = false);
  /// All drives to SAFEOP, one frame each millisecond.
  void stop();
  /// One frame of the bring-up or of the way down, now; false: it did not come back.
  bool exchange(bool lost = false);
  void wait(Duration time) noexcept { now_ = now_ + time; }

  [[nodiscard]] node::CycleNode& node() noexcept { return *node_; }
  [[nodiscard]] const node::CycleNode& node() const noexcept { return *node_; }
  [[nodiscard]] ethercat::WireTime now() const noexcept { return now_; }
  /// What the host's clock shows at an instant, and when it shows a reading.
  [[nodiscard]] FreeRunningTime shown_at(ethercat::WireTime instant);
  [[nodiscard]] ethercat::WireTime instant_of(FreeRunningTime reading);

 private:
  bool pass(ethercat::ConstBytes frame, bool lost);

  ethercat::Segment& segment_;
  Oscillator* crystal_;
  std::unique_ptr<node::CycleNode> node_;
  ethercat::WireTime now_;
  ethercat::FrameStamps stamps_;
  PlantClock plant_;
  std::function<Duration()> noise_;
  std::function<Duration()> stack_;
  WayBack way_back_;
  std::array<std::uint8_t, ethercat::kMaxFrameSize> buffer_{};
};

}  // namespace ftcs::sim
