// SPDX-License-Identifier: MIT
#include "ftcs/platform/network_interface.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <linux/ethtool.h>
#include <linux/net_tstamp.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace ftcs::platform {
namespace {

ifreq request_for(const std::string& name) {
  ifreq request{};
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

OsError interface_error(int number, const std::string& name) {
  OsError error = os_error(number, "interface " + name);
  // An unknown name is ENODEV from Linux and EINVAL from simulators.
  if (number == EINVAL) error.kind = OsErrorKind::kNoSuchInterface;
  return error;
}

constexpr std::uint32_t kHardware =
    SOF_TIMESTAMPING_TX_HARDWARE | SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
constexpr std::uint32_t kSoftware =
    SOF_TIMESTAMPING_TX_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;

}  // namespace

Result<InterfaceState, OsError> interface_state(Kernel& kernel, int fd, const std::string& name) {
  if (name.empty() || name.size() >= IFNAMSIZ) return interface_error(ENODEV, name);
  ifreq request = request_for(name);
  if (const int result = kernel.control(fd, SIOCGIFINDEX, &request); result < 0) {
    return interface_error(-result, name);
  }
  InterfaceState state;
  state.index = request.ifr_ifindex;
  request = request_for(name);
  if (const int result = kernel.control(fd, SIOCGIFFLAGS, &request); result < 0) {
    return interface_error(-result, name);
  }
  const auto flags = static_cast<unsigned>(static_cast<unsigned short>(request.ifr_flags));
  state.up = (flags & IFF_UP) != 0;
  state.running = (flags & IFF_RUNNING) != 0;
  state.loopback = (flags & IFF_LOOPBACK) != 0;
  return state;
}

Result<InterfaceCapabilities, OsError> interface_capabilities(Kernel& kernel, int fd,
                                                              const std::string& name) {
  InterfaceCapabilities capabilities;
  ifreq request = request_for(name);
  if (const int result = kernel.control(fd, SIOCGIFHWADDR, &request); result < 0) {
    return interface_error(-result, name);
  }
  std::copy_n(reinterpret_cast<const std::uint8_t*>(request.ifr_hwaddr.sa_data),
              capabilities.mac.size(), capabilities.mac.begin());

  ethtool_ts_info info{};
  info.cmd = ETHTOOL_GET_TS_INFO;
  request = request_for(name);
  request.ifr_data = reinterpret_cast<char*>(&info);
  if (kernel.control(fd, SIOCETHTOOL, &request) < 0) {
    // A driver that cannot say (and a simulator's loopback): the kernel can still stamp in
    // software.
    capabilities.software_timestamps = true;
    return capabilities;
  }
  capabilities.software_timestamps = (info.so_timestamping & kSoftware) == kSoftware;
  capabilities.hardware_timestamps =
      (info.so_timestamping & kHardware) == kHardware && info.phc_index >= 0;
  capabilities.phc_index = info.phc_index;
  capabilities.receive_filters = info.rx_filters;
  return capabilities;
}

Result<InterfaceCapabilities, OsError> interface_capabilities(Kernel& kernel,
                                                              const std::string& name) {
  const int fd = kernel.socket(AF_INET, SOCK_DGRAM);
  if (fd < 0) return os_error(-fd, "socket");
  const Descriptor socket(kernel, fd);
  return interface_capabilities(kernel, fd, name);
}

Result<InterfaceState, OsError> interface_state(Kernel& kernel, const std::string& name) {
  const int fd = kernel.socket(AF_INET, SOCK_DGRAM);
  if (fd < 0) return os_error(-fd, "socket");
  const Descriptor socket(kernel, fd);
  return interface_state(kernel, fd, name);
}

std::optional<OsError> missing_ipv4_address(Kernel& kernel, int fd, const std::string& name) {
  ifreq request = request_for(name);
  request.ifr_addr.sa_family = AF_INET;
  // Only this answer is proof; a simulator does not know the question.
  const int result = kernel.control(fd, SIOCGIFADDR, &request);
  if (result == -EADDRNOTAVAIL) return os_error(EADDRNOTAVAIL, "interface " + name);
  return std::nullopt;
}

namespace {

/// Asking needs no right: somebody who had it may have switched the stamps on already.
bool stamps_already(Kernel& kernel, int fd, const std::string& name, unsigned wanted_filters) {
  hwtstamp_config config{};
  ifreq request = request_for(name);
  request.ifr_data = reinterpret_cast<char*>(&config);
  if (kernel.control(fd, SIOCGHWTSTAMP, &request) < 0) return false;
  return config.tx_type == HWTSTAMP_TX_ON && config.rx_filter >= 0 && config.rx_filter < 32 &&
         ((1U << static_cast<unsigned>(config.rx_filter)) & wanted_filters) != 0;
}

/// The narrowest filter that passes PTP event messages comes first; drivers widen it as they need.
constexpr std::array<hwtstamp_rx_filters, 3> useful_filters(bool ethernet) {
  return {ethernet ? HWTSTAMP_FILTER_PTP_V2_L2_EVENT : HWTSTAMP_FILTER_PTP_V2_L4_EVENT,
          HWTSTAMP_FILTER_PTP_V2_EVENT, HWTSTAMP_FILTER_ALL};
}

constexpr unsigned bits(const std::array<hwtstamp_rx_filters, 3>& filters) {
  unsigned wanted = 0;
  for (const auto filter : filters) wanted |= 1U << static_cast<unsigned>(filter);
  return wanted;
}

}  // namespace

bool has_hardware_timestamps_on(Kernel& kernel, const std::string& name, bool ethernet) {
  const int fd = kernel.socket(AF_INET, SOCK_DGRAM);
  if (fd < 0) return false;
  const Descriptor socket(kernel, fd);
  return stamps_already(kernel, fd, name, bits(useful_filters(ethernet)));
}

std::optional<OsError> enable_hardware_timestamps(Kernel& kernel, int fd, const std::string& name,
                                                  const InterfaceCapabilities& capabilities,
                                                  bool ethernet) {
  const auto filters = useful_filters(ethernet);
  int result = -ERANGE;
  // Whoever switched them on may need a wider filter than we do.
  if (stamps_already(kernel, fd, name, bits(filters))) return std::nullopt;
  for (const auto filter : filters) {
    if ((capabilities.receive_filters & (1U << filter)) == 0) continue;
    hwtstamp_config config{};
    config.tx_type = HWTSTAMP_TX_ON;
    config.rx_filter = filter;
    ifreq request = request_for(name);
    request.ifr_data = reinterpret_cast<char*>(&config);
    result = kernel.control(fd, SIOCSHWTSTAMP, &request);
    if (result >= 0) return std::nullopt;
    if (result == -EPERM) break;
  }
  return os_error(-result, "hardware time stamping on " + name);
}

Result<std::array<std::uint8_t, 6>, OsError> identity_address(Kernel& kernel,
                                                              const std::string& name) {
  const auto capabilities = interface_capabilities(kernel, name);
  if (!capabilities) return capabilities.error();
  std::array<std::uint8_t, 6> address = capabilities->mac;
  if (address == std::array<std::uint8_t, 6>{}) {
    constexpr std::uint8_t kLocallyAdministered = 0x02;
    const auto process = static_cast<std::uint32_t>(::getpid());
    for (std::size_t i = 0; i < sizeof process; ++i) {
      address[2 + i] = static_cast<std::uint8_t>(process >> (24 - 8 * i));
    }
    address[0] = kLocallyAdministered;
  }
  return address;
}

std::optional<in_addr> parse_ipv4(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return address;
}

}  // namespace ftcs::platform
