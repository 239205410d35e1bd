// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/subdevice.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
/// After a silence of this many SYNC0 events the rest is skipped: work per frame stays bounded.
constexpr int kMaxSync0PerFrame = 32;
constexpr std::uint8_t kAllPortsMii = 0xFF;
constexpr std::uint8_t kControllerType = 0x11;
/// PDI operational and watchdog status in DL status.
constexpr std::uint16_t kDlOperational = 0x0001;
constexpr std::uint16_t kDlStatusEvent = 0x0004;
constexpr std::uint16_t kAlStatusEvent = 0x0008;
constexpr std::size_t kOutputManager = 2;
}  // namespace

SubDevice::SubDevice(const SubDeviceConfig& config, LocalOscillator& oscillator) noexcept
    : config_(config),
      oscillator_(oscillator),
      dc_(memory_, oscillator, config.clock),
      sii_(memory_, config.other_side != nullptr
                        ? make_bridge_image(config.identity, config.alias)
                        : make_drive_image(config.identity, config.alias, config.dc)),
      drive_(memory_, config.identity,
             config.other_side != nullptr ? DeviceKind::kBridge : DeviceKind::kDrive) {
  power_cycle(WireTime{});
}

void SubDevice::power_cycle(WireTime now) noexcept {
  memory_.clear();
  memory_.set(reg::kType, kControllerType);
  memory_.set(reg::kFmmuCount, static_cast<std::uint8_t>(EscMemory::kFmmus));
  memory_.set(reg::kSyncManagerCount, static_cast<std::uint8_t>(EscMemory::kSyncManagers));
  memory_.set(reg::kRamSize, static_cast<std::uint8_t>(EscMemory::kRamKiByte));
  memory_.set(reg::kPortDescriptor, kAllPortsMii);
  const unsigned features =
      config_.dc ? reg::kFeatureDc | (config_.dc64 ? reg::kFeatureDc64 : 0U) : 0U;
  memory_.set(reg::kFeatures, static_cast<std::uint16_t>(features));
  memory_.set(reg::kPdiControl, std::uint8_t{0x05});
  memory_.set(reg::kWatchdogDivider, std::uint16_t{0x09C2});
  memory_.set(reg::kWatchdogTimePdi, std::uint16_t{0x03E8});
  memory_.set(reg::kWatchdogTimeProcessData, std::uint16_t{0x03E8});
  memory_.set(reg::kDlStatus, static_cast<std::uint16_t>(links_.bits | kDlOperational));
  sii_.power_on();
  if (config_.dc) dc_.power_on(now);
  decode_channels();
  latching_ = false;
  drive_.power_on(oscillator_.reading(now));
}

void SubDevice::set_port_open(unsigned port, bool open) noexcept {
  if (links_.open(port) == open && (open || links_.loop_closed(port))) return;
  links_.set(port, open);
  memory_.set(reg::kDlStatus, static_cast<std::uint16_t>(links_.bits | kDlOperational));
  const auto event = memory_.get<std::uint16_t>(reg::kEventRequest);
  memory_.set(reg::kEventRequest, static_cast<std::uint16_t>(event | kDlStatusEvent));
}

void SubDevice::advance(WireTime now) noexcept {
  Sync0Event event;
  for (int i = 0; dc_.take_sync0(now, event); ++i) {
    drive_.on_sync0(event);
    if (i >= kMaxSync0PerFrame) dc_.skip_sync0(now);
  }
  if (config_.other_side != nullptr) latch_both_sides(now);
  drive_.tick(oscillator_.reading(now));
}

/// A bridge terminal has a pace of its own: each millisecond, wherever the frames are.
void SubDevice::latch_both_sides(WireTime now) noexcept {
  constexpr std::int64_t kPaceNs = 1'000'000;
  const std::int64_t number = now.since_epoch().floor_ns() / kPaceNs;
  if (number == latches_) return;
  latches_ = number;
  const auto instant = WireTime::from_ns(number * kPaceNs);
  drive_.show_stamps(dc_.system_time(instant), config_.other_side->system_time(instant));
}

void SubDevice::process(const FrameView& frame, WireTime sof) noexcept {
  advance(sof);
  if (config_.dc) dc_.refresh(sof);
  latching_ = false;
  for (const Datagram datagram : frame) process(datagram, sof);
  drive_.serve_mailbox();
}

void SubDevice::process(const Datagram& datagram, WireTime sof) noexcept {
  const auto mask = memory_.get<std::uint16_t>(reg::kEventMask);
  datagram.add_event(
      static_cast<std::uint16_t>(memory_.get<std::uint16_t>(reg::kEventRequest) & mask));
  switch (addressing(datagram.command())) {
    case Addressing::kNone:
      break;
    case Addressing::kLogical:
      process_logical(datagram, sof);
      break;
    case Addressing::kConfigured:
      process_physical(datagram, sof);
      break;
    case Addressing::kAutoIncrement:
    case Addressing::kBroadcast:
      process_physical(datagram, sof);
      datagram.set_position(static_cast<std::uint16_t>(datagram.position() + 1));
      break;
  }
}

