// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/configurator.h"
#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/procedure.h"
#include "ftcs/ethercat/maindevice/sii_reader.h"

namespace ftcs::ethercat {

/// Brings one SubDevice that was restarted back to SAFEOP while the others run: its datagrams ride
/// behind those of the cycle. Station address, INIT, identity (another SubDevice in its place is
/// left alone), clock, then what the Configurator does for
/// everybody; sizes and places in the process image are known.
///
/// Its clock is set from one cycle's frame, which latched its local time (0x0918) and carried the
/// reference's:  offset = reference + delay - local.  The delay is that of the scan. SYNC0 is
/// activated once the clock has followed the reference for a while.
class Reintegrator {
 public:
  void start(std::size_t position, const ConfiguratorConfig& config) noexcept;
  void stop() noexcept { active_ = false; }
  [[nodiscard]] bool active() const noexcept { return active_; }
  [[nodiscard]] std::size_t position() const noexcept { return position_; }
  /// Its process data is mapped: from the next frame on it counts in the working counter.
  [[nodiscard]] bool mapped() const noexcept {
    return step_ == Step::kConfigure && configurator_.channels_done();
  }

  /// What the largest request takes in a frame, with this SubDevice's mailbox.
  [[nodiscard]] static std::size_t room_needed(const SubDeviceInfo& device) noexcept;
  void request(FrameWriter& writer, const Network& network) noexcept;
  /// `frame`: the own datagrams alone. `reference`: what the frame's drift datagram brought; zero:
  /// nothing.
  [[nodiscard]] Progress reply(const FrameView& frame, Network& network, ReferenceTime reference,
                               FreeRunningTime now, Failure& failure) noexcept;

 private:
  enum class Step : std::uint8_t {
    kAddress,
    kReset,
    kAwaitInit,
    kIdentity,
    kPrepareClock,
    kLatch,
    kReadLatch,
    kWriteClock,
    kSettle,
    kConfigure,
  };
  [[nodiscard]] Progress take(const FrameView& frame, Network& network, ReferenceTime reference,
                              FreeRunningTime now, Failure& failure) noexcept;
  void take_latch(const FrameView& frame, const Network& network, ReferenceTime reference) noexcept;
  void take_local_time(const Datagram& datagram, SubDeviceInfo& device) noexcept;
  [[nodiscard]] Progress await_init(const Datagram& datagram, SubDeviceInfo& device,
                                    FreeRunningTime now, Failure& failure) noexcept;
  [[nodiscard]] Progress identify(const FrameView& frame, const Network& network,
                                  FreeRunningTime now, Failure& failure) noexcept;
  [[nodiscard]] Progress settle(const Datagram& datagram, FreeRunningTime now,
                                Failure& failure) noexcept;
  [[nodiscard]] bool expired(FreeRunningTime now, Nanoseconds limit) noexcept;
  void enter(Step step) noexcept;
  void begin_configuration() noexcept;
  [[nodiscard]] std::size_t time_source(const Network& network) const noexcept;

  ConfiguratorConfig config_;
  Configurator configurator_;
  bool active_ = false;
  std::size_t position_ = 0;
  Step step_ = Step::kAddress;
  FreeRunningTime deadline_;
  bool deadline_set_ = false;
  SiiReader sii_reader_;
  std::array<std::uint8_t, 16> identity_{};
  std::size_t identity_used_ = 0;
  ReferenceTime latched_;     ///< reference time of the frame that latched
  std::uint32_t steady_ = 0;  ///< frames in a row with a small 0x092C
};

}  // namespace ftcs::ethercat
