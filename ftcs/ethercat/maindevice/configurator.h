// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/procedure.h"
#include "ftcs/ethercat/maindevice/sdo_client.h"

namespace ftcs::ethercat {

/// SYNC signals of one SubDevice, beside what all have.
struct DriveSync {
  Nanoseconds sync0_shift{0};  ///< SYNC0 so much later than that of the others; may be negative
  /// SYNC1 comes once in so many cycles; 0: never.
  std::uint16_t sync1_cycles = 0;
  Nanoseconds sync1_shift{0};  ///< behind a SYNC0; from zero to below a cycle

  /// What the register 0x09A4, of 32 bits, holds for it.
  [[nodiscard]] constexpr std::int64_t sync1_register(Nanoseconds cycle) const noexcept {
    const std::int64_t left_out = sync1_cycles > 0 ? sync1_cycles - 1 : 0;
    return left_out * cycle.count() + sync1_shift.count();
  }
  friend bool operator==(const DriveSync&, const DriveSync&) = default;
};

/// What SubDevices are given on their way to SAFEOP. Valid: cycle above zero and below 2^32 ns
/// (0x09A0 has 32 bits), sync0_shift of the whole segment and of each drive within a cycle.
struct ConfiguratorConfig {
  std::span<const SdoDownload> objects;  ///< written to every SubDevice with CoE, in PREOP
  Nanoseconds cycle{1'000'000};
  /// SYNC0 comes so long after the whole multiples of the cycle in reference time.
  Nanoseconds sync0_shift{0};
  /// The first SYNC0 lies so far ahead that all SubDevices have been told in time.
  Nanoseconds sync0_lead{100'000'000};
  bool sync0 = true;
  /// By position on the wire; who is beyond its end has nothing of its own.
  std::span<const DriveSync> drive_sync;
  Nanoseconds state_timeout{2'000'000'000};
  Nanoseconds sdo_timeout{1'000'000'000};
  /// A bridge terminal tells plant time (bridge::choose()): it is brought to SAFEOP before the
  /// others, and all clocks are put where its other side is. No value: nobody is asked.
  std::optional<std::size_t> bridge;
  Nanoseconds bridge_timeout{30'000'000'000};
};

/// Logical address of the process image; outputs first, inputs behind them.
inline constexpr std::uint32_t kLogicalStart = 0x00010000;
/// What fits into one frame beside the other cyclic datagrams.
inline constexpr std::size_t kMaxImageSize = 1380;

/// Takes all SubDevices from INIT to SAFEOP, one step for all of them before the next: mailboxes,
/// PREOP, objects, sizes of the process data (from CoE, else from the SII), sync managers and
/// FMMUs, SYNC0, SAFEOP.
///
///     sync0_start = (floor(S / cycle) + 1) cycle + sync0_shift,   S = system time + sync0_lead
///
/// written to 0x0990 of each before 0x0981 activates it: a start in the past would never come.
class Configurator {
 public:
  void start(const ConfiguratorConfig& config) noexcept;
  /// The same for one SubDevice whose process data has its place already.
  void start_one(const ConfiguratorConfig& config, std::size_t position) noexcept;
  /// Sync managers and FMMUs of all that are concerned have been written.
  [[nodiscard]] bool channels_done() const noexcept { return step_ > Step::kChannels; }
  void request(FrameWriter& writer, const Network& network) noexcept;
  [[nodiscard]] Progress reply(const FrameView& frame, Network& network, FreeRunningTime now,
                               Failure& failure) noexcept;
  /// What the system time shall be when the frame that is answered next passes the reference.
  /// Before SYNC0 is planned, and then alone, all clocks are put there by one and the same jump.
  void want_system_time(ReferenceTime time) noexcept {
    wanted_ = time;
    has_wanted_ = true;
  }
  /// The clocks are being put elsewhere one after another: nobody shall follow anybody meanwhile.
  [[nodiscard]] bool aligning() const noexcept { return step_ == Step::kAlign; }
  /// System time of the first SYNC0; zero if there is none.
  [[nodiscard]] std::uint64_t sync0_start() const noexcept { return sync0_start_; }

 private:
  enum class Step : std::uint8_t {
    kMailboxes,
    kRequestPreOp,
    kAwaitPreOp,
    kObjects,
    kSizes,
    kChannels,
    kBridgeSafeOp,
    kAwaitBridge,
    kBridgeTime,
    kReferenceTime,
    kAlign,
    kSync0,
    kRequestSafeOp,
    kAwaitSafeOp,
  };
  /// Where the walk through an assignment object stands (0x1C12, 0x1C13).
  struct MappingWalk {
    enum class Part : std::uint8_t { kAssigned, kMap, kEntries, kEntry };
    Part part = Part::kAssigned;
    bool inputs = false;
    std::uint8_t maps = 0;
    std::uint8_t map = 0;
    std::uint16_t index = 0;
    std::uint8_t entries = 0;
    std::uint8_t entry = 0;
    std::uint32_t bits = 0;
  };

  [[nodiscard]] bool concerns(const Network& network) const noexcept;
  [[nodiscard]] std::span<const SdoDownload> objects_of(const Network& network) const noexcept;
  /// The next SubDevice that this step concerns, or the next step. Done after the last.
  [[nodiscard]] Progress advance(Network& network, Failure& failure) noexcept;
  void begin(const Network& network) noexcept;
  void write_channels(FrameWriter& writer, const SubDeviceInfo& device) noexcept;
  void write_sync0(FrameWriter& writer, const SubDeviceInfo& device) noexcept;
  [[nodiscard]] Progress await(const FrameView& frame, SubDeviceInfo& device, AlState wanted,
                               FreeRunningTime now, Failure& failure) noexcept;
  [[nodiscard]] Progress objects(const FrameView& frame, const Network& network,
                                 FreeRunningTime now, Failure& failure) noexcept;
  [[nodiscard]] Progress take_bridge_time(const Datagram& inputs, FreeRunningTime now,
                                          Failure& failure) noexcept;
  [[nodiscard]] Progress sizes(const FrameView& frame, SubDeviceInfo& device, FreeRunningTime now,
                               Failure& failure) noexcept;
  [[nodiscard]] bool walk(std::uint32_t value) noexcept;
  [[nodiscard]] ObjectAddress walk_object() const noexcept;
  [[nodiscard]] Progress place_image(Network& network, Failure& failure) noexcept;
  [[nodiscard]] Progress take_reference_time(ConstBytes system_time, Network& network,
                                             Failure& failure) noexcept;
  void plan_sync0(std::uint64_t system_time) noexcept;

  ConfiguratorConfig config_;
  Step step_ = Step::kMailboxes;
  static constexpr std::size_t kAll = kMaxSubDevices;
  std::size_t first_ = 0;  ///< the SubDevices concerned, [first_, end_)
  std::size_t end_ = kAll;
  std::size_t device_ = 0;
  std::size_t object_ = 0;
  SdoClient sdo_;
  MappingWalk walk_;
  FreeRunningTime deadline_;
  bool deadline_set_ = false;
  std::uint64_t sync0_start_ = 0;
  bool has_wanted_ = false;
  ReferenceTime wanted_;
  bool has_shift_ = false;  ///< the bridge has told how far its other side is ahead: shift_
  std::uint64_t shift_ = 0;
  std::optional<bool> first_toggle_;
};

}  // namespace ftcs::ethercat
