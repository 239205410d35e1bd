// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "ftcs/sim/drives/esc_memory.h"
#include "ftcs/sim/drives/oscillator.h"

namespace ftcs::ethercat {

struct DcUnitConfig {
  /// Granularity of the local clock: 100 MHz in controllers of today. Above zero.
  Nanoseconds tick{10};
  /// What the local clock shows at power on; non-zero to bring the 32-bit wrap near.
  Nanoseconds initial_local{};
  /// Bit 31 of 0x092C is documented both ways: true = set when the local copy is ahead.
  bool sign_bit_means_ahead = true;
};

struct Sync0Event {
  std::uint64_t system_time = 0;  ///< when it was due, local copy of system time
  Duration oscillator{};          ///< the same instant on the crystal
};

/// The distributed clock of a SubDevice: local time, its copy of the system time, the control loop
/// that lets the copy follow the reference (0x0910 to 0x0935) and the generator of SYNC0
/// (0x0980 to 0x09A0). Clauses: ETG.1000.4, 7.
///
///   local  += crystal * (1 + d / (5 (s + d + 2) (s - d + 2)))     s = 0x0930, d = 0x0932
///   system  = local + offset (0x0920)
///   error   = system - delay (0x0928) - received, at the start of frame; its mean is 0x092C
///
/// The formula of the rate is the register's: every s + d + 2 ticks of 10 ns one nanosecond is
/// added and every s - d + 2 ticks one is left out. How a controller moves d is not published; here
/// a proportional-integral loop per frame with the filter depths of 0x0934 and 0x0935 does, scaled
/// by 0x1000 / s, so that the rate holds between frames and the loop is stable at any frame rate.
class DcUnit {
 public:
  DcUnit(EscMemory& memory, LocalOscillator& oscillator, const DcUnitConfig& config) noexcept
      : memory_(memory), oscillator_(oscillator), config_(config) {}

  /// All registers at their reset values; the local clock starts.
  void power_on(WireTime now) noexcept;

  [[nodiscard]] Duration local_time(WireTime instant) const noexcept;
  /// Local copy of system time, as the application sees it (delay not subtracted).
  [[nodiscard]] std::uint64_t system_time(WireTime instant) const noexcept;

  /// Puts into the registers what a read in the frame that starts at `sof` shall see.
  void refresh(WireTime sof) noexcept;
  /// A write to 0x0900 latches: the processing unit and port 0 at once, the others as the frame
  /// comes back.
  void latch_arrival(WireTime sof) noexcept;
  void latch_return(unsigned port, WireTime sof) noexcept;
  /// A system time came by (0x0910): one step of the control loop. 4 bytes compare modulo 2^32.
  void synchronise(WireTime sof, ConstBytes received) noexcept;
  /// 0x0930 was written: 0x092C and 0x0932 start over.
  void reset_loop() noexcept;
  /// 0x0981 was written.
  void activate(WireTime now) noexcept;

  [[nodiscard]] bool sync0_armed() const noexcept { return armed_; }
  /// True if a SYNC0 was due until `now`; then the next one is armed.
  [[nodiscard]] bool take_sync0(WireTime now, Sync0Event& event) noexcept;
  /// Gives up SYNC0 events of a long silence: only the next one after `now` stays.
  void skip_sync0(WireTime now) noexcept;

 private:
  /// The next SYNC1; zero: none is generated.
  [[nodiscard]] std::uint64_t next_sync1(WireTime now) const noexcept;
  [[nodiscard]] Duration ticks(WireTime instant) const noexcept;
  [[nodiscard]] std::uint64_t offset() const noexcept {
    return memory_.get<std::uint64_t>(reg::kSystemTimeOffset);
  }
  [[nodiscard]] std::int64_t error_against(std::uint64_t own, ConstBytes received) const noexcept;
  void filter(double error_ns) noexcept;
  void steer(Duration since_last) noexcept;
  void set_speed(Duration crystal, double deviation) noexcept;

  EscMemory& memory_;
  LocalOscillator& oscillator_;
  DcUnitConfig config_;

  Duration base_crystal_{};  ///< where the present rate began
  Duration base_local_{};
  Rate rate_;

  double mean_error_ns_ = 0.0;
  double integral_ = 0.0;  ///< learnt rate, dimensionless
  std::uint32_t samples_ = 0;
  Duration last_sample_{};

  bool armed_ = false;
  std::uint64_t next_sync0_ = 0;
  std::uint64_t first_sync0_ = 0;
};

}  // namespace ftcs::ethercat
