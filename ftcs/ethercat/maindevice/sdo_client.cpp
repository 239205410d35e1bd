// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/sdo_client.h"

namespace ftcs::ethercat {

void SdoClient::start(Nanoseconds timeout) noexcept {
  step_ = Step::kSend;
  timeout_ = timeout;
  deadline_set_ = false;
  asked_late_ = 0;
  counter_ = static_cast<std::uint8_t>(counter_ % kMaxMailboxCounter + 1);
}

void SdoClient::start_download(const SdoDownload& download, Nanoseconds timeout) noexcept {
  kind_ = SdoKind::kDownloadRequest;
  object_ = download;
  start(timeout);
}

void SdoClient::start_upload(ObjectAddress object, Nanoseconds timeout) noexcept {
  kind_ = SdoKind::kUploadRequest;
  object_ = {object, 0, 0};
  start(timeout);
}

void SdoClient::request(FrameWriter& writer, const SubDeviceInfo& device) noexcept {
  if (step_ == Step::kReceive) {
    writer.add(device.target(Command::kFprd, device.sii.send.start), device.sii.send.size);
    return;
  }
  std::array<std::uint8_t, 4> bytes{};
  store(bytes, 0, object_.value);
  // The whole mailbox is written: its last byte is what hands it over.
  const Bytes mailbox =
      writer.add(device.target(Command::kFpwr, device.sii.receive.start), device.sii.receive.size);
  const Sdo sdo{kind_, object_.object,  counter_,
                false, SdoAbort::kNone, ConstBytes{bytes}.first(object_.size)};
  // Cannot fail: Scanner::check_mailboxes() saw that a whole SDO fits.
  if (!mailbox.empty()) static_cast<void>(encode_sdo(mailbox, sdo));
}

Progress SdoClient::reply(const FrameView& frame, std::size_t position, FreeRunningTime now,
                          Failure& failure) noexcept {
  if (!deadline_set_) deadline_ = now + timeout_;
  deadline_set_ = true;
  const auto where = static_cast<std::uint16_t>(position);
  const Progress progress = take(frame[0], where, now, failure);
  if (progress != Progress::kContinue || now < deadline_) return progress;
  // The time may have passed while the host stood still, and the drive was asked once.
  constexpr std::uint8_t kAskedThen = 20;
  if (++asked_late_ < kAskedThen) return progress;
  return fail(failure,
              {.kind = FailureKind::kSdoTimeout, .position = where, .object = object_.object});
}

Progress SdoClient::take(const Datagram& answer, std::uint16_t position, FreeRunningTime now,
                         Failure& failure) noexcept {
  const bool taken = answer.working_counter() == 1;
  if (step_ == Step::kSend) {
    // Not taken: the mailbox is still full of the last request; its answer must be fetched first.
    step_ = Step::kReceive;
    return Progress::kContinue;
  }
  if (!taken) {
    // Nothing there yet. Every now and then the request goes out again: it may have been refused.
    if (now >= deadline_ - timeout_ * 3 / 4) step_ = Step::kSend;
    return Progress::kContinue;
  }
  const auto sdo = decode_sdo(answer.data());
  if (!sdo) {
    // Emergencies and other protocols share the mailbox.
    if (sdo.error() == MailboxError::kNotSdo || sdo.error() == MailboxError::kNotCoe) {
      return Progress::kContinue;
    }
    return fail(failure, {.kind = FailureKind::kSdoMalformed,
                          .position = position,
                          .object = object_.object,
                          .mailbox = sdo.error()});
  }
  if (sdo->object != object_.object) return Progress::kContinue;  // answer to an earlier request
  if (sdo->kind == SdoKind::kAbort) {
    return fail(failure, {.kind = FailureKind::kSdoAborted,
                          .position = position,
                          .object = object_.object,
                          .abort = sdo->abort});
  }
  value_ = sdo->value();
  return Progress::kDone;
}

}  // namespace ftcs::ethercat
