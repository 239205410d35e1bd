// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "ftcs/discipline/bus_clock.h"
#include "ftcs/discipline/cycle_servo.h"
#include "ftcs/ethercat/maindevice/csp_axis.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/node/circle_path.h"
#include "ftcs/sim/drives/segment.h"

namespace ftcs::bench {

/// The cyclic path of eight CSP drives without system calls: path, axes, frame out, frame in,
/// servo. Goal: 3 us. The modelled segment takes part in the bring-up only; then each frame is
/// answered by an echo with right working counters, whose cost `ethercat_wire_alone` says.
template <CycleLaw law>
class EthercatCycleCase {
 public:
  EthercatCycleCase() : servo_(config()) {
    bring_up();
    cyclic();
    main_->request_operational();
    constexpr int kToOpAndFullRadius = 2000;
    for (int i = 0; i < kToOpAndFullRadius; ++i) cyclic();
  }
  CycleDecision step() noexcept {
    next_instant();
    move();
    const ethercat::ConstBytes frame = main_->next_frame();
    echo(frame);
    finish(frame.size());
    return decision_;
  }
  [[nodiscard]] bool valid() const noexcept {
    return main_->last_cycle().all_operational() && main_->last_cycle().inputs_valid &&
           decision_.state == CycleState::kLocked && path_.at_full();
  }

 protected:
  static constexpr std::size_t kDrives = 8;
  static constexpr Nanoseconds kCycle{1'000'000};

