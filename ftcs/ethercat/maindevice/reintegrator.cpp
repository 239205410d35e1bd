// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/reintegrator.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
constexpr std::uint16_t kResetToInit = 0x0011;  // INIT, and acknowledge any error
constexpr std::size_t kAlStatusSize = 6;
/// Filter depths 0 and 12, as the scan gives them to everybody.
constexpr std::uint16_t kFilters = 0x0C00;
constexpr std::uint16_t kSpeedStart = 0x1000;
constexpr std::uint32_t kMagnitude = 0x7FFFFFFF;
/// The clock follows when |0x092C| stayed below this for so many frames in a row: a rate that is
/// still wrong leaves it within a few of them.
constexpr std::uint32_t kSteadyDifference = 500;
constexpr std::uint32_t kSteadyFrames = 200;
/// As the scan (MainDeviceConfig::sii_timeout).
constexpr Nanoseconds kSiiTimeout{1'000'000'000};
constexpr Nanoseconds kSettleTimeout{20'000'000'000};
}  // namespace

void Reintegrator::start(std::size_t position, const ConfiguratorConfig& config) noexcept {
  config_ = config;
  position_ = position;
  active_ = true;
  enter(Step::kAddress);
}

void Reintegrator::enter(Step step) noexcept {
  step_ = step;
  deadline_set_ = false;
  steady_ = 0;
}

std::size_t Reintegrator::room_needed(const SubDeviceInfo& device) noexcept {
  constexpr std::size_t kChannels = 2 * reg::kSyncManagerSize + 2 * reg::kFmmuSize;
  const std::size_t mailbox =
      std::max<std::size_t>(device.sii.receive.size, device.sii.send.size) + kDatagramOverhead;
  return std::max(mailbox, kChannels + 2 * kDatagramOverhead);
}

/// The reference's own time is lost with it: any other clock that followed it still knows.
std::size_t Reintegrator::time_source(const Network& network) const noexcept {
  if (position_ != network.reference) return network.reference;
  for (std::size_t n = 0; n < network.count; ++n) {
    const SubDeviceInfo& device = network.devices[n];
    if (n != position_ && device.dc() && device.state != AlState::kNone) return n;
  }
  return network.reference;
}

void Reintegrator::request(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  const SubDeviceInfo& device = network.devices[position_];
  switch (step_) {
    case Step::kAddress:
      writer.add_value(Target::at_position(kApwr, position_, reg::kStationAddress), device.station);
      break;
    case Step::kReset:
      writer.add_value(device.target(kFpwr, reg::kAlControl), kResetToInit);
      break;
    case Step::kAwaitInit:
      writer.add(device.target(kFprd, reg::kAlStatus), kAlStatusSize);
      break;
    case Step::kIdentity:
      sii_reader_.request(writer, device, sii::kIdentityWord + identity_used_ / 2);
      break;
    case Step::kPrepareClock:
      writer.add_value(device.target(kFpwr, reg::kSystemTimeDifferenceFilter), kFilters);
      break;
    case Step::kLatch:
      writer.add(device.target(kFpwr, reg::kReceiveTimePort0), 4);
      writer.add(network.devices[time_source(network)].target(kFprd, reg::kSystemTime), 8);
      break;
    case Step::kReadLatch:
      writer.add(device.target(kFprd, reg::kReceiveTimeProcessingUnit), 8);
      break;
    case Step::kWriteClock: {
      const Bytes both = writer.add(device.target(kFpwr, reg::kSystemTimeOffset), 12);
      store(both, 0, device.system_time_offset);
      store(both, 8, device.propagation_delay);
      writer.add_value(device.target(kFpwr, reg::kSpeedCounterStart), kSpeedStart);
      break;
    }
    case Step::kSettle:
      writer.add(device.target(kFprd, reg::kSystemTimeDifference), 4);
      break;
    case Step::kConfigure:
      configurator_.request(writer, network);
      break;
  }
}

bool Reintegrator::expired(FreeRunningTime now, Nanoseconds limit) noexcept {
  if (!deadline_set_) deadline_ = now + limit;
  deadline_set_ = true;
  return now >= deadline_;
}

Progress Reintegrator::await_init(const Datagram& datagram, SubDeviceInfo& device,
                                  FreeRunningTime now, Failure& failure) noexcept {
  device.set_al_status(datagram.data());
  if (device.state == AlState::kInit && !device.error) {
    enter(Step::kIdentity);
    identity_used_ = 0;
    sii_reader_.start(kSiiTimeout);
    return Progress::kContinue;
  }
  if (!expired(now, config_.state_timeout)) return Progress::kContinue;
  return fail(failure, {.kind = FailureKind::kStateTimeout,
                        .position = static_cast<std::uint16_t>(position_),
                        .wanted = AlState::kInit,
                        .actual = device.state,
                        .code = device.code});
}

Progress Reintegrator::identify(const FrameView& frame, const Network& network, FreeRunningTime now,
                                Failure& failure) noexcept {
  ConstBytes words;
  const Progress progress = sii_reader_.reply(frame, position_, now, words, failure);
  if (progress != Progress::kDone) return progress;
  const std::size_t size = std::min(words.size(), identity_.size() - identity_used_);
  std::copy_n(words.begin(), size, Bytes{identity_}.subspan(identity_used_).begin());
  identity_used_ += size;
  if (identity_used_ < identity_.size()) return Progress::kContinue;
  const SubDeviceInfo& device = network.devices[position_];
  const Identity found = decode_identity(identity_);
  if (!(found == device.sii.identity)) {
    return fail(failure, {.kind = FailureKind::kReplaced,
                          .position = static_cast<std::uint16_t>(position_),
                          .known = device.sii.identity,
                          .found = found});
  }
  if (network.has_reference() && device.dc()) {
    enter(Step::kPrepareClock);
  } else {
    begin_configuration();
  }
  return Progress::kContinue;
}

Progress Reintegrator::settle(const Datagram& datagram, FreeRunningTime now,
                              Failure& failure) noexcept {
  const std::uint32_t difference = load<std::uint32_t>(datagram.data(), 0) & kMagnitude;
  steady_ = difference < kSteadyDifference ? steady_ + 1 : 0;
  if (steady_ >= kSteadyFrames) {
    begin_configuration();
    return Progress::kContinue;
  }
  if (!expired(now, kSettleTimeout)) return Progress::kContinue;
  return fail(failure, {.kind = FailureKind::kClockNotSteady,
                        .position = static_cast<std::uint16_t>(position_)});
}

void Reintegrator::begin_configuration() noexcept {
  enter(Step::kConfigure);
  configurator_.start_one(config_, position_);
}

Progress Reintegrator::reply(const FrameView& frame, Network& network, ReferenceTime reference,
                             FreeRunningTime now, Failure& failure) noexcept {
  if (step_ == Step::kConfigure) {
    const Progress progress = configurator_.reply(frame, network, now, failure);
    if (progress != Progress::kContinue) active_ = false;
    return progress;
  }
  Progress progress = Progress::kContinue;
  if (frame[0].working_counter() == 1) {
    progress = take(frame, network, reference, now, failure);
  } else if (expired(now, config_.state_timeout)) {
    progress = fail(failure, {.kind = FailureKind::kNotAnswering,
                              .position = static_cast<std::uint16_t>(position_)});
  }
  if (progress == Progress::kFailed) active_ = false;
  return progress;
}

/// One step, whose first datagram was answered.
Progress Reintegrator::take(const FrameView& frame, Network& network, ReferenceTime reference,
                            FreeRunningTime now, Failure& failure) noexcept {
  SubDeviceInfo& device = network.devices[position_];
  switch (step_) {
    case Step::kAwaitInit:
      return await_init(frame[0], device, now, failure);
    case Step::kIdentity:
      return identify(frame, network, now, failure);
    case Step::kSettle:
      return settle(frame[0], now, failure);
    case Step::kAddress:
      enter(Step::kReset);
      break;
    case Step::kReset:
      enter(Step::kAwaitInit);
      break;
    case Step::kPrepareClock:
      enter(Step::kLatch);
      break;
    case Step::kLatch:
      take_latch(frame, network, reference);
      break;
    case Step::kReadLatch:
      take_local_time(frame[0], device);
      break;
    case Step::kWriteClock:
      // The reference is what the others are compared with: it has nothing to settle on.
      if (position_ == network.reference) {
        begin_configuration();
      } else {
        enter(Step::kSettle);
      }
      break;
    case Step::kConfigure:
      break;
  }
  return Progress::kContinue;
}

/// The frame latched the local time and read the reference's. Of a 32-bit clock the upper half
/// comes from the cycle's unwrapped time.
void Reintegrator::take_latch(const FrameView& frame, const Network& network,
                              ReferenceTime reference) noexcept {
  if (frame[1].working_counter() != 1) return;
  const bool wide = network.devices[time_source(network)].dc64();
  const auto read = static_cast<std::int64_t>(load<std::uint64_t>(frame[1].data(), 0));
  latched_ = wide ? ReferenceTime::from_ns(read) : reference;
  if (wide || reference.since_epoch() != Duration{}) enter(Step::kReadLatch);
}

void Reintegrator::take_local_time(const Datagram& datagram, SubDeviceInfo& device) noexcept {
  device.receive_time = load<std::uint64_t>(datagram.data(), 0);
  device.system_time_offset = static_cast<std::uint64_t>(latched_.since_epoch().rounded_ns()) +
                              device.propagation_delay - device.receive_time;
  enter(Step::kWriteClock);
}

}  // namespace ftcs::ethercat
