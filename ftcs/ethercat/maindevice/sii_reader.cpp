// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/sii_reader.h"

namespace ftcs::ethercat {

namespace {
constexpr std::uint16_t kBusy = 0x8000;
constexpr std::uint16_t kEightBytes = 0x0040;
constexpr std::uint16_t kReadCommand = 0x0100;
constexpr std::size_t kReplySize = 14;  // control 2, address 4, data 8
}  // namespace

void SiiReader::request(FrameWriter& writer, const SubDeviceInfo& device,
                        std::size_t word) const noexcept {
  if (!poll_) {
    const Bytes command = writer.add(device.target(Command::kFpwr, reg::kSiiControl), 6);
    store(command, 0, kReadCommand);
    store(command, 2, static_cast<std::uint32_t>(word));
  }
  writer.add(device.target(Command::kFprd, reg::kSiiControl), kReplySize);
}

Progress SiiReader::reply(const FrameView& frame, std::size_t position, FreeRunningTime now,
                          ConstBytes& words, Failure& failure) noexcept {
  const Datagram answer = frame[poll_ ? 0 : 1];
  const ConstBytes data = answer.data();
  const auto control = load<std::uint16_t>(data, 0);
  const bool there = answer.working_counter() == 1;
  poll_ = there && (control & kBusy) != 0;
  if (!there || poll_) {
    if (!deadline_set_) deadline_ = now + timeout_;
    deadline_set_ = true;
    if (now < deadline_) return Progress::kContinue;
    return fail(failure, {.kind = FailureKind::kSiiTimeout,
                          .position = static_cast<std::uint16_t>(position)});
  }
  deadline_set_ = false;
  words = data.subspan(6, (control & kEightBytes) != 0 ? 8 : 4);
  return Progress::kDone;
}

}  // namespace ftcs::ethercat
