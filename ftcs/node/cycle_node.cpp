// SPDX-License-Identifier: MIT
#include "ftcs/node/cycle_node.h"

#include <algorithm>

#include "ftcs/time/relabel.h"

namespace ftcs::node {

namespace {
/// The frame has half a cycle until SYNC0: who leads may be off the drives by a little, no more.
constexpr Nanoseconds kLeadBand{5'000};
}  // namespace

CycleNode::Objects CycleNode::objects_for(const CycleNodeConfig& config) noexcept {
  Objects objects{};
  const auto csp = ethercat::csp_objects(config.servo.cycle);
  static_assert(csp.size() + 1 == kObjects);
  std::copy(csp.begin(), csp.end(), objects.begin());
  objects.back() = {{0x10F1, 2}, 2, config.sync_error_limit.value_or(0), false};
  return objects;
}

ethercat::MainDeviceConfig CycleNode::main_config(const CycleNodeConfig& config,
                                                  const Objects& objects) noexcept {
  ethercat::MainDeviceConfig result = config.main;
  const std::size_t used = config.sync_error_limit ? kObjects : kObjects - 1;
  result.process.objects = std::span{objects}.first(used);
  result.needs_reference = config.bus_mode != BusMode::kFollow;
  result.process.cycle = config.servo.cycle;
  const auto phase = config.sync0_phase * static_cast<double>(config.servo.cycle.count());
  result.process.sync0_shift = config.servo.shift + Nanoseconds{static_cast<std::int64_t>(phase)};
  result.process.drive_sync = config.drive_sync;
  return result;
}

BusClockConfig CycleNode::bus_config(const CycleNodeConfig& config) noexcept {
  BusClockConfig result = config.bus;
  result.steer = config.bus_mode != BusMode::kFollow && config.bus_write == BusWrite::kOffset;
  result.cycle = config.servo.cycle;
  result.sample_interval = std::max(result.sample_interval, result.cycle);
  result.sync0_phase = config.sync0_phase;
  return result;
}

CycleNode::CycleNode(const CycleNodeConfig& config) noexcept
    : config_(config),
      objects_(objects_for(config)),
      main_(main_config(config_, objects_)),
      servo_(config.servo),
      bus_(bus_config(config)),
      axes_(config.axes),
      supervision_(config.supervision, config.servo.law != CycleLaw::kNone),
      clocks_(config.difference_limit) {}

const CycleDecision& CycleNode::start(FreeRunningTime now) noexcept {
  bridge_.start(main_.network().bridge == main_.network().reference);
  decision_ = servo_.start(now);
  return decision_;
}

/// As other MainDevices do it; here to be compared with.
void CycleNode::write_time(FreeRunningTime now, ReferenceTime plant) noexcept {
  const Duration late =
      config_.bus_write == BusWrite::kTargetTime ? now - decision_.wake : Duration{};
  main_.write_system_time(plant - late + Duration{config_.servo.transit});
}

ethercat::ConstBytes CycleNode::begin_cycle(FreeRunningTime now,
                                            std::optional<ReferenceTime> plant) noexcept {
  notes_.clear();
  // All axes from one time: the reference's, as the steered clock knows it.
  const double time_s = servo_.next_trigger().local.since_epoch().seconds();
  axes_.cycle(main_, supervision_.op_cycle() >= 0, time_s, notes_);
  if (decision_.state != CycleState::kWaiting) {
    // The steered clock is what the other drives are given, should the reference be missing.
    const LocalTime at_reference = servo_.local_at(now) + Duration{config_.servo.transit};
    main_.set_reference_estimate(relabel<ReferenceTime>(at_reference));
  }
  const bool writes =
      config_.bus_mode != BusMode::kFollow && config_.bus_write != BusWrite::kOffset;
  if (writes && plant) write_time(now, *plant);
  return main_.next_frame();
}

const CycleDecision& CycleNode::end_cycle(bool answered, const ethercat::FrameStamps& stamps,
                                          FreeRunningTime now) noexcept {
  if (!answered) main_.on_timeout();
  sample_ = {};
  sample_.sent = stamps.sent;
  sample_.received = stamps.received;
  sample_.has_received = answered;
  sample_.has_reference = answered && main_.last_cycle().has_reference;
  sample_.reference = main_.last_cycle().reference;
  const auto plant = plant_at_reference(answered, stamps);
  if (config_.bus_mode == BusMode::kLead && sample_.has_reference && plant) lead(*plant);
  decision_ = servo_.update(sample_, now);
  watch_bus(answered, plant);
  const bool ready =
      config_.bus_mode == BusMode::kFollow || bus_.decision().state == BusClockState::kLocked;
  supervision_.cycle(main_, decision_.state, ready, notes_);
  clocks_.cycle(main_, settled(), notes_);
  return decision_;
}

/// A second after the first OP: the clocks have been together for as long.
bool CycleNode::settled() const noexcept {
  const std::int64_t op = supervision_.op_cycle();
  const auto cycles = static_cast<std::int64_t>(servo_.counters().cycles);
  return op >= 0 && (cycles - op) * config_.servo.cycle.count() > 1'000'000'000;
}

/// Plant time when this cycle's frame passed the reference.
std::optional<ReferenceTime> CycleNode::plant_at_reference(
    bool answered, const ethercat::FrameStamps& stamps) noexcept {
  const ethercat::Network& network = main_.network();
  if (!config_.main.process.bridge) {
    if (!stamps.has_system_time) return std::nullopt;
    return stamps.system_time + Duration{config_.servo.transit};
  }
  // After a lost frame the register is not certain, and an older one's figures are not this
  // frame's.
  if (!sample_.has_reference || !offset_certain_) return std::nullopt;
  bridge_.on_frame(relabel<LocalTime>(sample_.reference), bus_offset_ns_);
  const ethercat::ConstBytes inputs = main_.inputs(network.bridge);
  const bool there = answered && main_.takes_part(network.bridge) &&
                     main_.last_cycle().inputs_valid &&
                     inputs.size() >= ethercat::bridge::kInputSize;
  if (there) bridge_.on_inputs(ethercat::bridge::Inputs::decode(inputs));
  return bridge_.plant(bus_.decision().tracking);
}

/// It is plant time that the cycle follows, as long as the drives are there too: should plant time
/// stay away, or jump, the cycle stays with its drives.
void CycleNode::lead(ReferenceTime plant) noexcept {
  const LocalTime drives = relabel<LocalTime>(sample_.reference);
  if (abs(offset_from_reference(drives, plant)) < Duration{kLeadBand}) sample_.reference = plant;
}

void CycleNode::watch_bus(bool answered, std::optional<ReferenceTime> plant) noexcept {
  using Kind = CycleNote::Kind;
  const ethercat::CycleReport& report = main_.last_cycle();
  BusClockSample sample;
  // The servo's gates know a stamp of the host that is wrong; after a lost frame the register is
  // not certain.
  const bool trusted =
      config_.main.process.bridge.has_value() || decision_.verdict == CycleVerdict::kUsed;
  sample.has_dc = answered && report.has_reference && offset_certain_;
  sample.usable = sample.has_dc && plant.has_value() && trusted;
  sample.dc = relabel<LocalTime>(report.reference);
  sample.plant = plant.value_or(ReferenceTime{});
  sample.offset_ns = bus_offset_ns_;
  const BusClockState before = bus_.decision().state;
  bus_offset_ns_ = bus_.decision().offset_ns;  // this frame has written it
  offset_certain_ = answered;
  const BusClockDecision& decision = bus_.update(sample);
  if (config_.bus_write == BusWrite::kOffset) {
    main_.shift_system_time(decision.offset_ns - bus_offset_ns_);
  }
  if (decision.state == before) return;
  if (decision.state == BusClockState::kHoldover) notes_.add(Kind::kPlantTimeLost);
  if (before == BusClockState::kHoldover) notes_.add(Kind::kPlantTimeBack);
  if (decision.state == BusClockState::kLocked) notes_.add(Kind::kBusLocked);
  if (before == BusClockState::kLocked && decision.state == BusClockState::kAcquiring) {
    notes_.add(Kind::kBusLockLost);
  }
}

std::int64_t CycleNode::margin_ns() const noexcept {
  const auto cycle = config_.servo.cycle.count();
  const auto until_sync0 =
      static_cast<std::int64_t>(main_.sync0_start()) - sample_.reference.since_epoch().rounded_ns();
  return ((until_sync0 % cycle) + cycle) % cycle;
}

}  // namespace ftcs::node
