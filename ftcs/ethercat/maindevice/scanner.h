// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/procedure.h"
#include "ftcs/ethercat/maindevice/sii_reader.h"

namespace ftcs::ethercat {

/// Finds out what is there: counts, listens, resets to INIT, gives station addresses, reads
/// identity, links and SII, and resolves the topology. SubDevices of one product share one reading
/// of the SII.
///
/// No frame of another MainDevice need come here. That one is at work shows in what it writes:
/// before anything is written, the registers that a bring-up and a cycle change are read again and
/// again; a change of them is somebody else's.
class Scanner {
 public:
  /// `expected`: how many there must be at least; zero: any number.
  /// `take_over`: also from SubDevices that are in OP, and from whoever works on them.
  /// `listening`: so long is looked for another MainDevice; zero: not at all.
  void start(std::size_t expected, Nanoseconds timeout, bool take_over,
             Nanoseconds listening) noexcept;
  void request(FrameWriter& writer, const Network& network) noexcept;
  [[nodiscard]] Progress reply(const FrameView& frame, Network& network, FreeRunningTime now,
                               Failure& failure) noexcept;

 private:
  enum class Step : std::uint8_t { kCount, kListen, kReset, kAddress, kIdentify, kReadSii };
  [[nodiscard]] Progress count(const FrameView& frame, Network& network, Failure& failure) noexcept;
  [[nodiscard]] Progress listen(const FrameView& frame, FreeRunningTime now,
                                Failure& failure) noexcept;
  [[nodiscard]] Progress addressed(const FrameView& frame, Network& network,
                                   Failure& failure) noexcept;
  [[nodiscard]] Progress identify(const FrameView& frame, Network& network, FreeRunningTime now,
                                  Failure& failure) noexcept;
  [[nodiscard]] Progress read_sii(const FrameView& frame, Network& network, FreeRunningTime now,
                                  Failure& failure) noexcept;
  [[nodiscard]] Progress next_sii_word(Network& network, Failure& failure) noexcept;
  [[nodiscard]] Progress check_mailboxes(const SubDeviceInfo& device,
                                         Failure& failure) const noexcept;
  [[nodiscard]] bool take_from_twin(Network& network) const noexcept;
  [[nodiscard]] bool end_seen() noexcept;
  [[nodiscard]] Progress finish(Network& network, Failure& failure) noexcept;
  void write_reset(FrameWriter& writer) noexcept;
  [[nodiscard]] std::uint16_t position() const noexcept {
    return static_cast<std::uint16_t>(device_);
  }

  /// Larger images than this carry nothing that is needed.
  static constexpr std::size_t kImageSize = 4096;
  Step step_ = Step::kCount;
  std::size_t expected_ = 0;
  bool take_over_ = false;
  Nanoseconds timeout_{};
  Nanoseconds listening_{};
  std::size_t device_ = 0;
  FreeRunningTime deadline_;
  bool deadline_set_ = false;
  SiiReader sii_reader_;
  std::array<std::uint8_t, kImageSize> image_{};
  std::size_t image_used_ = 0;
  std::size_t category_at_ = 0;
};

}  // namespace ftcs::ethercat
