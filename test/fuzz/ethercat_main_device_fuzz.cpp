// SPDX-License-Identifier: MIT
//
// A MainDevice, its cycle and its rules against a segment that lies: of each frame that comes back
// the input may change octets, working counters and AL states, lose it, send an old or a foreign
// one instead, or let the host be late. Then the segment is honest again. The bring-up has its
// deadline, the way down ends, every failure has a name, and nothing is read or written where it
// should not be (sanitizers).
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>

#include "ftcs/node/cycle_node.h"
#include "ftcs/sim/drives/segment.h"
#include "ftcs/time/relabel.h"
#include "test/fuzz/require.h"

namespace {

using namespace ftcs;
using namespace ftcs::ethercat;
using ftcs::fuzz::require;

constexpr Nanoseconds kFrame{1'000'000};
constexpr unsigned kMostFrames = 4'000;  ///< of a bring-up: its deadline is 1.5 s

/// The input, octet by octet; zeros behind its end.
class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::uint8_t next() { return at_ < size_ ? data_[at_++] : std::uint8_t{0}; }
  unsigned next16() {
    const unsigned low = next();
    return low | static_cast<unsigned>(next()) << 8U;
  }
  [[nodiscard]] bool ended() const { return at_ >= size_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

class OtherSegment final : public OtherSide {
 public:
  std::optional<std::uint64_t> system_time(WireTime instant) noexcept override {
    return static_cast<std::uint64_t>(instant.since_epoch().floor_ns()) + 1'000'000'000'000U;
  }
};

class World {
 public:
  explicit World(Script script) : script_(script) {
    const unsigned kind = script_.next();
    honest_first_ = script_.next16() % 400;
    for (std::size_t n = 0; n < 2; ++n) {
      SubDeviceConfig config;
      if (n == 1 && (kind & 1U) != 0) {
        config.identity = kBridgeIdentity;
        config.other_side = &other_;
      }
      require(segment_->add(config, {.parent = static_cast<int>(n) - 1}, crystal_).ok(), "a line");
    }
    node_ = std::make_unique<node::CycleNode>(config_of(kind));
  }

  void live() {
    unsigned frames = 0;
    while (!node_->cyclic() && !node_->stopped()) {
      exchange(node_->next_frame());
      require(++frames < kMostFrames, "a bring-up ends");
    }
    if (node_->cyclic()) node_->start(host_now());
    for (unsigned i = 0; node_->cyclic() && (i < 60 || !script_.ended()); ++i) cycle();
    node_->stop();
    for (frames = 0; !node_->stopped(); ++frames) {
      exchange(node_->next_frame());
      require(frames < 200, "the way down ends");
    }
    judge();
  }

 private:
  static node::CycleNodeConfig config_of(unsigned kind) {
    constexpr Nanoseconds kDeadline{20'000'000};
    node::CycleNodeConfig config;
    config.servo.law = (kind & 2U) != 0 ? CycleLaw::kFtcs : CycleLaw::kAdaptive;
    config.main.clocks.drift_pulses = 1;
    config.main.sii_timeout = config.main.stop_timeout = kDeadline;
    config.main.process.state_timeout = config.main.process.sdo_timeout = kDeadline;
    config.main.process.bridge_timeout = kDeadline;
    config.main.process.sync0_lead = Nanoseconds{30'000'000};
    config.main.bring_up_timeout = Nanoseconds{1'500'000'000};
    config.main.take_over = (kind & 4U) != 0;
    if ((kind & 1U) != 0) config.main.process.bridge = bridge::kFirst;
    if ((kind & 8U) != 0) config.bus_mode = node::BusMode::kExternal;
    if ((kind & 16U) != 0) config.bus_mode = node::BusMode::kLead;
    config.sync_error_limit = 0;
    return config;
  }
  [[nodiscard]] FreeRunningTime host_now() const { return relabel<FreeRunningTime>(now_); }

  void cycle() {
    const WireTime wake = relabel<WireTime>(node_->decision().wake);
    now_ = std::max(now_, std::min(wake, now_ + Duration{Nanoseconds{10'000'000}}));
    const bool answered = exchange(node_->begin_cycle(host_now()));
    node_->end_cycle(answered, stamps_, host_now());
  }

  bool exchange(ConstBytes frame) {
    stamps_.sent = stamps_.received = host_now();
    stamps_.has_system_time = true;
    stamps_.system_time = relabel<ReferenceTime>(now_);
    bool answered = false;
    if (!frame.empty()) {
      require(frame.size() <= buffer_.size(), "a frame is no longer than the wire takes");
      std::copy(frame.begin(), frame.end(), buffer_.begin());
      size_ = frame.size();
      const auto view = FrameView::parse(Bytes{buffer_}.first(size_));
      require(view.ok(), "what is sent is a frame");
      static_cast<void>(segment_->pass(*view, now_));
      answered = come_back();
    }
    now_ = now_ + Duration{kFrame};
    if (!answered) node_->on_timeout();
    return answered;
  }

  bool come_back() {
    const bool lies = ++frame_ > honest_first_ && !script_.ended();
    const unsigned what = lies ? script_.next() : 0;
    if (what == kLost) return false;
    if (what == kLate)
      now_ = now_ + Duration::from_whole_ns(std::int64_t{script_.next()} * 200'000);
    std::array<std::uint8_t, kMaxFrameSize> back = what == kOld ? old_ : buffer_;
    Bytes bytes = Bytes{back}.first(what == kOld ? old_size_ : size_);
    old_ = buffer_;
    old_size_ = size_;
    if (what == kCut) bytes = bytes.first(script_.next16() % (bytes.size() + 1));
    if (what >= kChanged && what < kLate) tell_lies(bytes, what - kChanged);
    stamps_.received = host_now();
    return node_->on_frame(bytes, stamps_) != FrameOutcome::kIgnored;
  }

  /// One of the datagrams: another counter, another state, or octets changed.
  void tell_lies(Bytes back, unsigned what) {
    const auto view = FrameView::parse(back);
    if (!view) return;
    const std::size_t wanted = what % 8;
    std::size_t n = 0;
    for (const Datagram datagram : *view) {
      if (n++ != wanted % view->count()) continue;
      const Bytes data = datagram.data();
      const unsigned kind = (what / 8) % 4;
      if (kind == 0) datagram.add_to_working_counter(script_.next16());
      if (kind == 1 && !data.empty()) data[script_.next16() % data.size()] = script_.next();
      if (kind == 2) std::fill(data.begin(), data.end(), script_.next());
      if (kind == 3) std::generate(data.begin(), data.end(), [this] { return script_.next(); });
    }
  }

  void judge() {
    const Failure& failure = node_->main().failure();
    require(std::strcmp(name(failure.kind), "unknown failure") != 0, "a failure has a name");
    const Network& network = node_->main().network();
    require(network.count <= kMaxSubDevices, "no more SubDevices than there is room for");
    for (const SubDeviceInfo& device : network.all()) {
      require(std::memchr(device.sii.device_name.data(), 0, SiiContent::kMaxName) != nullptr,
              "a name has an end");
    }
  }

  /// What an octet of the script says of a frame; below kChanged: nothing.
  static constexpr unsigned kChanged = 0x80;
  static constexpr unsigned kLate = 0xFC;
  static constexpr unsigned kCut = 0xFD;
  static constexpr unsigned kOld = 0xFE;
  static constexpr unsigned kLost = 0xFF;

  Script script_;
  unsigned honest_first_ = 0;
  OtherSegment other_;
  AffineOscillator crystal_{Rate::from_ppm(20.0)};
  std::unique_ptr<Segment> segment_ = std::make_unique<Segment>();
  std::unique_ptr<node::CycleNode> node_;
  WireTime now_ = WireTime::from_ns(1'000'000);
  FrameStamps stamps_;
  unsigned frame_ = 0;
  std::array<std::uint8_t, kMaxFrameSize> buffer_{};
  std::array<std::uint8_t, kMaxFrameSize> old_{};
  std::size_t size_ = 0;
  std::size_t old_size_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kLongest = 4096;
  World(Script(data, std::min(size, kLongest))).live();
  return 0;
}
