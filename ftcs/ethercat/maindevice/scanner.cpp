// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/scanner.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
constexpr std::uint16_t kResetToInit = 0x0011;  // INIT, and acknowledge any error
constexpr std::size_t kIdentitySize = 10;
constexpr std::size_t kAlStatusSize = 6;

/// What a MainDevice at work changes: states, the reading of the SII, channels, mailboxes that
/// fill, receive stamps, offsets, and what the clocks make of each time that is told to them.
struct Registers {
  std::uint16_t offset;
  std::size_t size;
};
constexpr Registers kWatched[] = {{reg::kStationAddress, 2},
                                  {reg::kAlControl, 2},
                                  {reg::kAlStatus, 2},
                                  {reg::kSiiControl, 14},
                                  {reg::kFmmu, 2 * reg::kFmmuSize},
                                  {reg::kSyncManager, 4 * reg::kSyncManagerSize},
                                  {reg::kReceiveTimePort0, 4},
                                  {reg::kSystemTimeOffset, 16},
                                  {reg::kSpeedCounterStart, 6},
                                  {reg::kCyclicUnitControl, 2},
                                  {reg::kSync0CycleTime, 4}};
}  // namespace

void Scanner::start(std::size_t expected, Nanoseconds timeout, bool take_over,
                    Nanoseconds listening) noexcept {
  take_over_ = take_over;
  listening_ = listening;
  image_used_ = 0;
  step_ = Step::kCount;
  expected_ = expected;
  timeout_ = timeout;
  device_ = 0;
  deadline_set_ = false;
}

void Scanner::write_reset(FrameWriter& writer) noexcept {
  using enum Command;
  writer.add_value({kBwr, 0, reg::kAlControl}, kResetToInit);
  writer.add({kBwr, 0, reg::kDlControl + 1}, 3);  // loops automatic, alias off
  writer.add({kBwr, 0, reg::kEventMask}, 2);
  writer.add({kBwr, 0, reg::kRxErrorCounter}, reg::kErrorCountersEnd - reg::kRxErrorCounter);
  writer.add({kBwr, 0, reg::kFmmu}, 16 * reg::kFmmuSize);
  writer.add({kBwr, 0, reg::kSyncManager}, 16 * reg::kSyncManagerSize);
  writer.add({kBwr, 0, reg::kCyclicUnitControl}, 2);
  writer.add({kBwr, 0, reg::kSystemTime}, 8);
  writer.add_value({kBwr, 0, reg::kSpeedCounterStart}, std::uint16_t{0x1000});
  // Filter depths 0 and 12 (ETG.1020 recommends them for the start).
  writer.add_value({kBwr, 0, reg::kSystemTimeDifferenceFilter}, std::uint16_t{0x0C00});
  writer.add_value({kBwr, 0, reg::kSiiConfiguration}, std::uint8_t{2});  // take it from the PDI
  writer.add_value({kBwr, 0, reg::kSiiConfiguration}, std::uint8_t{0});
}

void Scanner::request(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  const SubDeviceInfo& device = network.devices[device_];
  switch (step_) {
    case Step::kCount:
      writer.add({kBrd, 0, reg::kType}, 2);
      writer.add({kBrd, 0, reg::kAlStatus}, 2);
      break;
    case Step::kListen:
      for (const Registers& watched : kWatched) writer.add({kBrd, 0, watched.offset}, watched.size);
      break;
    case Step::kReset:
      write_reset(writer);
      break;
    case Step::kAddress:
      for (std::size_t n = 0; n < network.count; ++n) {
        writer.add_value(Target::at_position(kApwr, n, reg::kStationAddress),
                         static_cast<std::uint16_t>(kFirstStation + n));
      }
      break;
    case Step::kIdentify:
      writer.add(device.target(kFprd, reg::kType), kIdentitySize);
      writer.add(device.target(kFprd, reg::kDlStatus), 2);
      writer.add(device.target(kFprd, reg::kAlStatus), kAlStatusSize);
      writer.add(device.target(kFprd, reg::kStationAlias), 2);
      break;
    case Step::kReadSii:
      sii_reader_.request(writer, device, image_used_ / 2);
      break;
  }
}