bool SubDevice::addressed(const Datagram& datagram) const noexcept {
  const std::uint16_t position = datagram.position();
  switch (addressing(datagram.command())) {
    case Addressing::kAutoIncrement:
      return position == 0;
    case Addressing::kBroadcast:
      return true;
    case Addressing::kConfigured: {
      constexpr std::uint32_t kAliasEnabled = 1U << 24;
      const bool by_alias = (memory_.get<std::uint32_t>(reg::kDlControl) & kAliasEnabled) != 0 &&
                            position == memory_.get<std::uint16_t>(reg::kStationAlias);
      return by_alias || position == memory_.get<std::uint16_t>(reg::kStationAddress);
    }
    default:
      return false;
  }
}

void SubDevice::process_physical(const Datagram& datagram, WireTime sof) noexcept {
  const bool hit = addressed(datagram);
  const std::size_t address = datagram.offset();
  const Bytes data = datagram.data();
  using enum Command;
  switch (datagram.command()) {
    case kAprd:
    case kFprd:
    case kBrd:
      if (hit && read(address, data, datagram.command() == kBrd)) {
        datagram.add_to_working_counter(1);
      }
      break;
    case kApwr:
    case kFpwr:
    case kBwr:
      if (hit && write(address, data, sof)) datagram.add_to_working_counter(1);
      break;
    case kArmw:
    case kFrmw:
      if (hit ? read(address, data, false) : write(address, data, sof)) {
        datagram.add_to_working_counter(1);
      }
      break;
    case kAprw:
    case kFprw:
    case kBrw: {
      if (!hit) break;
      // What came is written, what stood there goes on: both from before the exchange.
      std::array<std::uint8_t, kLengthMask> came;
      std::copy(data.begin(), data.end(), came.begin());
      const bool was_read = read(address, data, datagram.command() == kBrw);
      const bool was_written = write(address, ConstBytes{came}.first(data.size()), sof);
      datagram.add_to_working_counter((was_read ? 1U : 0U) + (was_written ? 2U : 0U));
      break;
    }
    default:
      break;
  }
}

void SubDevice::process_logical(const Datagram& datagram, WireTime sof) noexcept {
  const Command command = datagram.command();
  bool was_read = false;
  bool was_written = false;
  // Reads come second, so that a datagram whose input and output areas overlap still delivers its
  // outputs; each direction counts once however many channels it took.
  for (const FmmuChannel& channel : fmmus_) {
    if (channel.active && channel.write && command != Command::kLrd) {
      was_written |= map(channel, datagram, true, sof);
    }
  }
  for (const FmmuChannel& channel : fmmus_) {
    if (channel.active && channel.read && command != Command::kLwr) {
      was_read |= map(channel, datagram, false, sof);
    }
  }
  const unsigned write_weight = command == Command::kLrw ? 2 : 1;
  datagram.add_to_working_counter((was_read ? 1U : 0U) + (was_written ? write_weight : 0U));
}

bool SubDevice::map(const FmmuChannel& channel, const Datagram& datagram, bool write,
                    WireTime sof) noexcept {
  if (channel.start_bit != 0 || channel.stop_bit != 7 || channel.physical_bit != 0) {
    return map_bits(channel, datagram, write);
  }
  const std::uint64_t wanted = datagram.logical_address();
  const Bytes data = datagram.data();
  const std::uint64_t first = std::max<std::uint64_t>(wanted, channel.logical_start);
  const std::uint64_t end =
      std::min(wanted + data.size(), std::uint64_t{channel.logical_start} + channel.length);
  if (first >= end) return false;
  const Bytes part =
      data.subspan(static_cast<std::size_t>(first - wanted), static_cast<std::size_t>(end - first));
  const std::size_t address =
      channel.physical_start + static_cast<std::size_t>(first - channel.logical_start);
  return write ? this->write(address, part, sof) : read(address, part, false);
}

