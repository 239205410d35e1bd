// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/clock_setup.h"

namespace ftcs::ethercat {

namespace {
constexpr std::size_t kReceiveTimesSize = 16;
}

void ClockSetup::start(const ClockSetupConfig& config) noexcept {
  config_ = config;
  step_ = Step::kLatch;
  pulses_left_ = config.drift_pulses;
}

void add_drift(FrameWriter& writer, const Network& network) noexcept {
  const SubDeviceInfo& reference = network.devices[network.reference];
  writer.add(reference.target(Command::kFrmw, reg::kSystemTime), 8);
  constexpr std::size_t kStamp = 4;
  if (writer.room() < kDatagramOverhead + kStamp) return;
  writer.add(reference.target(Command::kFpwr, reg::kReceiveTimePort0), kStamp);
}

void ClockSetup::request(FrameWriter& writer, const Network& network) noexcept {
  using enum Command;
  const SubDeviceInfo& device = network.devices[device_];
  switch (step_) {
    case Step::kLatch:
      writer.add({kBwr, 0, reg::kReceiveTimePort0}, 4);
      break;
    case Step::kReadTimes:
      writer.add(device.target(kFprd, reg::kReceiveTimePort0), kReceiveTimesSize);
      writer.add(device.target(kFprd, reg::kReceiveTimeProcessingUnit), 8);
      break;
    case Step::kWriteOffsets: {
      const Bytes both = writer.add(device.target(kFpwr, reg::kSystemTimeOffset), 12);
      store(both, 0, device.system_time_offset);
      store(both, 8, device.propagation_delay);
      writer.add_value(device.target(kFpwr, reg::kSpeedCounterStart), std::uint16_t{0x1000});
      break;
    }
    case Step::kDrift:
      add_drift(writer, network);
      break;
  }
}

void ClockSetup::next_clock(const Network& network) noexcept {
  do {
    ++device_;
  } while (device_ < network.count && !network.devices[device_].dc());
}

Progress ClockSetup::reply(const FrameView& frame, Network& network, FreeRunningTime sent,
                           Failure& failure) noexcept {
  if (!network.has_reference()) return fail(failure, {.kind = FailureKind::kNoDistributedClock});
  const std::uint16_t counter = frame[0].working_counter();
  const std::size_t expected =
      step_ == Step::kLatch || step_ == Step::kDrift ? network.clocks() : 1;
  if (counter != expected && step_ != Step::kDrift) {
    return fail(failure, {.kind = FailureKind::kNotAnswering,
                          .position = static_cast<std::uint16_t>(device_),
                          .expected = static_cast<std::uint16_t>(expected),
                          .received = counter});
  }
  switch (step_) {
    case Step::kLatch:
      latched_ = sent;
      device_ = network.reference;
      step_ = Step::kReadTimes;
      break;
    case Step::kReadTimes: {
      SubDeviceInfo& device = network.devices[device_];
      for (std::size_t port = 0; port < reg::kPorts; ++port) {
        device.receive_times[port] = load<std::uint32_t>(frame[0].data(), 4 * port);
      }
      device.receive_time = load<std::uint64_t>(frame[1].data(), 0);
      next_clock(network);
      if (device_ < network.count) break;
      compute(network);
      device_ = network.reference;
      step_ = Step::kWriteOffsets;
      break;
    }
    case Step::kWriteOffsets:
      next_clock(network);
      if (device_ < network.count) break;
      step_ = Step::kDrift;
      if (pulses_left_ == 0) return Progress::kDone;
      break;
    case Step::kDrift:
      if (--pulses_left_ == 0) return Progress::kDone;
      break;
  }
  return Progress::kContinue;
}

void ClockSetup::compute(Network& network) noexcept {
  compute_propagation_delays(network, config_.processing_excess);
  const std::uint64_t base = network.devices[network.reference].receive_time;
  const auto system = static_cast<std::uint64_t>(latched_.since_epoch().rounded_ns());
  for (SubDeviceInfo& device : network.all()) {
    if (!device.dc()) continue;
    // system - base is the reference's offset; base - local aligns, the delay is what it took.
    device.system_time_offset =
        (system - base) + (base - device.receive_time) + device.propagation_delay;
  }
}

}  // namespace ftcs::ethercat
