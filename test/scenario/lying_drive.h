// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>

#include "ftcs/sim/cycle_host.h"

namespace ftcs::ethercat::test {

/// One thing that a drive answers otherwise than it should.
struct Lie {
  enum class Kind : std::uint8_t {
    kSilence,       ///< the frame does not come back
    kNobody,        ///< all working counters are zero
    kOneMore,       ///< all working counters are one too many
    kAlStatus,      ///< every AL status that is read
    kAllOnes,       ///< every octet of data
    kDifference,    ///< every 0x092C is large
    kMailboxEmpty,  ///< no answer in any mailbox, no request taken
  };
  static constexpr unsigned kForEver = 1'000'000;
  Kind kind = Kind::kSilence;
  std::uint16_t al_status = 0;
  std::uint16_t al_code = 0;
  unsigned first = 0;  ///< frame from which on
  unsigned count = 1;  ///< frames
};

/// A node on a host that is punctual, two modelled drives, and lies about what they answer. The
/// drives themselves go on truthfully behind the lies. Deadlines are short, so that all of them
/// can be waited for; 1 ms a frame.
class LyingDrive {
 public:
  static constexpr Nanoseconds kFrame{1'000'000};

  explicit LyingDrive(std::span<const Lie> lies, bool reference) : lies_(lies) {
    for (std::size_t n = 0; n < crystals_.size(); ++n) {
      const int parent = static_cast<int>(n) - 1;
      static_cast<void>(segment_->add({}, {.parent = parent}, crystals_[n]));
    }
    host_ = std::make_unique<sim::CycleHost>(config(), *segment_, WireTime::from_ns(1'000'000));
    liar_ = static_cast<std::uint16_t>(kFirstStation + (reference ? 0 : 1));
    host_->set_way_back([this](const FrameView& frame) { return come_back(frame); });
  }
  [[nodiscard]] static node::CycleNodeConfig config() {
    constexpr Nanoseconds kDeadline{20'000'000};
    node::CycleNodeConfig config;
    config.servo.law = CycleLaw::kAdaptive;
    config.main.clocks.drift_pulses = 1;
    config.main.sii_timeout = kDeadline;
    config.main.process.state_timeout = kDeadline;
    config.main.process.sdo_timeout = kDeadline;
    config.main.process.sync0_lead = Nanoseconds{30'000'000};
    config.main.bring_up_timeout = Nanoseconds{1'500'000'000};
    config.main.stop_timeout = kDeadline;
    config.axes.move = false;
    config.sync_error_limit = 0;
    config.supervision.first_recovery = 50;
    config.supervision.recovery_interval = 10;
    config.supervision.unlocked_limit = 200;
    config.supervision.op_limit = 500;
    return config;
  }

  /// Frame by frame until the cycles begin or it is over. Milliseconds that it took.
  unsigned bring_up() {
    unsigned frames = 0;
    while (!node().cyclic() && !node().stopped() && frames < 10'000) {
      host_->exchange();
      host_->wait(Duration{kFrame});
      ++frames;
    }
    if (node().cyclic()) host_->node().start(host_->shown_at(host_->now()));
    return frames;
  }
  /// So many cycles, or frames of the way down.
  void go_on(int count) {
    for (int i = 0; i < count && !node().stopped(); ++i) {
      if (node().cyclic()) {
        host_->cycle(Duration{});
      } else {
        host_->exchange();
        host_->wait(Duration{kFrame});
      }
    }
  }
  void stop() { host_->node().stop(); }

  [[nodiscard]] const node::CycleNode& node() const { return host_->node(); }
  [[nodiscard]] const Segment& segment() const { return *segment_; }
  [[nodiscard]] unsigned frames() const { return frame_; }
  [[nodiscard]] bool all_in_op() const {
    return node().main().last_cycle().all_operational() && node().main().complete();
  }
  /// The frame under way reads an AL status of the liar, or of all.
  [[nodiscard]] std::span<const bool> asked_for_state() const { return asked_; }

 private:
  bool come_back(const FrameView& frame) {
    const unsigned now = frame_++;
    if (now < asked_.size()) asked_[now] = asks_for_state(frame);
    for (const Lie& lie : lies_) {
      if (now < lie.first || now - lie.first >= lie.count) continue;
      if (lie.kind == Lie::Kind::kSilence) return false;
      for (const Datagram datagram : frame) tell(lie, datagram);
    }
    return true;
  }
  [[nodiscard]] bool from_liar(const Datagram& datagram) const {
    const Addressing how = addressing(datagram.command());
    if (how == Addressing::kConfigured) return datagram.position() == liar_;
    return how != Addressing::kNone;
  }
  [[nodiscard]] bool asks_for_state(const FrameView& frame) const {
    for (const Datagram datagram : frame) {
      if (is_state(datagram) && from_liar(datagram)) return true;
    }
    return false;
  }
  [[nodiscard]] static bool is_state(const Datagram& datagram) {
    const Command command = datagram.command();
    const bool reads = command == Command::kFprd || command == Command::kBrd;
    return reads && datagram.offset() == reg::kAlStatus;
  }
  void tell(const Lie& lie, const Datagram& datagram) const {
    using enum Lie::Kind;
    if (!from_liar(datagram)) return;
    const Bytes data = datagram.data();
    const bool counts = lie.kind == kNobody || lie.kind == kOneMore;
    if (lie.kind == kOneMore) datagram.add_to_working_counter(1);
    const bool mailbox = addressing(datagram.command()) == Addressing::kConfigured &&
                         datagram.offset() >= reg::kProcessRam;
    if (lie.kind == kNobody || (lie.kind == kMailboxEmpty && mailbox)) {
      datagram.add_to_working_counter(0x10000U - datagram.working_counter());
    }
    if (counts) return;
    if (lie.kind == kAllOnes) std::fill(data.begin(), data.end(), std::uint8_t{0xFF});
    if (lie.kind == kDifference && datagram.offset() == reg::kSystemTimeDifference) {
      store(data, 0, std::uint32_t{1'000'000});
    }
    if (lie.kind != kAlStatus || !is_state(datagram)) return;
    store(data, 0, lie.al_status);
    if (data.size() >= 6) store(data, 4, lie.al_code);
  }

  std::span<const Lie> lies_;
  std::array<AffineOscillator, 2> crystals_{AffineOscillator{Rate::from_ppm(30.0)},
                                            AffineOscillator{Rate::from_ppm(-20.0)}};
  std::unique_ptr<Segment> segment_ = std::make_unique<Segment>();
  std::unique_ptr<sim::CycleHost> host_;
  std::uint16_t liar_ = 0;
  unsigned frame_ = 0;
  std::array<bool, 2048> asked_{};
};

}  // namespace ftcs::ethercat::test
