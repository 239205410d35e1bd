// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/cyclic_exchange.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
constexpr std::size_t kAlStatusSize = 6;
constexpr std::uint32_t kMagnitude = 0x7FFFFFFF;
/// Eight states in one frame: 144 bytes.
constexpr std::size_t kHurriedTurns = 8;
}  // namespace

namespace {
std::uint16_t share_of(const SubDeviceInfo& device) noexcept {
  return static_cast<std::uint16_t>((device.outputs.size > 0 ? 2 : 0) +
                                    (device.inputs.size > 0 ? 1 : 0));
}
}  // namespace

void CyclicExchange::start(const Network& network) noexcept {
  image_.fill(0);
  control_.fill(0);
  takes_part_.fill(false);
  estimate_ = {};
  told_ = 0;
  offset_changed_ = false;
  writes_offset_ = false;
  image_size_ = 0;
  input_start_ = 0;
  expected_ = 0;
  whole_ = 0;
  turn_ = 0;
  turns_ = 0;
  hurry_ = false;
  last_reference_ = 0;
  for (std::size_t n = 0; n < network.count; ++n) {
    const SubDeviceInfo& device = network.devices[n];
    const auto end = [](const ImagePart& part) -> std::size_t { return part.offset + part.size; };
    image_size_ = std::max({image_size_, end(device.outputs), end(device.inputs)});
    input_start_ = std::max(input_start_, end(device.outputs));
    whole_ = static_cast<std::uint16_t>(whole_ + share_of(device));
    takes_part_[n] = true;
  }
  expected_ = whole_;
}

void CyclicExchange::set_part(const Network& network, std::size_t position, bool part) noexcept {
  if (takes_part_[position] == part) return;
  takes_part_[position] = part;
  control_[position] = 0;
  const SubDeviceInfo& device = network.devices[position];
  const unsigned share = share_of(device);
  expected_ = static_cast<std::uint16_t>(part ? expected_ + share : expected_ - share);
  for (const ImagePart& data : {device.outputs, device.inputs}) {
    const Bytes bytes = Bytes{image_}.subspan(data.offset, data.size);
    std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  }
}

void CyclicExchange::request(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  datagrams_ = 3;
  if (asks_reference(network)) {
    const Bytes time =
        writer.add(network.devices[network.reference].target(kFrmw, reg::kSystemTime), 8);
    // Who knows the time to the nanosecond must not take the answer for an echo each time.
    odd_frame_ = !odd_frame_;
    const std::int64_t estimate = estimate_.since_epoch().rounded_ns();
    told_ = static_cast<std::uint64_t>(odd_frame_ ? estimate + 1 : estimate);
    store(time, 0, told_);
    ++datagrams_;
  }
  wrote_time_ = writes_time_ && asks_reference(network);
  writes_time_ = false;
  if (wrote_time_) {
    const SubDeviceInfo& reference = network.devices[network.reference];
    writer.add_value(reference.target(kFpwr, reg::kSystemTime),
                     static_cast<std::uint64_t>(written_time_.since_epoch().rounded_ns()));
    ++datagrams_;
  }
  writes_offset_ = offset_changed_ && asks_reference(network);
  if (writes_offset_) {
    const SubDeviceInfo& reference = network.devices[network.reference];
    writer.add_value(reference.target(kFpwr, reg::kSystemTimeOffset), reference.system_time_offset);
    ++datagrams_;
  }
  writer.add(Target::logical(kLrw, kLogicalStart), ConstBytes{image_}.first(image_size_));
  if (network.has_reference()) {
    writer.add({kBrd, 0, reg::kSystemTimeDifference}, 4);
    ++datagrams_;
  }
  writer.add({kBrd, 0, reg::kAlStatus}, 2);
  ask_in_turn(writer, network);
}

