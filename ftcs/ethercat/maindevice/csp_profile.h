// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/sdo_client.h"
#include "ftcs/ethercat/wire/bytes.h"

namespace ftcs::ethercat {

/// 0x60C2 as mantissa and power of ten in seconds; a mantissa of zero: not representable.
struct InterpolationPeriod {
  std::uint8_t mantissa = 0;
  std::int8_t exponent = -9;

  /// 1 ms is 1e-3, 250 us is 25e-5; 123,456 ns cannot be written.
  [[nodiscard]] static constexpr InterpolationPeriod of(Nanoseconds cycle) noexcept {
    std::int64_t mantissa = cycle.count();
    int exponent = -9;
    while (mantissa > 0 && mantissa % 10 == 0) {
      mantissa /= 10;
      ++exponent;
    }
    if (mantissa <= 0 || mantissa > 0xFF) return {};
    return {static_cast<std::uint8_t>(mantissa), static_cast<std::int8_t>(exponent)};
  }
};

/// Objects that make a CiA 402 drive ready for cyclic synchronous position with SYNC0: mapping
/// (controlword, target position, mode; statusword, position, mode), sync type and cycle times.
/// Many drives find sync type and cycle out by themselves and do not let them be written.
///
///     0x1C12, 0x1C13   which PDOs sync managers 2 and 3 carry: count (sub-index 0), then PDOs
///     0x1600           RxPDO: 0x6040 controlword 16 bits, 0x607A target 32, 0x6060 mode 8
///     0x1A00           TxPDO: 0x6041 statusword 16 bits, 0x6064 position 32, 0x6061 mode 8
///     0x1C32:01, :02   synchronisation: 2 = by SYNC0; cycle time, ns
///     0x60C2:01, :02   interpolation period: mantissa 10^exponent s
///     0x6060           mode of operation: 8 = cyclic synchronous position
///
/// A mapping entry is index << 16 | sub-index << 8 | bits (ETG.1000.6, 5.6.7.4.7). Valid: 0 < cycle
/// < 2^32 ns; a cycle that 0x60C2 cannot hold (mantissa up to 255) is written as 0.
[[nodiscard]] constexpr std::array<SdoDownload, 21> csp_objects(Nanoseconds cycle) noexcept {
  const auto cycle_ns = static_cast<std::uint32_t>(cycle.count());
  const InterpolationPeriod period = InterpolationPeriod::of(cycle);
  return {{
      {{0x1C12, 0}, 1, 0},
      {{0x1600, 0}, 1, 0},
      {{0x1600, 1}, 4, 0x60400010},
      {{0x1600, 2}, 4, 0x607A0020},
      {{0x1600, 3}, 4, 0x60600008},
      {{0x1600, 0}, 1, 3},
      {{0x1C12, 1}, 2, 0x1600},
      {{0x1C12, 0}, 1, 1},
      {{0x1C13, 0}, 1, 0},
      {{0x1A00, 0}, 1, 0},
      {{0x1A00, 1}, 4, 0x60410010},
      {{0x1A00, 2}, 4, 0x60640020},
      {{0x1A00, 3}, 4, 0x60610008},
      {{0x1A00, 0}, 1, 3},
      {{0x1C13, 1}, 2, 0x1A00},
      {{0x1C13, 0}, 1, 1},
      {{0x1C32, 1}, 2, 2, false},
      {{0x1C32, 2}, 4, cycle_ns, false},
      {{0x60C2, 1}, 1, period.mantissa, false},
      {{0x60C2, 2}, 1, static_cast<std::uint8_t>(period.exponent), false},
      {{0x6060, 0}, 1, 8},
  }};
}

/// Where the mapping above puts things in the process data of one drive.
namespace csp {
inline constexpr std::size_t kOutputSize = 7;
inline constexpr std::size_t kInputSize = 7;
inline constexpr std::int8_t kMode = 8;

/// What a drive tells; octets little-endian, in the order of the mapping.
struct Inputs {
  std::uint16_t statusword = 0;  ///< 0x6041, states: CiA 402, 6.3
  std::int32_t position = 0;     ///< 0x6064, counts
  std::int8_t mode = 0;
  /// bytes.size() must be at least kInputSize.
  [[nodiscard]] static Inputs decode(ConstBytes bytes) noexcept {
    return {load<std::uint16_t>(bytes, 0), static_cast<std::int32_t>(load<std::uint32_t>(bytes, 2)),
            static_cast<std::int8_t>(bytes[6])};
  }
};

/// What a drive is told.
struct Outputs {
  std::uint16_t controlword = 0;  ///< 0x6040
  std::int32_t target = 0;        ///< 0x607A, counts: where to be at the SYNC0 that follows
  std::int8_t mode = kMode;
  /// bytes.size() must be at least kOutputSize.
  void encode(Bytes bytes) const noexcept {
    store(bytes, 0, controlword);
    store(bytes, 2, static_cast<std::uint32_t>(target));
    bytes[6] = static_cast<std::uint8_t>(mode);
  }
};
}  // namespace csp

}  // namespace ftcs::ethercat
