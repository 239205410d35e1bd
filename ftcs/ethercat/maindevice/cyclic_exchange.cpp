// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/cyclic_exchange.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
constexpr std::size_t kAlStatusSize = 6;
constexpr std::uint32_t kMagnitude = 0x7FFFFFFF;
}  // namespace

void CyclicExchange::start(const Network& network) noexcept {
  image_.fill(0);
  control_.fill(0);
  image_size_ = 0;
  input_start_ = 0;
  expected_ = 0;
  turn_ = 0;
  last_reference_ = 0;
  for (const SubDeviceInfo& device : network.all()) {
    const auto end = [](const ImagePart& part) -> std::size_t { return part.offset + part.size; };
    image_size_ = std::max({image_size_, end(device.outputs), end(device.inputs)});
    input_start_ = std::max(input_start_, end(device.outputs));
    expected_ = static_cast<std::uint16_t>(expected_ + (device.outputs.size > 0 ? 2 : 0) +
                                           (device.inputs.size > 0 ? 1 : 0));
  }
}

void CyclicExchange::request(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  if (network.has_reference()) {
    writer.add(network.devices[network.reference].target(kFrmw, reg::kSystemTime), 8);
  }
  writer.add(Target::logical(kLrw, kLogicalStart), ConstBytes{image_}.first(image_size_));
  if (network.has_reference()) writer.add({kBrd, 0, reg::kSystemTimeDifference}, 4);
  writer.add({kBrd, 0, reg::kAlStatus}, 2);
  const auto* waiting = std::find_if(control_.begin(), control_.begin() + network.count,
                                     [](std::uint16_t control) { return control != 0; });
  turn_is_control_ = waiting != control_.begin() + network.count;
  if (turn_is_control_) {
    turn_ = static_cast<std::size_t>(waiting - control_.begin());
    writer.add_value(network.devices[turn_].target(kFpwr, reg::kAlControl), *waiting);
  } else {
    turn_ = (turn_ + 1) % network.count;
    writer.add(network.devices[turn_].target(kFprd, reg::kAlStatus), kAlStatusSize);
  }
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

CycleReport CyclicExchange::reply(const FrameView& frame, Network& network) noexcept {
  CycleReport report;
  report.expected = expected_;
  std::size_t n = 0;
  if (network.has_reference()) {
    const Datagram time = frame[n++];
    report.has_reference = time.working_counter() > 0;
    if (report.has_reference) {
      report.reference = unwrap(time.data(), network.devices[network.reference].dc64());
    }
  }
  const Datagram image = frame[n++];
  report.working_counter = image.working_counter();
  report.inputs_valid = report.working_counter == expected_;
  if (report.inputs_valid) {
    const ConstBytes inputs = image.data().subspan(input_start_);
    std::copy(inputs.begin(), inputs.end(), Bytes{image_}.subspan(input_start_).begin());
  }
  if (network.has_reference()) {
    report.difference_bound_ns = load<std::uint32_t>(frame[n++].data(), 0) & kMagnitude;
  }
  const Datagram states = frame[n++];
  report.answering = states.working_counter();
  report.states = load<std::uint16_t>(states.data(), 0);
  take_status(frame[n], network);
  return report;
}

void CyclicExchange::take_status(const Datagram& datagram, Network& network) noexcept {
  if (turn_is_control_) {
    // Sent again until somebody took it.
    if (datagram.working_counter() == 1) control_[turn_] = 0;
    return;
  }
  SubDeviceInfo& device = network.devices[turn_];
  if (datagram.working_counter() == 1) {
    device.set_al_status(datagram.data());
  } else {
    device.state = AlState::kNone;
  }
}

}  // namespace ftcs::ethercat
