// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/network.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {

/// Position of a port in the order in which frames visit them.
std::size_t order_of(unsigned port) noexcept {
  const auto* found = std::find(std::begin(kPortOrder), std::end(kPortOrder), port);
  return static_cast<std::size_t>(found - std::begin(kPortOrder));
}

/// The open port after this one, as an index into kPortOrder; reg::kPorts if there is none.
std::size_t next_open(const SubDeviceInfo& device, std::size_t order) noexcept {
  do {
    ++order;
  } while (order < reg::kPorts && !device.links.open(kPortOrder[order]));
  return order;
}

unsigned previous_open_port(const SubDeviceInfo& device, unsigned port) noexcept {
  std::size_t order = order_of(port) - 1;
  while (order > 0 && !device.links.open(kPortOrder[order])) --order;
  return kPortOrder[order];
}

unsigned last_open_port(const SubDeviceInfo& device) noexcept {
  std::size_t order = reg::kPorts - 1;
  while (order > 0 && !device.links.open(kPortOrder[order])) --order;
  return kPortOrder[order];
}

/// Wrap-aware difference of two 32-bit latches.
std::int64_t between(const SubDeviceInfo& device, unsigned from, unsigned to) noexcept {
  return static_cast<std::uint32_t>(device.receive_times[to] - device.receive_times[from]);
}

}  // namespace

std::size_t Network::clocks() const noexcept {
  const auto devices_here = all();
  return static_cast<std::size_t>(
      std::count_if(devices_here.begin(), devices_here.end(),
                    [](const SubDeviceInfo& device) { return device.dc(); }));
}

bool resolve_topology(Network& network) noexcept {
  struct Branch {
    std::size_t device = 0;
    std::size_t order = 0;
  };
  std::array<Branch, kMaxSubDevices> stack{};
  std::size_t depth = 0;
  for (std::size_t position = 0; position < network.count; ++position) {
    SubDeviceInfo& device = network.devices[position];
    if (!device.links.open(0)) return false;
    if (position > 0) {
      while (depth > 0) {
        Branch& branch = stack[depth - 1];
        branch.order = next_open(network.devices[branch.device], branch.order);
        if (branch.order < reg::kPorts) break;
        --depth;
      }
      if (depth == 0) return false;
      device.parent = static_cast<int>(stack[depth - 1].device);
      device.parent_port = kPortOrder[stack[depth - 1].order];
    }
    stack[depth++] = {position, 0};
  }
  // Whoever is left over must have no further open port.
  return std::all_of(stack.begin(), stack.begin() + static_cast<std::ptrdiff_t>(depth),
                     [&network](const Branch& branch) {
                       return next_open(network.devices[branch.device], branch.order) ==
                              reg::kPorts;
                     });
}

void compute_propagation_delays(Network& network, Nanoseconds processing_excess) noexcept {
  const std::int64_t excess = processing_excess.count();
  for (std::size_t position = network.reference; position < network.count; ++position) {
    SubDeviceInfo& b = network.devices[position];
    b.propagation_delay = 0;
    if (!b.dc()) continue;
    // SubDevices without a clock are part of the cable.
    int parent = b.parent;
    unsigned port = b.parent_port;
    while (parent >= 0 && !network.devices[static_cast<std::size_t>(parent)].dc()) {
      port = network.devices[static_cast<std::size_t>(parent)].parent_port;
      parent = network.devices[static_cast<std::size_t>(parent)].parent;
    }
    if (parent < 0) continue;  // the reference itself
    const SubDeviceInfo& a = network.devices[static_cast<std::size_t>(parent)];
    const unsigned before = previous_open_port(a, port);
    const unsigned last = last_open_port(b);
    const std::int64_t out = before == 0 ? excess : 0;
    const std::int64_t back = last == 0 ? excess : 0;
    const std::int64_t loop = between(a, before, port) - between(b, 0, last);
    const std::int64_t delay = (loop + out - back) / 2;
    b.propagation_delay =
        static_cast<std::uint32_t>(a.propagation_delay + between(a, 0, before) + delay);
  }
}

}  // namespace ftcs::ethercat
