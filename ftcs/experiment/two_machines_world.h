// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/experiment/two_machines.h"
#include "ftcs/sim/cycle_host.h"
#include "ftcs/sim/drives/simulated_crystal.h"
#include "ftcs/sim/random.h"
#include "ftcs/sim/settable_source.h"

namespace ftcs::experiment {

/// A host's own receiver of plant time: Sync and delay request with the grandmaster, whose clock is
/// true time, over one cable; hardware stamps on the host's crystal; the adaptive servo on a
/// virtual clock.
class PlantReceiver {
 public:
  PlantReceiver(const TwoMachinesWorld& world, sim::Oscillator& crystal, double phase_s);
  /// All messages until then.
  void advance(sim::TrueTime now);
  /// Plant time when the host's clock shows so much; none before the first lock.
  [[nodiscard]] std::optional<ReferenceTime> at(FreeRunningTime instant) const;
  /// The grandmaster shows so much more from now on; it is silent.
  void step(Duration by) noexcept { step_ = step_ + by; }
  /// Another way to the grandmaster: so long more from it and to it than the cable is.
  void take_another_path(Duration from, Duration to) noexcept {
    from_ = from;
    to_ = to;
  }
  void set_silent(bool silent) noexcept { silent_ = silent; }

 private:
  void exchange(sim::TrueTime sent);
  [[nodiscard]] Duration on_tick(Duration reading) const noexcept;

  const TwoMachinesWorld& world_;
  sim::Oscillator& crystal_;
  sim::SettableSource source_;
  VirtualClock clock_;
  ClockDiscipline discipline_;
  sim::TrueTime next_;
  Duration step_{};
  Duration from_{};
  Duration to_{};
  bool silent_ = false;
};

/// One machine: a host with its crystal and its receiver, a segment of drives, the node between.
class PlantMachine {
 public:
  PlantMachine(const TwoMachinesWorld& world, node::BusMode mode, bool plant, std::uint64_t seed,
               std::uint64_t index);
  [[nodiscard]] bool bring_up();
  /// One cycle of the host.
  void cycle();

  [[nodiscard]] sim::CycleHost& host() noexcept { return *host_; }
  [[nodiscard]] PlantReceiver& receiver() noexcept { return receiver_; }
  [[nodiscard]] ethercat::Segment& segment() noexcept { return *segment_; }
  /// System time of a drive at an instant, less the instant itself, folded to half a cycle.
  [[nodiscard]] double error_ns(std::size_t drive, ethercat::WireTime instant) const;
  [[nodiscard]] std::uint64_t faults() const noexcept;

 private:
  [[nodiscard]] static sim::OscillatorSpec crystal_of(const TwoMachinesWorld& world,
                                                      sim::RandomStream& draw, double initial_s);
  [[nodiscard]] static node::CycleNodeConfig node_config(const TwoMachinesWorld& world,
                                                         node::BusMode mode);

  const TwoMachinesWorld& world_;
  sim::RandomStream draw_;
  sim::RandomStream lateness_;
  sim::RandomStream noise_;
  sim::Oscillator crystal_;
  PlantReceiver receiver_;
  std::unique_ptr<ethercat::Segment> segment_;
  std::array<std::unique_ptr<sim::SimulatedCrystal>, TwoMachinesWorld::kDrives> drive_crystals_;
  std::unique_ptr<sim::CycleHost> host_;
};

}  // namespace ftcs::experiment
