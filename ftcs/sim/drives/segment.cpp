// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/segment.h"

namespace ftcs::ethercat {

Result<std::size_t, SegmentError> Segment::add(const SubDeviceConfig& config, const Wiring& wiring,
                                               LocalOscillator& oscillator) noexcept {
  if (count_ == kMaxSubDevices) return SegmentError::kFull;
  const bool first = count_ == 0;
  if (first != (wiring.parent == Wiring::kMainDevice)) return SegmentError::kNoSuchParent;
  if (!first) {
    if (wiring.parent < 0 || wiring.parent >= static_cast<int>(count_)) {
      return SegmentError::kNoSuchParent;
    }
    const bool exists = wiring.parent_port >= 1 && wiring.parent_port < reg::kPorts;
    if (!exists || child(static_cast<std::size_t>(wiring.parent), wiring.parent_port) >= 0) {
      return SegmentError::kPortTaken;
    }
  }
  const std::size_t number = count_++;
  wiring_[number] = wiring;
  devices_[number].emplace(config, oscillator);
  plan();
  return number;
}

int Segment::child(std::size_t device, unsigned port) const noexcept {
  for (std::size_t n = 1; n < count_; ++n) {
    const bool here = wiring_[n].parent == static_cast<int>(device);
    if (here && wiring_[n].parent_port == port) return static_cast<int>(n);
  }
  return -1;
}

/// The way of a frame, planned once: from port 0 through the processing unit to the ports in the
/// order 3, 1, 2, into whatever hangs there, and back out of port 0.
void Segment::plan() noexcept {
  hop_count_ = 0;
  reachable_ = 0;
  total_ = {};
  if (count_ == 0) return;
  devices_[0]->set_port_open(0, !cut_[0]);
  if (cut_[0]) return;
  struct Visit {
    std::size_t device = 0;
    std::size_t order = 0;  ///< index in kPortOrder of the port it came in at last
  };
  std::array<Visit, kMaxSubDevices> stack{};
  std::size_t depth = 1;
  Duration at{};
  hops_[hop_count_++] = {0, 0, at};
  ++reachable_;
  while (depth > 0) {
    Visit& visit = stack[depth - 1];
    const Wiring& wiring = wiring_[visit.device];
    const Duration inside = visit.order == 0 ? wiring.processing : wiring.forwarding;
    int next = -1;
    while (next < 0 && ++visit.order < reg::kPorts) {
      const unsigned port = kPortOrder[visit.order];
      next = child(visit.device, port);
      const bool joined = next >= 0 && !cut_[static_cast<std::size_t>(next)];
      devices_[visit.device]->set_port_open(port, joined);
      if (!joined) next = -1;
    }
    at += inside;
    if (next >= 0) {
      const auto device = static_cast<std::size_t>(next);
      devices_[device]->set_port_open(0, true);
      at += wiring_[device].cable;
      hops_[hop_count_++] = {static_cast<std::uint8_t>(device), 0, at};
      ++reachable_;
      stack[depth++] = {device, 0};
      continue;
    }
    at += wiring.cable;
    if (--depth > 0) {
      const Visit& parent = stack[depth - 1];
      hops_[hop_count_++] = {static_cast<std::uint8_t>(parent.device), kPortOrder[parent.order],
                             at};
    }
  }
  total_ = at;
}

Segment::Passage Segment::pass(const FrameView& frame, WireTime sof) noexcept {
  // The cable between MainDevice and first SubDevice comes first and last.
  const WireTime entry = sof + wiring_[0].cable;
  for (std::size_t i = 0; i < hop_count_; ++i) {
    const Hop& hop = hops_[i];
    SubDevice& device = *devices_[hop.device];
    if (hop.port == 0) {
      device.process(frame, entry + hop.after);
    } else {
      device.frame_returned(hop.port, entry + hop.after);
    }
  }
  return {hop_count_ > 0, entry + total_};
}

void Segment::advance(WireTime now) noexcept {
  for (std::size_t n = 0; n < count_; ++n) devices_[n]->advance(now);
}

std::size_t Segment::at_position(std::size_t position) const noexcept {
  for (std::size_t i = 0; i < hop_count_; ++i) {
    if (hops_[i].port != 0) continue;
    if (position == 0) return hops_[i].device;
    --position;
  }
  return kMaxSubDevices;
}

Duration Segment::delay_to(std::size_t number) const noexcept {
  for (std::size_t i = 0; i < hop_count_; ++i) {
    if (hops_[i].device == number && hops_[i].port == 0) return hops_[i].after;
  }
  return {};
}

void Segment::set_cut(std::size_t number, bool cut) noexcept {
  cut_[number] = cut;
  if (cut) devices_[number]->set_port_open(0, false);
  plan();
}

void Segment::replace(std::size_t number, const SubDeviceConfig& config,
                      LocalOscillator& oscillator, WireTime now) noexcept {
  devices_[number].emplace(config, oscillator);
  plan();
  devices_[number]->power_cycle(now);
}

}  // namespace ftcs::ethercat
