// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/configurator.h"

#include <algorithm>

#include "ftcs/ethercat/maindevice/bridge_terminal.h"

namespace ftcs::ethercat {

namespace {
constexpr std::uint16_t kReceiveAssign = 0x1C12;
constexpr std::uint16_t kTransmitAssign = 0x1C13;
constexpr std::size_t kOutputManager = 2;
constexpr std::size_t kInputManager = 3;
constexpr std::size_t kAlStatusSize = 6;
/// Defaults for a SubDevice whose SII does not describe its sync managers.
constexpr std::uint8_t kMailboxOutControl = 0x26;
constexpr std::uint8_t kMailboxInControl = 0x22;
constexpr unsigned kActivate = reg::kActivateCyclic | reg::kActivateSync0;

SyncManagerChannel process_channel(const SubDeviceInfo& device, std::size_t n,
                                   std::uint16_t size) noexcept {
  SyncManagerChannel channel =
      n < device.sii.sync_manager_count ? device.sii.sync_managers[n] : SyncManagerChannel{};
  channel.length = size;
  channel.active = size > 0;
  return channel;
}

bool can_do_without(const SdoDownload& object, const Failure& failure) noexcept {
  if (object.required || failure.kind != FailureKind::kSdoAborted) return false;
  return failure.abort == SdoAbort::kReadOnly || failure.abort == SdoAbort::kNoSuchObject ||
         failure.abort == SdoAbort::kNoSuchSubindex;
}
}  // namespace

void Configurator::start(const ConfiguratorConfig& config) noexcept {
  config_ = config;
  step_ = Step::kMailboxes;
  first_ = 0;
  end_ = kAll;
  device_ = 0;
  sync0_start_ = 0;
  deadline_set_ = false;
  has_shift_ = false;
  first_toggle_.reset();
}

void Configurator::start_one(const ConfiguratorConfig& config, std::size_t position) noexcept {
  start(config);
  first_ = position;
  end_ = position + 1;
  device_ = position;
}

std::span<const SdoDownload> Configurator::objects_of(const Network& network) const noexcept {
  return device_ == network.bridge ? std::span<const SdoDownload>{bridge::kObjects}
                                   : config_.objects;
}

bool Configurator::concerns(const Network& network) const noexcept {
  const SubDeviceInfo& device = network.devices[device_];
  switch (step_) {
    case Step::kMailboxes:
      return device.sii.receive.size > 0;
    case Step::kObjects:
      return device.sii.coe() && !objects_of(network).empty();
    case Step::kSizes:
      return device.sii.coe() && end_ == kAll;
    case Step::kBridgeSafeOp:
    case Step::kAwaitBridge:
    case Step::kBridgeTime:
      return device_ == network.bridge && end_ == kAll;
    case Step::kAlign:
      return (has_wanted_ || has_shift_) && end_ == kAll && device.dc();
    case Step::kSync0:
      return config_.sync0 && device.dc() && device_ != network.bridge;
    default:
      return true;
  }
}

void Configurator::begin(const Network& network) noexcept {
  deadline_set_ = false;
  if (step_ == Step::kObjects) {
    object_ = 0;
    sdo_.start_download(objects_of(network)[0], config_.sdo_timeout);
  }
  if (step_ == Step::kSizes) {
    walk_ = MappingWalk{};
    sdo_.start_upload(walk_object(), config_.sdo_timeout);
  }
}

Progress Configurator::advance(Network& network, Failure& failure) noexcept {
  const std::size_t end = std::min(end_, network.count);
  while (true) {
    ++device_;
    const bool once = step_ == Step::kReferenceTime;
    if (device_ >= end || once) {
      if (step_ == Step::kAwaitSafeOp) return Progress::kDone;
      step_ = static_cast<Step>(static_cast<std::uint8_t>(step_) + 1);
      device_ = first_;
      if (step_ == Step::kChannels && end_ == kAll &&
          place_image(network, failure) == Progress::kFailed) {
        return Progress::kFailed;
      }
      if (step_ == Step::kReferenceTime) {
        if (config_.sync0 && network.has_reference()) return Progress::kContinue;
        continue;
      }
    }
    if (!concerns(network)) continue;
    begin(network);
    return Progress::kContinue;
  }
}

void Configurator::request(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  const SubDeviceInfo& device = network.devices[device_];
  switch (step_) {
    case Step::kMailboxes: {
      const Bytes both = writer.add(device.target(kFpwr, reg::kSyncManager), 16);
      const MailboxWindow& in = device.sii.receive;
      const MailboxWindow& out = device.sii.send;
      SyncManagerChannel{in.start, in.size, kMailboxOutControl, in.size > 0}.encode(both);
      SyncManagerChannel{out.start, out.size, kMailboxInControl, out.size > 0}.encode(
          both.subspan(8));
      break;
    }
    case Step::kRequestPreOp:
      writer.add_value(device.target(kFpwr, reg::kAlControl), std::uint16_t{2});
      break;
    case Step::kRequestSafeOp:
    case Step::kBridgeSafeOp:
      writer.add_value(device.target(kFpwr, reg::kAlControl), std::uint16_t{4});
      break;
    case Step::kAwaitPreOp:
    case Step::kAwaitSafeOp:
    case Step::kAwaitBridge:
      writer.add(device.target(kFprd, reg::kAlStatus), kAlStatusSize);
      break;
    case Step::kObjects:
    case Step::kSizes:
      sdo_.request(writer, device);
      break;
    case Step::kChannels:
      write_channels(writer, device);
      break;
    case Step::kBridgeTime:
      writer.add(device.target(kFprd, process_channel(device, kInputManager, 0).start),
                 bridge::kInputSize);
      break;
    case Step::kReferenceTime:
      writer.add(network.devices[network.reference].target(kFprd, reg::kSystemTime), 8);
      break;
    case Step::kAlign:
      writer.add_value(device.target(kFpwr, reg::kSystemTimeOffset), device.system_time_offset);
      break;
    case Step::kSync0:
      write_sync0(writer, device);
      break;
  }
}

void Configurator::write_channels(FrameWriter& writer, const SubDeviceInfo& device) noexcept {
  using enum Command;
  const SyncManagerChannel out = process_channel(device, kOutputManager, device.outputs.size);
  const SyncManagerChannel in = process_channel(device, kInputManager, device.inputs.size);
  const Bytes managers = writer.add(device.target(kFpwr, reg::kSyncManager + 16), 16);
  out.encode(managers);
  in.encode(managers.subspan(reg::kSyncManagerSize));
  const Bytes fmmus = writer.add(device.target(kFpwr, reg::kFmmu), 2 * reg::kFmmuSize);
  FmmuChannel{.logical_start = kLogicalStart + device.outputs.offset,
              .length = device.outputs.size,
              .physical_start = out.start,
              .write = true,
              .active = out.active}
      .encode(fmmus);
  FmmuChannel{.logical_start = kLogicalStart + device.inputs.offset,
              .length = device.inputs.size,
              .physical_start = in.start,
              .read = true,
              .active = in.active}
      .encode(fmmus.subspan(reg::kFmmuSize));
}

void Configurator::write_sync0(FrameWriter& writer, const SubDeviceInfo& device) noexcept {
  using enum Command;
  const DriveSync own =
      device_ < config_.drive_sync.size() ? config_.drive_sync[device_] : DriveSync{};
  const bool sync1 = own.sync1_cycles > 0;
  const auto shift = static_cast<std::uint64_t>(own.sync0_shift.count());
  writer.add_value(device.target(kFpwr, reg::kDcActivation), std::uint8_t{0});
  writer.add_value(device.target(kFpwr, reg::kCyclicUnitControl), std::uint8_t{0});
  writer.add_value(device.target(kFpwr, reg::kSync0CycleTime),
                   static_cast<std::uint32_t>(config_.cycle.count()));
  writer.add_value(device.target(kFpwr, reg::kSync1CycleTime),
                   static_cast<std::uint32_t>(own.sync1_register(config_.cycle)));
  writer.add_value(device.target(kFpwr, reg::kSync0StartTime), sync0_start_ + shift);
  writer.add_value(device.target(kFpwr, reg::kDcActivation),
                   static_cast<std::uint8_t>(kActivate | (sync1 ? reg::kActivateSync1 : 0U)));
}

Progress Configurator::take_reference_time(ConstBytes system_time, Network& network,
                                           Failure& failure) noexcept {
  const auto shown = load<std::uint64_t>(system_time, 0);
  if ((!has_wanted_ && !has_shift_) || end_ != kAll) {
    plan_sync0(shown);
    return Progress::kDone;
  }
  if (!network.devices[network.reference].dc64()) {
    return fail(failure, {.kind = FailureKind::kNarrowClock,
                          .position = static_cast<std::uint16_t>(network.reference)});
  }
  const auto wanted =
      has_shift_ ? shown + shift_ : static_cast<std::uint64_t>(wanted_.since_epoch().rounded_ns());
  for (SubDeviceInfo& device : network.all()) device.system_time_offset += wanted - shown;
  plan_sync0(wanted);
  return Progress::kDone;
}

/// Two pairs of stamps, so that the terminal is known to run: the second one counts. Of before a
/// gap of its other side none does.
Progress Configurator::take_bridge_time(const Datagram& inputs, FreeRunningTime now,
                                        Failure& failure) noexcept {
  if (inputs.working_counter() == 1) {
    const auto stamps = bridge::Inputs::decode(inputs.data());
    if (stamps.alone) first_toggle_.reset();
    if (!stamps.alone && !first_toggle_) first_toggle_ = stamps.updated;
    if (!stamps.alone && *first_toggle_ != stamps.updated) {
      has_shift_ = true;
      shift_ = stamps.external - stamps.internal;
      return Progress::kDone;
    }
  }
  if (!deadline_set_) deadline_ = now + config_.bridge_timeout;
  deadline_set_ = true;
  if (now < deadline_) return Progress::kContinue;
  return fail(failure, {.kind = FailureKind::kBridgeSilent,
                        .position = static_cast<std::uint16_t>(device_)});
}

/// A whole multiple of the cycle, so that the phase is the same after each start, plus the shift.
void Configurator::plan_sync0(std::uint64_t system_time) noexcept {
  const auto cycle = static_cast<std::uint64_t>(config_.cycle.count());
  const std::uint64_t earliest =
      system_time + static_cast<std::uint64_t>(config_.sync0_lead.count());
  sync0_start_ =
      (earliest / cycle + 1) * cycle + static_cast<std::uint64_t>(config_.sync0_shift.count());
}

Progress Configurator::reply(const FrameView& frame, Network& network, FreeRunningTime now,
                             Failure& failure) noexcept {
  SubDeviceInfo& device = network.devices[device_];
  Progress progress = Progress::kDone;
  switch (step_) {
    case Step::kAwaitPreOp:
      progress = await(frame, device, AlState::kPreOp, now, failure);
      break;
    case Step::kAwaitSafeOp:
    case Step::kAwaitBridge:
      progress = await(frame, device, AlState::kSafeOp, now, failure);
      break;
    case Step::kObjects:
      progress = objects(frame, network, now, failure);
      break;
    case Step::kSizes:
      progress = sizes(frame, device, now, failure);
      break;
    case Step::kBridgeTime:
      progress = take_bridge_time(frame[0], now, failure);
      break;
    default:
      if (frame[0].working_counter() != 1) {
        progress = fail(failure, {.kind = FailureKind::kNotAnswering,
                                  .position = static_cast<std::uint16_t>(device_)});
      } else if (step_ == Step::kReferenceTime) {
        progress = take_reference_time(frame[0].data(), network, failure);
      }
      break;
  }
  return progress == Progress::kDone ? advance(network, failure) : progress;
}

Progress Configurator::await(const FrameView& frame, SubDeviceInfo& device, AlState wanted,
                             FreeRunningTime now, Failure& failure) noexcept {
  if (frame[0].working_counter() == 1) device.set_al_status(frame[0].data());
  if (device.state == wanted && !device.error) return Progress::kDone;
  if (!deadline_set_) deadline_ = now + config_.state_timeout;
  deadline_set_ = true;
  if (!device.error && now < deadline_) return Progress::kContinue;
  return fail(failure,
              {.kind = device.error ? FailureKind::kStateRefused : FailureKind::kStateTimeout,
               .position = static_cast<std::uint16_t>(device_),
               .wanted = wanted,
               .actual = device.state,
               .code = device.code});
}

Progress Configurator::objects(const FrameView& frame, const Network& network, FreeRunningTime now,
                               Failure& failure) noexcept {
  const std::span<const SdoDownload> wanted = objects_of(network);
  const Progress progress = sdo_.reply(frame, device_, now, failure);
  if (progress == Progress::kFailed && can_do_without(wanted[object_], failure)) {
    failure = Failure{};
  } else if (progress != Progress::kDone) {
    return progress;
  }
  if (++object_ == wanted.size()) return Progress::kDone;
  sdo_.start_download(wanted[object_], config_.sdo_timeout);
  return Progress::kContinue;
}

ObjectAddress Configurator::walk_object() const noexcept {
  const std::uint16_t assign = walk_.inputs ? kTransmitAssign : kReceiveAssign;
  switch (walk_.part) {
    case MappingWalk::Part::kAssigned:
      return {assign, 0};
    case MappingWalk::Part::kMap:
      return {assign, walk_.map};
    case MappingWalk::Part::kEntries:
      return {walk_.index, 0};
    case MappingWalk::Part::kEntry:
      break;
  }
  return {walk_.index, walk_.entry};
}

/// One value of the walk; true when the assignment is at its end.
bool Configurator::walk(std::uint32_t value) noexcept {
  using Part = MappingWalk::Part;
  switch (walk_.part) {
    case Part::kAssigned:
      walk_.maps = static_cast<std::uint8_t>(value);
      walk_.map = 0;
      break;
    case Part::kMap:
      walk_.index = static_cast<std::uint16_t>(value);
      walk_.part = Part::kEntries;
      return false;
    case Part::kEntries:
      walk_.entries = static_cast<std::uint8_t>(value);
      walk_.entry = 0;
      break;
    case Part::kEntry:
      walk_.bits += value & 0xFFU;
      break;
  }
  if (walk_.part != Part::kAssigned && walk_.entry < walk_.entries) {
    ++walk_.entry;
    walk_.part = Part::kEntry;
    return false;
  }
  if (walk_.map == walk_.maps) return true;
  ++walk_.map;
  walk_.part = Part::kMap;
  return false;
}

Progress Configurator::sizes(const FrameView& frame, SubDeviceInfo& device, FreeRunningTime now,
                             Failure& failure) noexcept {
  const Progress progress = sdo_.reply(frame, device_, now, failure);
  if (progress != Progress::kDone) return progress;
  if (walk(sdo_.value())) {
    // Beyond one frame place_image() refuses it, whatever it is.
    const auto bytes =
        static_cast<std::uint16_t>(std::min<std::size_t>((walk_.bits + 7) / 8, kMaxImageSize + 1));
    (walk_.inputs ? device.inputs : device.outputs).size = bytes;
    if (walk_.inputs) return Progress::kDone;
    walk_ = MappingWalk{};
    walk_.inputs = true;
  }
  sdo_.start_upload(walk_object(), config_.sdo_timeout);
  return Progress::kContinue;
}

Progress Configurator::place_image(Network& network, Failure& failure) noexcept {
  std::size_t at = 0;
  for (SubDeviceInfo& device : network.all()) {
    if (!device.sii.coe() && device.sii.sync_manager_count > kInputManager) {
      device.outputs.size = device.sii.sync_managers[kOutputManager].length;
      device.inputs.size = device.sii.sync_managers[kInputManager].length;
    }
  }
  for (const bool inputs : {false, true}) {
    for (SubDeviceInfo& device : network.all()) {
      ImagePart& part = inputs ? device.inputs : device.outputs;
      part.offset = static_cast<std::uint16_t>(at);
      at += part.size;
    }
  }
  if (at <= kMaxImageSize) return Progress::kContinue;
  return fail(failure, {.kind = FailureKind::kProcessImageTooLarge,
                        .expected = kMaxImageSize,
                        .received = static_cast<std::uint16_t>(std::min<std::size_t>(at, 0xFFFF))});
}

}  // namespace ftcs::ethercat
