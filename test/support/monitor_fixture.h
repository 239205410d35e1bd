// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "ftcs/time/duration.h"

/// For tests: a ptp4l that reports one Sync or Delay_Req a datagram, made octet by octet.
namespace ftcs::ptp::fake {

inline void append(std::vector<std::uint8_t>& bytes, std::uint64_t value, int octets) {
  for (int i = octets; i-- > 0;) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
inline void append_time(std::vector<std::uint8_t>& bytes, std::int64_t ns) {
  append(bytes, static_cast<std::uint64_t>(ns / kNsPerSecond), 6);
  append(bytes, static_cast<std::uint64_t>(ns % kNsPerSecond), 4);
}

/// A Sync that left at `origin` and came at `local`, or a Delay_Req.
inline std::vector<std::uint8_t> report(bool sync, std::uint16_t sequence, std::int64_t reference,
                                        std::int64_t local, std::uint8_t transmitter = 0xA) {
  std::vector<std::uint8_t> bytes{0x0c, 0x02, 0, static_cast<std::uint8_t>(sync ? 92 : 88)};
  bytes.resize(44);
  append(bytes, sync ? 0x8004 : 0x7F00, 2);
  append(bytes, sync ? 44 : 40, 2);
  append(bytes, 0x020000FFFE000000U + transmitter, 8);
  append(bytes, 1, 2);
  append(bytes, sequence, 2);
  append_time(bytes, sync ? reference : local);
  append(bytes, 0, 8);
  if (sync) append(bytes, 0, 4);
  append_time(bytes, sync ? local : reference);
  return bytes;
}

}  // namespace ftcs::ptp::fake
