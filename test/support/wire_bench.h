// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/sim/drives/segment.h"

namespace ftcs::ethercat::test {

/// A segment, its crystals and simulated time; sends single datagrams as a test asks for them.
class WireBench {
 public:
  std::size_t add(const Wiring& wiring, double ppm = 0.0, const SubDeviceConfig& config = {}) {
    crystals_.emplace_back(Rate::from_ppm(ppm));
    const auto number = segment_->add(config, wiring, crystals_.back());
    EXPECT_TRUE(number);
    return number ? *number : 0;
  }
  /// A line of n SubDevices, all wires alike.
  void add_line(std::size_t n, Nanoseconds cable = Nanoseconds{0}) {
    for (std::size_t i = 0; i < n; ++i) {
      add({.parent = static_cast<int>(i) - 1, .parent_port = 1, .cable = cable});
    }
  }

  struct Reply {
    std::uint16_t working_counter = 0;
    std::uint16_t position = 0;
    std::uint16_t event = 0;
    std::vector<std::uint8_t> data;
    template <std::unsigned_integral T>
    [[nodiscard]] T value() const {
      return load<T>(data, 0);
    }
  };
  Reply exchange(const Target& target, std::vector<std::uint8_t> data) {
    std::array<std::uint8_t, kMaxFrameSize> buffer{};
    FrameWriter writer(buffer, 1);
    writer.add(target, ConstBytes{data});
    EXPECT_TRUE(writer.finish());
    const auto view = FrameView::parse(buffer);
    returned_ = segment_->pass(*view, now_).at;
    now_ = now_ + step_;
    const Datagram datagram = (*view)[0];
    data.assign(datagram.data().begin(), datagram.data().end());
    return {datagram.working_counter(), datagram.position(), datagram.event(), data};
  }
  Reply read(const Target& target, std::size_t size) {
    return exchange(target, std::vector<std::uint8_t>(size));
  }
  template <std::unsigned_integral T>
  Reply write(const Target& target, T value) {
    std::vector<std::uint8_t> data(sizeof(T));
    store(data, 0, value);
    return exchange(target, data);
  }

  [[nodiscard]] Segment& segment() { return *segment_; }
  [[nodiscard]] AffineOscillator& crystal(std::size_t n) { return crystals_[n]; }
  [[nodiscard]] WireTime now() const { return now_; }
  [[nodiscard]] WireTime returned() const { return returned_; }
  void wait(Nanoseconds time) { now_ = now_ + time; }
  void set_step(Nanoseconds step) { step_ = step; }

 private:
  std::unique_ptr<Segment> segment_ = std::make_unique<Segment>();
  std::deque<AffineOscillator> crystals_;
  WireTime now_ = WireTime::from_ns(1'000'000);
  WireTime returned_;
  Nanoseconds step_{100'000};
};

}  // namespace ftcs::ethercat::test
