// SPDX-License-Identifier: MIT
#include "ftcs/experiment/two_machines_world.h"

#include <algorithm>
#include <cmath>

namespace ftcs::experiment {

using ethercat::WireTime;
using sim::TrueTime;

namespace {

/// Between two drives, and from the host to the first.
constexpr Nanoseconds kCable{50};

Duration seconds(double value) { return Duration::from_ns(value * 1e9); }

DisciplineConfig discipline_of(const TwoMachinesWorld& world) {
  DisciplineConfig config;
  config.servo.sync_interval = Nanoseconds{static_cast<std::int64_t>(world.sync_interval_s * 1e9)};
  return config;
}

VirtualClockConfig clock_of(sim::Oscillator& crystal) {
  const FreeRunningTime now = crystal.reading_at(TrueTime{});
  return {now, LocalTime{Duration::from_ns(50'000.0)}, Rate{}, RateLimits{}};
}

}  // namespace

PlantReceiver::PlantReceiver(const TwoMachinesWorld& world, sim::Oscillator& crystal,
                             double phase_s)
    : world_(world),
      crystal_(crystal),
      clock_(source_, clock_of(crystal)),
      discipline_(discipline_of(world), clock_),
      next_(seconds(phase_s * world.sync_interval_s)) {}

Duration PlantReceiver::on_tick(Duration reading) const noexcept {
  const auto tick = static_cast<std::int64_t>(world_.stamp_tick_ns);
  const std::int64_t whole = reading.floor_ns();
  return tick > 0 ? Duration::from_whole_ns(whole - whole % tick) : reading;
}

void PlantReceiver::exchange(TrueTime sent) {
  const Duration cable = Duration::from_ns(world_.cable_ns);
  const auto shown = [this](TrueTime t) {
    return FreeRunningTime{on_tick(crystal_.reading_at(t).since_epoch())};
  };
  const auto grandmaster = [this](TrueTime t) {
    return ReferenceTime{on_tick(t.since_epoch() + step_)};
  };
  const auto hear = [this](TrueTime t, const EventPair& pair) {
    source_.set(crystal_.reading_at(t));
    discipline_.on_pair(pair);
  };
  const TrueTime arrival = sent + cable + from_;
  hear(arrival, {Direction::kForward, grandmaster(sent), shown(arrival)});
  // The request leaves a third of an interval later; its answer is known soon after.
  const TrueTime request = sent + seconds(world_.sync_interval_s / 3.0);
  const TrueTime heard = request + cable + to_;
  const TrueTime known = heard + Duration::from_ns(20'000.0);
  hear(known, {Direction::kBackward, grandmaster(heard), shown(request)});
}

void PlantReceiver::advance(TrueTime now) {
  // An exchange is whole before its effect is seen: the last one ends half an interval ago.
  const Duration interval = seconds(world_.sync_interval_s);
  while (next_ + interval.half() < now) {
    if (!silent_) exchange(next_);
    next_ = next_ + interval;
  }
}

std::optional<ReferenceTime> PlantReceiver::at(FreeRunningTime instant) const {
  if (!discipline_.locked() || silent_) return std::nullopt;
  return relabel<ReferenceTime>(clock_.local_at(instant));
}

sim::OscillatorSpec PlantMachine::crystal_of(const TwoMachinesWorld& world, sim::RandomStream& draw,
                                             double initial_s) {
  sim::OscillatorSpec spec;
  spec.initial = FreeRunningTime{seconds(initial_s)};
  spec.grid = Nanoseconds{100'000'000};
  spec.parts = {sim::ConstantSkew{world.crystal_ppm * 1e-6 * (2.0 * draw.uniform() - 1.0)},
                sim::RandomWalkFm{world.wander}};
  return spec;
}

node::CycleNodeConfig PlantMachine::node_config(const TwoMachinesWorld& world, node::BusMode mode) {
  node::CycleNodeConfig config;
  config.main.clocks.drift_pulses = 3000;
  config.servo.law = CycleLaw::kAdaptive;
  config.servo.cycle = world.cycle;
  config.servo.transit = kCable;
  config.bus_mode = mode;
  config.bus_write = world.write;
  config.axes.radius = world.radius_um;
  config.axes.turn_s = world.turn_s;
  // Both machines are ready by then.
  config.axes.start_s = world.receiver_s + world.settling_s - 5.0;
  return config;
}

PlantMachine::PlantMachine(const TwoMachinesWorld& world, node::BusMode mode, bool plant,
                           std::uint64_t seed, std::uint64_t index)
    : world_(world),
      draw_(seed, "machine", index),
      lateness_(seed, "lateness", index),
      noise_(seed, "frame stamps", index),
      crystal_(crystal_of(world, draw_, plant ? 1e5 * static_cast<double>(index + 1) : 0.0), seed,
               index),
      receiver_(world, crystal_, draw_.uniform()),
      segment_(std::make_unique<ethercat::Segment>()) {
  for (std::size_t n = 0; n < drive_crystals_.size(); ++n) {
    const std::uint64_t number = 100 + 10 * index + n;
    drive_crystals_[n] = std::make_unique<sim::SimulatedCrystal>(crystal_of(world, draw_, 0.0),
                                                                 seed, number, WireTime{});
    static_cast<void>(segment_->add({}, {.parent = static_cast<int>(n) - 1, .cable = kCable},
                                    *drive_crystals_[n]));
  }
  const WireTime start{seconds(world.receiver_s + 0.01 * draw_.uniform())};
  host_ = std::make_unique<sim::CycleHost>(node_config(world, mode), *segment_, start, &crystal_);
  host_->set_stamp_noise(
      [this] { return Duration::from_ns(world_.frame_stamp_ns * noise_.normal()); });
  host_->set_stack_delay([this] {
    constexpr double kLeastUs = 5.0;
    return Duration::from_ns(1e3 * (kLeastUs + world_.mean_stack_us * noise_.exponential()));
  });
  if (plant) host_->set_plant_clock([this](FreeRunningTime t) { return receiver_.at(t); });
}

bool PlantMachine::bring_up() {
  receiver_.advance(relabel<TrueTime>(host_->now()));
  return host_->bring_up();
}

void PlantMachine::cycle() {
  constexpr double kLeastUs = 20.0;
  constexpr double kMostUs = 200.0;
  receiver_.advance(relabel<TrueTime>(host_->now()));
  const double late_us =
      std::min(kLeastUs + world_.mean_lateness_us * lateness_.exponential(), kMostUs);
  host_->cycle(Duration::from_ns(late_us * 1e3));
}

double PlantMachine::error_ns(std::size_t drive, WireTime instant) const {
  const auto cycle = world_.cycle.count();
  const auto shown = static_cast<std::int64_t>((*segment_)[drive].dc().system_time(instant));
  const Duration difference = Duration::from_whole_ns(shown) - instant.since_epoch();
  const double error =
      difference.ns() -
      static_cast<double>(cycle) * std::round(difference.ns() / static_cast<double>(cycle));
  return error;
}

std::uint64_t PlantMachine::faults() const noexcept {
  std::uint64_t count = 0;
  for (std::size_t n = 0; n < segment_->size(); ++n) {
    for (const auto& fault : (*segment_)[n].drive().faults()) count += fault.count;
  }
  return count;
}

}  // namespace ftcs::experiment