bool SubDevice::map_bits(const FmmuChannel& channel, const Datagram& datagram,
                         bool write) noexcept {
  const Bytes data = datagram.data();
  const std::uint64_t wanted = std::uint64_t{datagram.logical_address()} * 8;
  const std::uint64_t start = std::uint64_t{channel.logical_start} * 8 + channel.start_bit;
  const std::uint64_t end =
      (std::uint64_t{channel.logical_start} + channel.length) * 8 - (7U - channel.stop_bit);
  const std::uint64_t physical = std::uint64_t{channel.physical_start} * 8 + channel.physical_bit;
  bool any = false;
  for (std::uint64_t bit = std::max(start, wanted); bit < std::min(end, wanted + data.size() * 8);
       ++bit) {
    const std::uint64_t here = physical + (bit - start);
    const auto address = static_cast<std::size_t>(here / 8);
    if (!EscMemory::contains(address, 1) || (write && !writable(address))) return any;
    const Bytes memory = memory_.bytes();
    std::uint8_t& there = data[static_cast<std::size_t>((bit - wanted) / 8)];
    const auto there_mask = static_cast<std::uint8_t>(1U << (bit % 8));
    const auto here_mask = static_cast<std::uint8_t>(1U << (here % 8));
    std::uint8_t& target = write ? memory[address] : there;
    const bool value = write ? (there & there_mask) != 0 : (memory[address] & here_mask) != 0;
    const std::uint8_t mask = write ? here_mask : there_mask;
    target = static_cast<std::uint8_t>(value ? target | mask : target & ~mask);
    any = true;
  }
  return any;
}

bool SubDevice::mailbox_blocks(std::size_t address, std::size_t size, bool write) const noexcept {
  for (std::size_t n = 0; n < sync_managers_.size(); ++n) {
    const SyncManagerChannel& channel = sync_managers_[n];
    if (!channel.active || !overlaps(address, size, channel.start, channel.length)) continue;
    if (channel.main_device_writes() != write) return channel.mailbox() || write;
    // A full mailbox takes nothing, an empty one gives nothing.
    if (channel.mailbox() && memory_.mailbox_full(n) == write) return true;
  }
  return false;
}

bool SubDevice::read(std::size_t address, Bytes out, bool merge) noexcept {
  if (!EscMemory::contains(address, out.size())) return false;
  if (mailbox_blocks(address, out.size(), false)) return false;
  const ConstBytes bytes = ConstBytes{memory_.bytes()}.subspan(address, out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint8_t>(merge ? out[i] | bytes[i] : bytes[i]);
  }
  after_read(address, out.size());
  return true;
}

void SubDevice::after_read(std::size_t address, std::size_t size) noexcept {
  auto event = memory_.get<std::uint16_t>(reg::kEventRequest);
  if (overlaps(address, size, reg::kDlStatus, 2))
    event &= static_cast<std::uint16_t>(~kDlStatusEvent);
  if (overlaps(address, size, reg::kAlStatus, 2))
    event &= static_cast<std::uint16_t>(~kAlStatusEvent);
  memory_.set(reg::kEventRequest, event);
  for (std::size_t n = 0; n < sync_managers_.size(); ++n) {
    const SyncManagerChannel& channel = sync_managers_[n];
    const bool last =
        channel.length > 0 && overlaps(address, size, channel.start + channel.length - 1U, 1);
    if (channel.active && channel.mailbox() && !channel.main_device_writes() && last) {
      memory_.set_mailbox_full(n, false);
    }
  }
}

bool SubDevice::writable(std::size_t address) const noexcept {
  struct Range {
    std::uint16_t first;
    std::uint16_t last;
  };
  // What the MainDevice may write (ETG.1000.4, access column). System time is no memory: a write
  // there is a step of the control loop (after_dc_write).
  static constexpr Range kWritable[] = {
      {0x0010, 0x0011}, {0x0100, 0x0103}, {0x0120, 0x0121}, {0x0200, 0x0207}, {0x0300, 0x0313},
      {0x0400, 0x0401}, {0x0410, 0x0411}, {0x0420, 0x0421}, {0x0442, 0x0443}, {0x0500, 0x0500},
      {0x0502, 0x050F}, {0x0600, 0x06FF}, {0x0920, 0x092B}, {0x0930, 0x0931}, {0x0934, 0x0936},
      {0x0980, 0x0981}, {0x0990, 0x0997}, {0x09A0, 0x09A9}};
  if (address >= reg::kProcessRam) return true;
  if (address >= reg::kSyncManager &&
      address < reg::kSyncManager + EscMemory::kSyncManagers * reg::kSyncManagerSize) {
    const std::size_t at = address % reg::kSyncManagerSize;
    return at != 5 && at != 7;  // status; the application's control
  }
  if (address >= reg::kSiiControl && address < reg::kSiiData + 8U) {
    return (memory_.get<std::uint8_t>(reg::kSiiConfiguration) & 1U) == 0;  // else the PDI owns it
  }
  return std::any_of(std::begin(kWritable), std::end(kWritable), [address](const Range& range) {
    return address >= range.first && address <= range.last;
  });
}

