// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "addend_world.h"
#include "ftcs_addend.h"

namespace ftcs::addend_test {

/// A node with a MAC whose stamps come from its steered clock, and a reference with Syncs: 2^32 *
/// 50/168, ticks of 20 ns, as an STM32F4 at 168 MHz.
class Plant {
 public:
  static constexpr std::uint32_t kNominal = 0x4C30C30C;
  static constexpr std::int64_t kTick = 20;
  static constexpr std::int64_t kEpoch = 1'700'000'000'000'000'000;

  Plant(std::int64_t interval_ns, double rate_ppb, std::int64_t offset_ns, double noise_ns,
        std::uint64_t seed = 0, std::uint32_t nominal = kNominal)
      : interval_(Fine{interval_ns} * kFineNs),
        rate_ppb_(rate_ppb),
        noise_(noise_ns),
        clock_(nominal, 0, Fine{kEpoch + offset_ns} * kFineNs),
        unaligned_(seed != 0),
        random_(seed + 1),
        moments_(seed) {}

  /// True offset at the present event of what the clock shows, local minus reference.
  [[nodiscard]] double true_offset_ns() const {
    return duration_of(Fine{shown(event_)} * kFineNs - reference()).ns();
  }
  /// An interval on; with a seed, up to a microsecond more: an interval that is a multiple of the
  /// tick shows every event at the same place within a tick, and hides what a tick does.
  void next(int intervals = 1) {
    Fine gap = interval_ * intervals;
    if (unaligned_)
      gap = gap + Fine{static_cast<std::int64_t>(moments_() % 1'000'000)} * (kFineNs / 1000);
    elapsed_ = elapsed_ + gap;
    const auto bent = static_cast<Fine>(duration_of(gap).ns() * rate_ppb_ * 1e-9 * 4294967296.0);
    event_ = event_ + gap + bent;  // the oscillator is fast by rate_ppb
  }
  void set_interval_ns(std::int64_t interval_ns) { interval_ = Fine{interval_ns} * kFineNs; }
  void set_rate_ppb(double ppb) { rate_ppb_ = ppb; }
  [[nodiscard]] double rate_ppb() const { return rate_ppb_; }

  [[nodiscard]] ftcs_addend_sample sample(std::int64_t latency_ns) {
    const Fine noise{static_cast<std::int64_t>(std::llround(gauss_(random_) * noise_))};
    const std::int64_t stamp = shown(event_ + noise * kFineNs);
    const std::int64_t now = whole(clock_.local_at(event_ + Fine{latency_ns} * kFineNs)) + 1;
    return {whole(reference()), stamp, now, 0, 0, 0};
  }
  void obey(const ftcs_addend_command& command, std::int64_t now_ns) {
    if (command.act == 0) return;
    const Fine at = clock_.free_at(Fine{now_ns} * kFineNs);
    if (command.step_ns != 0) clock_.step(at, Fine{command.step_ns} * kFineNs);
    clock_.write(at, command.addend);
    if (command.until_ns != INT64_MAX) {
      clock_.write_at_reading(Fine{command.until_ns} * kFineNs, command.next_addend);
    }
  }
  [[nodiscard]] AddendLine& clock() { return clock_; }
  [[nodiscard]] Fine event() const { return event_; }
  [[nodiscard]] Fine reference() const { return Fine{kEpoch} * kFineNs + elapsed_; }

 private:
  // The time moves on by whole ticks.
  [[nodiscard]] std::int64_t shown(Fine free) const {
    return whole(clock_.local_at(free)) / kTick * kTick;
  }
  static std::int64_t whole(Fine fine) { return static_cast<std::int64_t>(fine >> 32); }

  Fine interval_;
  double rate_ppb_;
  double noise_;
  AddendLine clock_;
  Fine event_ = 0;
  Fine elapsed_ = 0;
  bool unaligned_;
  std::mt19937_64 random_;
  std::mt19937_64 moments_;
  std::normal_distribution<double> gauss_{0.0, 1.0};
};

}  // namespace ftcs::addend_test
