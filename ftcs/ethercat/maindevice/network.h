// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "ftcs/ethercat/maindevice/failure.h"
#include "ftcs/ethercat/wire/channels.h"
#include "ftcs/ethercat/wire/datagram.h"
#include "ftcs/ethercat/wire/sii.h"
#include "ftcs/time/duration.h"

namespace ftcs::ethercat {

/// Fixed memory: what this MainDevice can run.
inline constexpr std::size_t kMaxSubDevices = 64;
/// Station addresses start here, in the order of the wire.
inline constexpr std::uint16_t kFirstStation = 0x1001;

/// A piece of the process image: offset from its start and size, bytes.
struct ImagePart {
  std::uint16_t offset = 0;
  std::uint16_t size = 0;
};

/// What the MainDevice learnt about one SubDevice.
struct SubDeviceInfo {
  std::uint16_t station = 0;
  std::uint8_t type = 0;
  std::uint8_t revision = 0;
  std::uint16_t build = 0;
  std::uint8_t fmmus = 0;
  std::uint8_t sync_managers = 0;
  std::uint8_t ram_kib = 0;
  std::uint16_t features = 0;
  std::uint16_t alias = 0;
  DlStatus links;
  SiiContent sii;

  static constexpr int kMainDevice = -1;
  int parent = kMainDevice;      ///< position of the SubDevice it hangs on
  std::uint8_t parent_port = 0;  ///< and at which port

  std::array<std::uint32_t, reg::kPorts> receive_times{};  ///< 0x0900, local time, mod 2^32 ns
  std::uint64_t receive_time = 0;                          ///< 0x0918: at the processing unit
  std::uint32_t propagation_delay = 0;   ///< 0x0928, ns from the reference to here
  std::uint64_t system_time_offset = 0;  ///< 0x0920, system less local, modulo 2^64 ns
  /// |0x092C|, ns, as read in its turn.
  std::uint32_t system_time_difference = 0;

  ImagePart outputs;
  ImagePart inputs;
  AlState state = AlState::kNone;
  bool error = false;
  AlStatusCode code = AlStatusCode::kNoError;

  /// It has a distributed clock; and one of 64 bits.
  [[nodiscard]] constexpr bool dc() const noexcept { return (features & reg::kFeatureDc) != 0; }
  [[nodiscard]] constexpr bool dc64() const noexcept { return (features & reg::kFeatureDc64) != 0; }
  [[nodiscard]] constexpr Target target(Command command, std::uint16_t offset) const noexcept {
    return {command, station, offset};
  }
  /// What 0x0130 to 0x0135 hold.
  void set_al_status(ConstBytes six_bytes) noexcept {
    const auto status = load<std::uint16_t>(six_bytes, 0);
    state = static_cast<AlState>(status & kAlStateMask);
    error = (status & kAlErrorFlag) != 0;
    code = static_cast<AlStatusCode>(load<std::uint16_t>(six_bytes, 4));
  }
};

/// All SubDevices, in the order of the wire.
struct Network {
  static constexpr std::size_t kNoReference = kMaxSubDevices;
  std::array<SubDeviceInfo, kMaxSubDevices> devices{};
  std::size_t count = 0;
  std::size_t reference = kNoReference;  ///< the first with a distributed clock
  static constexpr std::size_t kNoBridge = kMaxSubDevices;
  std::size_t bridge = kNoBridge;  ///< the bridge terminal that tells plant time

  [[nodiscard]] std::span<SubDeviceInfo> all() noexcept { return {devices.data(), count}; }
  [[nodiscard]] std::span<const SubDeviceInfo> all() const noexcept {
    return {devices.data(), count};
  }
  [[nodiscard]] bool has_reference() const noexcept { return reference < count; }
  /// How many have a distributed clock.
  [[nodiscard]] std::size_t clocks() const noexcept;
};

/// Finds the parent of each SubDevice from the open ports: a frame visits the ports in the order
/// 0, 3, 1, 2, so that the order of the wire and the open ports determine the tree. False if they
/// contradict each other (a SubDevice that does not answer, or entered by another port than 0).
[[nodiscard]] bool resolve_topology(Network& network) noexcept;

/// Propagation delays from the latched receive times, relative to the reference (0x0928).
///
///   d(A, B)  = ((tA[p] - tA[q]) - (tB[last] - tB[0]) + (x - y)) / 2
///   delay(B) = delay(A) + (tA[q] - tA[0]) + d(A, B)
///
/// B hangs on port p of A, q is the open port of A before p. x and y are what the way out of A and
/// the way back out of B cost beyond a plain forwarding: `processing_excess` (processing minus
/// forwarding delay) if q = 0, or if B is the end of a line, else zero. All differences modulo
/// 2^32, so that a wrap of the latches does no harm.
void compute_propagation_delays(Network& network, Nanoseconds processing_excess) noexcept;

}  // namespace ftcs::ethercat