bool SubDevice::write(std::size_t address, ConstBytes in, WireTime sof) noexcept {
  if (!EscMemory::contains(address, in.size())) return false;
  if (mailbox_blocks(address, in.size(), true)) return false;
  const Bytes bytes = memory_.bytes();
  bool any = config_.dc && overlaps(address, in.size(), reg::kReceiveTimePort0, 0x18);
  for (std::size_t i = 0; i < in.size(); ++i) {
    if (!writable(address + i)) continue;
    bytes[address + i] = in[i];
    any = true;
  }
  if (any) after_write(address, in, sof);
  return any;
}

void SubDevice::after_write(std::size_t address, ConstBytes in, WireTime sof) noexcept {
  const std::size_t size = in.size();
  const Duration crystal = oscillator_.reading(sof);
  if (address >= reg::kProcessRam) {
    for (std::size_t n = 0; n < sync_managers_.size(); ++n) {
      const SyncManagerChannel& channel = sync_managers_[n];
      const bool last =
          channel.length > 0 && overlaps(address, size, channel.start + channel.length - 1U, 1);
      if (!channel.active || !channel.main_device_writes() || !last) continue;
      if (channel.mailbox()) memory_.set_mailbox_full(n, true);
      if (n == kOutputManager) drive_.on_outputs(dc_.system_time(sof), crystal);
    }
    return;
  }
  if (overlaps(address, size, reg::kAlControl, 1)) {
    drive_.request_state(memory_.get<std::uint16_t>(reg::kAlControl), crystal);
  }
  if (overlaps(address, size, reg::kRxErrorCounter, 0x14)) {
    const Bytes counters = memory_.bytes().subspan(reg::kRxErrorCounter, 0x14);
    std::fill(counters.begin(), counters.end(), std::uint8_t{0});
  }
  if (overlaps(address, size, reg::kWatchdogCounter, 2)) {
    memory_.set(reg::kWatchdogCounter, std::uint16_t{0});
  }
  if (overlaps(address, size, reg::kSiiControl, 2) && writable(reg::kSiiControl)) sii_.execute();
  if (overlaps(address, size, reg::kFmmu, 0x300)) decode_channels();
  if (config_.dc) after_dc_write(address, in, sof);
}

void SubDevice::after_dc_write(std::size_t address, ConstBytes in, WireTime sof) noexcept {
  const std::size_t size = in.size();
  if (overlaps(address, size, reg::kReceiveTimePort0, 4)) {
    dc_.latch_arrival(sof);
    latching_ = true;
  }
  if (covers(address, size, reg::kSystemTime, 4)) {
    const ConstBytes received = in.subspan(reg::kSystemTime - address);
    dc_.synchronise(sof, received.first(received.size() >= 8 ? 8 : 4));
  }
  if (overlaps(address, size, reg::kSystemTimeOffset, 12)) dc_.refresh(sof);
  if (overlaps(address, size, reg::kSpeedCounterStart, 2)) dc_.reset_loop();
  if (overlaps(address, size, reg::kDcActivation, 1)) dc_.activate(sof);
}

void SubDevice::decode_channels() noexcept {
  for (std::size_t n = 0; n < fmmus_.size(); ++n) {
    fmmus_[n] = FmmuChannel::decode(
        ConstBytes{memory_.bytes()}.subspan(reg::kFmmu + n * reg::kFmmuSize, reg::kFmmuSize));
  }
  constexpr std::uint8_t kRepeat = 0x02;
  for (std::size_t n = 0; n < sync_managers_.size(); ++n) {
    const bool was_active = sync_managers_[n].active;
    sync_managers_[n] = memory_.sync_manager(n);
    if (sync_managers_[n].active != was_active) memory_.set_mailbox_full(n, false);
    // Repeat request: the last message is shown once more and the request acknowledged.
    const std::size_t at = reg::kSyncManager + n * reg::kSyncManagerSize;
    const auto wanted = static_cast<std::uint8_t>(memory_.get<std::uint8_t>(at + 6) & kRepeat);
    const auto acknowledged =
        static_cast<std::uint8_t>(memory_.get<std::uint8_t>(at + 7) & kRepeat);
    if (wanted == acknowledged || !sync_managers_[n].active) continue;
    memory_.set(at + 7, wanted);
    if (sync_managers_[n].mailbox()) memory_.set_mailbox_full(n, true);
  }
}

std::int32_t SubDevice::system_time_difference() const noexcept {
  const auto bits = memory_.get<std::uint32_t>(reg::kSystemTimeDifference);
  const auto magnitude = static_cast<std::int32_t>(bits & 0x7FFFFFFFU);
  const bool sign = (bits >> 31) != 0;
  return sign == config_.clock.sign_bit_means_ahead ? magnitude : -magnitude;
}

}  // namespace ftcs::ethercat
