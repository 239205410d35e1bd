// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "ftcs/ethercat/wire/frame.h"
#include "ftcs/sim/drives/dc_unit.h"
#include "ftcs/sim/drives/drive_application.h"
#include "ftcs/sim/drives/esc_memory.h"
#include "ftcs/sim/drives/oscillator.h"
#include "ftcs/sim/drives/sii_image.h"

namespace ftcs::ethercat {

/// The other side of a bridge terminal: the distributed clock of the segment there.
class OtherSide {
 public:
  /// None: it is not connected.
  [[nodiscard]] virtual std::optional<std::uint64_t> system_time(WireTime instant) noexcept = 0;

 protected:
  OtherSide() = default;
  OtherSide(const OtherSide&) = default;
  OtherSide& operator=(const OtherSide&) = default;
  ~OtherSide() = default;
};

struct SubDeviceConfig {
  /// 0xF7C5 is no vendor number of the EtherCAT Technology Group.
  Identity identity{0x0000F7C5, 0x00000402, 0x00010000, 0};
  std::uint16_t alias = 0;
  bool dc = true;
  bool dc64 = true;  ///< system time of 64 bits, else 32
  DcUnitConfig clock;
  /// Not null: this is a bridge terminal, and no drive; must outlive the SubDevice.
  OtherSide* other_side = nullptr;
};
/// As the modelled bridge terminal calls itself.
inline constexpr Identity kBridgeIdentity{0x0000F7C5, 0x00006695, 0x00010002, 0};

/// One SubDevice: the controller (ESC) with its memory, datagram rules and distributed clock, and a
/// CiA 402 drive behind it. All times are the start of frame at its port 0. No heap, no I/O; the
/// same code serves the simulator, the UDP and the raw Ethernet segment.
class SubDevice {
 public:
  SubDevice(const SubDeviceConfig& config, LocalOscillator& oscillator) noexcept;
  SubDevice(const SubDevice&) = delete;
  SubDevice& operator=(const SubDevice&) = delete;

  /// Everything volatile is lost; links stay.
  void power_cycle(WireTime now) noexcept;
  void set_port_open(unsigned port, bool open) noexcept;

  /// SYNC0, watchdog and waiting transitions up to now. Frames do it by themselves.
  void advance(WireTime now) noexcept;
  /// The frame passes the processing unit; datagrams are changed in place.
  void process(const FrameView& frame, WireTime sof) noexcept;
  /// The same frame came back at another port.
  void frame_returned(unsigned port, WireTime sof) noexcept {
    if (latching_) dc_.latch_return(port, sof);
  }

  [[nodiscard]] const DriveApplication& drive() const noexcept { return drive_; }
  [[nodiscard]] DriveApplication& drive() noexcept { return drive_; }
  [[nodiscard]] const DcUnit& dc() const noexcept { return dc_; }
  [[nodiscard]] const EscMemory& memory() const noexcept { return memory_; }
  /// 0x092C as a signed number: positive when the local copy is ahead.
  [[nodiscard]] std::int32_t system_time_difference() const noexcept;

 private:
  void process(const Datagram& datagram, WireTime sof) noexcept;
  void process_physical(const Datagram& datagram, WireTime sof) noexcept;
  void process_logical(const Datagram& datagram, WireTime sof) noexcept;
  [[nodiscard]] bool addressed(const Datagram& datagram) const noexcept;
  [[nodiscard]] bool read(std::size_t address, Bytes out, bool merge) noexcept;
  [[nodiscard]] bool write(std::size_t address, ConstBytes in, WireTime sof) noexcept;
  [[nodiscard]] bool writable(std::size_t address) const noexcept;
  void after_read(std::size_t address, std::size_t size) noexcept;
  void after_write(std::size_t address, ConstBytes in, WireTime sof) noexcept;
  void after_dc_write(std::size_t address, ConstBytes in, WireTime sof) noexcept;
  void decode_channels() noexcept;
  void latch_both_sides(WireTime now) noexcept;
  [[nodiscard]] bool mailbox_blocks(std::size_t address, std::size_t size,
                                    bool write) const noexcept;
  [[nodiscard]] bool map(const FmmuChannel& channel, const Datagram& datagram, bool write,
                         WireTime sof) noexcept;
  [[nodiscard]] bool map_bits(const FmmuChannel& channel, const Datagram& datagram,
                              bool write) noexcept;

  SubDeviceConfig config_;
  LocalOscillator& oscillator_;
  EscMemory memory_;
  DcUnit dc_;
  SiiInterface sii_;
  DriveApplication drive_;
  std::array<FmmuChannel, EscMemory::kFmmus> fmmus_{};
  std::array<SyncManagerChannel, EscMemory::kSyncManagers> sync_managers_{};
  DlStatus links_;
  std::int64_t latches_ = 0;  ///< of a bridge terminal: number of the last one
  bool latching_ = false;     ///< the frame under way wrote 0x0900
};

}  // namespace ftcs::ethercat