Progress Scanner::reply(const FrameView& frame, Network& network, FreeRunningTime now,
                        Failure& failure) noexcept {
  switch (step_) {
    case Step::kCount:
      return count(frame, network, failure);
    case Step::kListen:
      return listen(frame, now, failure);
    case Step::kReset:
      step_ = Step::kAddress;
      return Progress::kContinue;
    case Step::kAddress:
      return addressed(frame, network, failure);
    case Step::kIdentify:
      return identify(frame, network, now, failure);
    case Step::kReadSii:
      break;
  }
  return read_sii(frame, network, now, failure);
}

Progress Scanner::count(const FrameView& frame, Network& network, Failure& failure) noexcept {
  const std::uint16_t found = frame[0].working_counter();
  const auto expected = static_cast<std::uint16_t>(expected_);
  if (found == 0) return fail(failure, {.kind = FailureKind::kNoSubDevices, .expected = expected});
  if (found > kMaxSubDevices) {
    return fail(
        failure,
        {.kind = FailureKind::kTooManySubDevices, .expected = kMaxSubDevices, .received = found});
  }
  if (found < expected_) {
    return fail(
        failure,
        {.kind = FailureKind::kFewerThanConfigured, .expected = expected, .received = found});
  }
  // Nobody stays in OP by itself: outputs come from somewhere, and a reset would stop a machine.
  const auto states = load<std::uint16_t>(frame[1].data(), 0);
  if (!take_over_ && (states & static_cast<std::uint16_t>(AlState::kOp)) != 0) {
    return fail(failure, {.kind = FailureKind::kInOperation});
  }
  network.count = found;
  for (std::size_t n = 0; n < found; ++n) {
    network.devices[n] = SubDeviceInfo{};
    network.devices[n].station = static_cast<std::uint16_t>(kFirstStation + n);
  }
  step_ = take_over_ || listening_ == Nanoseconds{0} ? Step::kReset : Step::kListen;
  return Progress::kContinue;
}

/// What was read first stands in image_.
Progress Scanner::listen(const FrameView& frame, FreeRunningTime now, Failure& failure) noexcept {
  std::size_t at = 0;
  const bool first = image_used_ == 0;
  for (const Datagram datagram : frame) {
    const Bytes known = Bytes{image_}.subspan(at, datagram.data().size());
    at += known.size();
    if (first) std::copy(datagram.data().begin(), datagram.data().end(), known.begin());
    if (!std::equal(known.begin(), known.end(), datagram.data().begin())) {
      return fail(failure, {.kind = FailureKind::kInUse});
    }
  }
  image_used_ = at;
  if (first) deadline_ = now + listening_;
  if (now >= deadline_) step_ = Step::kReset;
  return Progress::kContinue;
}

Progress Scanner::addressed(const FrameView& frame, Network& network, Failure& failure) noexcept {
  std::uint16_t n = 0;
  for (const Datagram datagram : frame) {
    if (n == network.count) break;  // a drift datagram may follow
    if (datagram.working_counter() != 1) {
      return fail(failure, {.kind = FailureKind::kNotAnswering, .position = n});
    }
    ++n;
  }
  step_ = Step::kIdentify;
  device_ = 0;
  return Progress::kContinue;
}

Progress Scanner::identify(const FrameView& frame, Network& network, FreeRunningTime now,
                           Failure& failure) noexcept {
  SubDeviceInfo& device = network.devices[device_];
  const ConstBytes identity = frame[0].data();
  if (frame[0].working_counter() != 1) {
    return fail(failure, {.kind = FailureKind::kNotAnswering, .position = position()});
  }
  device.type = identity[0];
  device.revision = identity[1];
  device.build = load<std::uint16_t>(identity, 2);
  device.fmmus = identity[4];
  device.sync_managers = identity[5];
  device.ram_kib = identity[6];
  device.features = load<std::uint16_t>(identity, 8);
  device.links.bits = load<std::uint16_t>(frame[1].data(), 0);
  device.set_al_status(frame[2].data());
  device.alias = load<std::uint16_t>(frame[3].data(), 0);
  if (device.state != AlState::kInit) {
    if (!deadline_set_) deadline_ = now + timeout_;
    deadline_set_ = true;
    if (now < deadline_) return Progress::kContinue;
    return fail(failure, {.kind = FailureKind::kStateTimeout,
                          .position = position(),
                          .wanted = AlState::kInit,
                          .actual = device.state,
                          .code = device.code});
  }
  deadline_set_ = false;
  if (++device_ == network.count) {
    device_ = 0;
    image_used_ = 0;
    sii_reader_.start(timeout_);
    step_ = Step::kReadSii;
  }
  return Progress::kContinue;
}

