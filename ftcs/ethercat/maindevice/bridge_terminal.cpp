// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/bridge_terminal.h"

#include <algorithm>

namespace ftcs::ethercat::bridge {

namespace {

struct Product {
  std::uint32_t vendor;
  std::uint32_t product;
};
constexpr Product kKnown[] = {
    {0x00000002, 0x1A243052},  // Beckhoff EL6692
    {0x00000002, 0x1A273052},  // Beckhoff EL6695
    {0x0000F7C5, 0x00006695},  // the modelled one
};

bool is_known(const Identity& identity) noexcept {
  return std::any_of(std::begin(kKnown), std::end(kKnown), [&identity](const Product& known) {
    return known.vendor == identity.vendor && known.product == identity.product;
  });
}

}  // namespace

bool choose(Network& network, std::size_t wanted) noexcept {
  network.bridge = Network::kNoBridge;
  for (std::size_t n = 0; n < network.count; ++n) {
    const SubDeviceInfo& device = network.devices[n];
    const bool meant = wanted == kFirst ? is_known(device.sii.identity) : wanted == n;
    if (!meant) continue;
    if (device.sii.coe() && device.dc64()) network.bridge = n;
    break;
  }
  return network.bridge != Network::kNoBridge;
}

}  // namespace ftcs::ethercat::bridge