void CyclicExchange::ask_in_turn(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  compares_ = false;
  const auto* waiting = std::find_if(control_.begin(), control_.begin() + network.count,
                                     [](std::uint16_t control) { return control != 0; });
  turn_is_control_ = waiting != control_.begin() + network.count && !hurry_;
  if (turn_is_control_) {
    turn_ = static_cast<std::size_t>(waiting - control_.begin());
    turns_ = 1;
    writer.add_value(network.devices[turn_].target(kFpwr, reg::kAlControl), *waiting);
    return;
  }
  turn_ = (turn_ + std::max<std::size_t>(turns_, 1)) % network.count;
  turns_ = 0;
  const SubDeviceInfo& first = network.devices[turn_];
  // Who is to be brought back needs the room.
  compares_ = !hurry_ && expected_ == whole_ && first.dc() &&
              writer.room() >= 4 + kAlStatusSize + 2 * kDatagramOverhead;
  if (compares_) {
    writer.add(first.target(kFprd, reg::kSystemTimeDifference), 4);
    ++datagrams_;
  }
  const std::size_t most = std::min(hurry_ ? kHurriedTurns : 1, network.count);
  do {
    const std::size_t n = (turn_ + turns_) % network.count;
    writer.add(network.devices[n].target(kFprd, reg::kAlStatus), kAlStatusSize);
    ++turns_;
  } while (turns_ < most && writer.room() >= kAlStatusSize + kDatagramOverhead);
  datagrams_ += turns_ - 1;
}

ReferenceTime CyclicExchange::unwrap(ConstBytes data, bool wide) noexcept {
  if (wide) {
    last_reference_ = load<std::uint64_t>(data, 0);
  } else {
    // Less than 2.1 s between two frames: the lower half tells how far time has gone.
    const auto low = load<std::uint32_t>(data, 0);
    const auto step = static_cast<std::int32_t>(low - static_cast<std::uint32_t>(last_reference_));
    last_reference_ += static_cast<std::uint64_t>(std::int64_t{step});
  }
  return ReferenceTime::from_ns(static_cast<std::int64_t>(last_reference_));
}

/// The reference reads, all others write. A restarted reference, which has forgotten its address,
/// writes too: only the time tells, by not being what was sent. Equal by chance: one sample less.
void CyclicExchange::take_reference(const Datagram& time, const Network& network,
                                    CycleReport& report) noexcept {
  const bool wide = network.devices[network.reference].dc64();
  const bool untouched =
      wide ? load<std::uint64_t>(time.data(), 0) == told_
           : load<std::uint32_t>(time.data(), 0) == static_cast<std::uint32_t>(told_);
  report.has_reference = time.working_counter() > 0 && !untouched;
  if (report.has_reference) report.reference = unwrap(time.data(), wide);
}

CycleReport CyclicExchange::reply(const FrameView& frame, Network& network) noexcept {
  CycleReport report;
  report.expected = expected_;
  report.whole = whole_;
  auto datagram = frame.begin();
  if (asks_reference(network)) {
    take_reference(*datagram, network, report);
    ++datagram;
  }
  if (wrote_time_) ++datagram;
  if (writes_offset_) {
    if ((*datagram).working_counter() == 1) offset_changed_ = false;
    ++datagram;
  }
  const Datagram image = *datagram;
  report.working_counter = image.working_counter();
  report.inputs_valid = report.working_counter == expected_;
  if (report.inputs_valid) {
    const ConstBytes inputs = image.data().subspan(input_start_);
    std::copy(inputs.begin(), inputs.end(), Bytes{image_}.subspan(input_start_).begin());
  }
  ++datagram;
  if (network.has_reference()) {
    report.difference_bound_ns = load<std::uint32_t>((*datagram).data(), 0) & kMagnitude;
    ++datagram;
  }
  const Datagram states = *datagram;
  report.answering = states.working_counter();
  report.states = load<std::uint16_t>(states.data(), 0);
  hurry_ = !report.inputs_valid;
  ++datagram;
  if (compares_ && (*datagram).working_counter() == 1) {
    report.compared = static_cast<std::uint16_t>(turn_);
    network.devices[turn_].system_time_difference =
        load<std::uint32_t>((*datagram).data(), 0) & kMagnitude;
  }
  take_turns(frame.from(datagrams_ - turns_), network);
  return report;
}

void CyclicExchange::take_turns(const FrameView& turns, Network& network) noexcept {
  if (turn_is_control_) {
    // Sent again until somebody took it.
    if (turns[0].working_counter() == 1) control_[turn_] = 0;
    return;
  }
  auto datagram = turns.begin();
  for (std::size_t i = 0; i < turns_; ++i, ++datagram) {
    const std::size_t n = (turn_ + i) % network.count;
    SubDeviceInfo& device = network.devices[n];
    if ((*datagram).working_counter() == 1) {
      device.set_al_status((*datagram).data());
    } else {
      device.state = AlState::kNone;
      device.error = false;
    }
  }
}

}  // namespace ftcs::ethercat
