// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/wire/sii.h"
#include "ftcs/sim/drives/esc_memory.h"
#include "ftcs/sim/drives/object_dictionary.h"

namespace ftcs::ethercat {

/// The EEPROM of a modelled SubDevice, 2 KiByte, as ETG.2010 lays it out.
using SiiImage = std::array<std::uint8_t, 2048>;

/// Mailboxes of 128 bytes at 0x1000 and 0x1080, process data at 0x1100 and 0x1400; eight strings at
/// most. `with_dc`: a category 60 with AssignActivate 0x0300 (SYNC0).
[[nodiscard]] SiiImage make_drive_image(const Identity& identity, std::uint16_t alias,
                                        bool with_dc) noexcept;
/// The same for a bridge terminal: no outputs, its time stamps as inputs, no SYNC signals.
[[nodiscard]] SiiImage make_bridge_image(const Identity& identity, std::uint16_t alias) noexcept;

/// The EEPROM interface of a controller, 0x0500 to 0x050F (ETG.1000.4, 6.4): it answers within the
/// frame, reads eight bytes at once and takes writes of one word.
class SiiInterface {
 public:
  explicit SiiInterface(EscMemory& memory, const SiiImage& image) noexcept
      : memory_(memory), image_(image) {}

  void power_on() noexcept;
  /// 0x0502 was written.
  void execute() noexcept;
  [[nodiscard]] const SiiImage& image() const noexcept { return image_; }

 private:
  void read(std::uint32_t word) noexcept;
  [[nodiscard]] bool write(std::uint32_t word) noexcept;
  EscMemory& memory_;
  SiiImage image_;
};

}  // namespace ftcs::ethercat
