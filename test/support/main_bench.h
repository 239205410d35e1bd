// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "ftcs/ethercat/maindevice/csp_profile.h"
#include "ftcs/ethercat/maindevice/main_device.h"
#include "ftcs/time/relabel.h"
#include "test/support/wire_bench.h"

namespace ftcs::ethercat::test {

/// A MainDevice and a segment in simulated time. The MainDevice's clock shows the time of the wire;
/// a bring-up frame is answered 20 us after it went out.
class MainBench : public WireBench {
 public:
  explicit MainBench(MainDeviceConfig config = {}) { configure(config); }
  void configure(const MainDeviceConfig& config) { main_ = std::make_unique<MainDevice>(config); }
  [[nodiscard]] MainDevice& main() { return *main_; }

  /// Sends one frame now; false if it was lost. `lose` decides about each frame by its number.
  bool exchange_once() { return exchange_once(*main_); }
  /// The same of another MainDevice on this wire.
  bool exchange_once(MainDevice& main) {
    const ConstBytes frame = main.next_frame();
    if (frame.empty()) return false;
    std::array<std::uint8_t, kMaxFrameSize> buffer{};
    std::copy(frame.begin(), frame.end(), buffer.begin());
    if (capture) capture(now_of_master(), ConstBytes{buffer}.first(frame.size()));
    const bool lost = lose && lose(sent_++);
    const auto view = FrameView::parse(Bytes{buffer}.first(frame.size()));
    EXPECT_TRUE(view);
    const auto passage = lost ? Segment::Passage{} : segment().pass(*view, now());
    if (!passage.returned) {
      main.on_timeout();
      return false;
    }
    if (tamper) tamper(*view);
    if (capture) capture(now_of_master(), ConstBytes{buffer}.first(frame.size()));
    FrameStamps stamps{now_of_master(), relabel<FreeRunningTime>(passage.at)};
    stamps.has_system_time = plant_time;
    stamps.system_time = relabel<ReferenceTime>(stamps.sent);
    main.on_frame(Bytes{buffer}.first(frame.size()), stamps);
    return true;
  }
  /// Until the cyclic stage or the end.
  void bring_up() {
    for (int i = 0; i < 2'000'000 && !main_->cyclic() && main_->stage() != Stage::kStopped; ++i) {
      exchange_once();
      wait(Nanoseconds{20'000});
    }
  }
  /// n cycles of the given length.
  void run(int n, Nanoseconds cycle = Nanoseconds{1'000'000}) {
    for (int i = 0; i < n; ++i) {
      exchange_once();
      wait(cycle);
    }
  }
  [[nodiscard]] FreeRunningTime now_of_master() const { return relabel<FreeRunningTime>(now()); }

  bool plant_time = false;  ///< the drives are to be put onto it
  std::function<bool(std::size_t)> lose;
  std::function<void(FreeRunningTime, ConstBytes)> capture;
  std::function<void(const FrameView&)> tamper;  ///< changes what comes back

 private:
  std::unique_ptr<MainDevice> main_;
  std::size_t sent_ = 0;
};

}  // namespace ftcs::ethercat::test