Progress Scanner::read_sii(const FrameView& frame, Network& network, FreeRunningTime now,
                           Failure& failure) noexcept {
  ConstBytes words;
  const Progress progress = sii_reader_.reply(frame, device_, now, words, failure);
  if (progress != Progress::kDone) return progress;
  std::copy(words.begin(), words.end(), Bytes{image_}.subspan(image_used_).begin());
  image_used_ += words.size();
  return next_sii_word(network, failure);
}

Progress Scanner::next_sii_word(Network& network, Failure& failure) noexcept {
  constexpr std::size_t kIdentityEnd = std::size_t{0x10} * 2;
  constexpr std::size_t kCategories = sii::kCategoriesWord * 2;
  SubDeviceInfo& device = network.devices[device_];
  bool done = image_used_ == kIdentityEnd && take_from_twin(network);
  if (!done) {
    if (image_used_ <= kCategories) category_at_ = kCategories;
    const bool full = image_used_ + 8 > image_.size();
    if (!end_seen() && !full) return Progress::kContinue;
    const auto content = decode_sii(ConstBytes{image_}.first(image_used_));
    if (!content) {
      return fail(failure,
                  {.kind = FailureKind::kBadSii, .position = position(), .sii = content.error()});
    }
    device.sii = *content;
    if (check_mailboxes(device, failure) == Progress::kFailed) return Progress::kFailed;
  }
  image_used_ = 0;
  if (++device_ < network.count) return Progress::kContinue;
  return finish(network, failure);
}

/// An SDO must fit into each mailbox, and each mailbox into a frame beside the drift datagram.
Progress Scanner::check_mailboxes(const SubDeviceInfo& device, Failure& failure) const noexcept {
  constexpr std::size_t kDriftDatagram = kDatagramOverhead + 8;
  constexpr std::size_t kLargest =
      kMaxFrameSize - kFrameHeaderSize - kDatagramOverhead - kDriftDatagram;
  if (!device.sii.coe()) return Progress::kContinue;
  for (const MailboxWindow& mailbox : {device.sii.receive, device.sii.send}) {
    if (mailbox.size >= kSdoOverhead && mailbox.size <= kLargest) continue;
    const std::size_t bound = mailbox.size < kSdoOverhead ? kSdoOverhead : kLargest;
    return fail(failure, {.kind = FailureKind::kMailboxUnusable,
                          .position = position(),
                          .expected = static_cast<std::uint16_t>(bound),
                          .received = mailbox.size});
  }
  return Progress::kContinue;
}

/// Vendor, product and revision of a SubDevice read before: only alias and serial number differ.
bool Scanner::take_from_twin(Network& network) const noexcept {
  SubDeviceInfo& device = network.devices[device_];
  const Identity own = decode_identity(ConstBytes{image_}.subspan(sii::kIdentityWord * 2));
  for (std::size_t n = 0; n < device_; ++n) {
    const Identity& other = network.devices[n].sii.identity;
    if (other.vendor != own.vendor || other.product != own.product ||
        other.revision != own.revision) {
      continue;
    }
    device.sii = network.devices[n].sii;
    device.sii.identity = own;
    device.sii.alias = load<std::uint16_t>(image_, sii::kAliasWord * 2);
    return true;
  }
  return false;
}

/// Follows the chain of categories as far as it has been read.
bool Scanner::end_seen() noexcept {
  while (category_at_ + 4 <= image_used_) {
    if (load<std::uint16_t>(image_, category_at_) == sii::kEnd) return true;
    category_at_ += 4 + std::size_t{load<std::uint16_t>(image_, category_at_ + 2)} * 2;
  }
  return false;
}

Progress Scanner::finish(Network& network, Failure& failure) noexcept {
  if (!resolve_topology(network)) {
    return fail(failure, {.kind = FailureKind::kImpossibleTopology,
                          .received = static_cast<std::uint16_t>(network.count)});
  }
  network.reference = Network::kNoReference;
  for (std::size_t n = network.count; n-- > 0;) {
    if (network.devices[n].dc()) network.reference = n;
  }
  return Progress::kDone;
}

}  // namespace ftcs::ethercat