  static CycleServoConfig config() {
    CycleServoConfig result;
    result.law = law;
    result.cycles_per_sync = 100;
    return result;
  }
  void bring_up() {
    const auto objects = ethercat::csp_objects(kCycle);
    objects_.assign(objects.begin(), objects.end());
    ethercat::MainDeviceConfig config;
    config.process.objects = objects_;
    config.process.cycle = kCycle;
    config.process.sync0_shift = kCycle / 2;
    config.clocks.drift_pulses = 100;
    main_ = std::make_unique<ethercat::MainDevice>(config);
    segment_ = std::make_unique<ethercat::Segment>();
    for (std::size_t n = 0; n < kDrives; ++n) {
      crystals_[n].set_rate(Rate::from_ppm(kReferencePpm), {});
      static_cast<void>(segment_->add({}, {.parent = static_cast<int>(n) - 1}, crystals_[n]));
    }
    while (!main_->cyclic() && main_->stage() != ethercat::Stage::kStopped) {
      through_segment();
      now_ = now_ + Duration{Nanoseconds{20'000}};
    }
    decision_ = servo_.start(now_);
  }
  void cyclic() {
    next_instant();
    move();
    finish(through_segment());
  }
  std::size_t through_segment() {
    const ethercat::ConstBytes frame = main_->next_frame();
    std::copy(frame.begin(), frame.end(), buffer_.begin());
    const auto view = ethercat::FrameView::parse(bytes(frame.size()));
    if (view) segment_->pass(*view, ethercat::WireTime{now_.since_epoch()});
    if (!main_->cyclic()) static_cast<void>(main_->on_frame(bytes(frame.size()), {}));
    return frame.size();
  }
  void next_instant() noexcept {
    jitter_ = jitter_ * 1664525U + 1013904223U;
    now_ = decision_.wake + Duration::from_whole_ns(20'000 + (jitter_ >> 16));
  }
  void move() noexcept {
    path_.advance(all_enabled_, servo_.next_trigger().local.since_epoch().seconds());
    all_enabled_ = true;
    for (std::size_t n = 0; n < kDrives; ++n) {
      axes_[n]
          .cycle(ethercat::csp::Inputs::decode(main_->inputs(n)),
                 {.enable = true, .displacement = path_.displacement(n)})
          .encode(main_->outputs(n));
      all_enabled_ &= axes_[n].state() == ethercat::AxisState::kEnabled;
    }
  }
  void finish(std::size_t size) noexcept {
    static_cast<void>(main_->on_frame(bytes(size), {now_, now_}));
    CycleSample sample;
    sample.sent = now_;
    sample.has_reference = main_->last_cycle().has_reference;
    sample.reference = main_->last_cycle().reference;
    sample.has_received = true;
    sample.received = now_ + Duration{Nanoseconds{60'000}};
    decision_ = servo_.update(sample, sample.received);
  }
  /// What eight drives in OP would send back: system time, own inputs, states.
  void echo(ethercat::ConstBytes frame) noexcept {
    using enum ethercat::Command;
    std::copy(frame.begin(), frame.end(), buffer_.begin());
    const std::uint64_t reference =
        (*segment_)[0].dc().system_time(ethercat::WireTime{now_.since_epoch()});
    for (std::size_t at = ethercat::kFrameHeaderSize; at < frame.size();) {
      const std::size_t size =
          ethercat::load<std::uint16_t>(buffer_, at + 6) & ethercat::kLengthMask;
      const auto command = static_cast<ethercat::Command>(buffer_[at]);
      const auto offset = ethercat::load<std::uint16_t>(buffer_, at + 4);
      const bool states = offset == ethercat::reg::kAlStatus;
      std::uint64_t value = states ? 8 : 5;  // OP; |0x092C|
      std::size_t value_size = command == kFprd && states ? 6 : (states ? 2 : 4);
      unsigned counter = command == kBrd ? kDrives : 1;
      if (command == kFrmw) {
        value = reference;
        value_size = sizeof reference;
        counter = kDrives;
      } else if (command == kLrw || command == kFpwr) {
        value_size = 0;
        counter = command == kLrw ? 3 * kDrives : 1;
      }
      const std::size_t data = at + ethercat::kDatagramHeaderSize;
      for (std::size_t i = 0; i < value_size; ++i) {
        buffer_[data + i] = static_cast<std::uint8_t>(value >> (8 * i));
      }
      ethercat::store(buffer_, data + size, static_cast<std::uint16_t>(counter));
      at = data + size + ethercat::kWorkingCounterSize;
    }
  }
  [[nodiscard]] ethercat::Bytes bytes(std::size_t size) noexcept {
    return ethercat::Bytes{buffer_}.first(size);
  }

  static constexpr double kReferencePpm = 50.0;
  CycleServo servo_;
  std::vector<ethercat::SdoDownload> objects_;
  std::unique_ptr<ethercat::MainDevice> main_;
  std::unique_ptr<ethercat::Segment> segment_;
  std::array<ethercat::AffineOscillator, kDrives> crystals_;
  std::array<ethercat::CspAxis, kDrives> axes_;
  node::CirclePath path_{10'000.0, 2.0};
  bool all_enabled_ = false;
  std::array<std::uint8_t, ethercat::kMaxFrameSize> buffer_{};
  FreeRunningTime now_ = FreeRunningTime::from_ns(1'000'000);
  CycleDecision decision_;
  std::uint32_t jitter_ = 1;
};

/// The same with a bus clock that moves the drives onto plant time: what plant time costs a cycle
/// is the difference. Goal: at most 1 us.
class EthercatPlantTimeCase : EthercatCycleCase<CycleLaw::kAdaptive> {
 public:
  EthercatPlantTimeCase() {
    constexpr int kToTheLock = 20'000;
    for (int i = 0; i < kToTheLock; ++i) static_cast<void>(step());
  }
  std::int64_t step() noexcept {
    static_cast<void>(EthercatCycleCase::step());
    BusClockSample sample;
    sample.has_dc = sample.usable = main_->last_cycle().has_reference;
    // The echo hears of no offset; the bus obeys here.
    sample.dc =
        LocalTime{main_->last_cycle().reference.since_epoch()} + Duration::from_whole_ns(in_force_);
    sample.plant = ReferenceTime{now_.since_epoch()};
    sample.offset_ns = in_force_;
    in_force_ = bus_.decision().offset_ns;
    const std::int64_t wanted = bus_.update(sample).offset_ns;
    main_->shift_system_time(wanted - in_force_);
    return wanted;
  }
  [[nodiscard]] bool valid() const noexcept {
    return EthercatCycleCase::valid() && bus_.decision().known;
  }

 private:
  BusClock bus_{BusClockConfig{}};
  std::int64_t in_force_ = 0;
};

/// The echo alone.
class EthercatWireCase : EthercatCycleCase<CycleLaw::kNone> {
 public:
  std::uint8_t step() noexcept {
    now_ = now_ + Duration{kCycle};
    if (frame_.empty()) {
      const ethercat::ConstBytes frame = main_->next_frame();
      frame_.assign(frame.begin(), frame.end());
    }
    echo(frame_);
    return buffer_[frame_.size() - 1];
  }

 private:
  std::vector<std::uint8_t> frame_;
};

}  // namespace ftcs::bench
