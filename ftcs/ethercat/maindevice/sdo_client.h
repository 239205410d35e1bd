// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "ftcs/ethercat/maindevice/network.h"
#include "ftcs/ethercat/maindevice/procedure.h"

namespace ftcs::ethercat {

/// One object to be written while a SubDevice is configured.
struct SdoDownload {
  ObjectAddress object;
  std::uint8_t size = 0;  ///< 1, 2 or 4 bytes
  std::uint32_t value = 0;
  /// False: a SubDevice that does not have the object, or has it to be read only, is left as it is.
  bool required = true;
};

/// One SDO at a time: writes the request into the SubDevice's receive mailbox and reads its send
/// mailbox until the answer is there. An answer to an earlier, repeated request, an emergency and
/// whatever else comes is passed over; none of it prolongs the deadline, which twenty more frames
/// follow: whoever stood still in the meantime asks again before it gives up.
class SdoClient {
 public:
  /// `timeout`: from the first answer of any kind on, in the MainDevice's clock.
  void start_download(const SdoDownload& download, Nanoseconds timeout) noexcept;
  void start_upload(ObjectAddress object, Nanoseconds timeout) noexcept;
  void request(FrameWriter& writer, const SubDeviceInfo& device) noexcept;
  /// kFailed: kSdoAborted with the code, kSdoTimeout or kSdoMalformed in `failure`.
  [[nodiscard]] Progress reply(const FrameView& frame, std::size_t position, FreeRunningTime now,
                               Failure& failure) noexcept;
  /// What an upload brought, up to four bytes.
  [[nodiscard]] std::uint32_t value() const noexcept { return value_; }

 private:
  void start(Nanoseconds timeout) noexcept;
  [[nodiscard]] Progress take(const Datagram& answer, std::uint16_t position, FreeRunningTime now,
                              Failure& failure) noexcept;
  enum class Step : std::uint8_t { kSend, kReceive };
  Step step_ = Step::kSend;
  SdoKind kind_ = SdoKind::kUploadRequest;
  SdoDownload object_;
  Nanoseconds timeout_{};
  FreeRunningTime deadline_;
  bool deadline_set_ = false;
  std::uint8_t asked_late_ = 0;  ///< frames since the deadline
  std::uint8_t counter_ = 0;
  std::uint32_t value_ = 0;
};

}  // namespace ftcs::ethercat
