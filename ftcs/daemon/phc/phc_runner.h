// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "ftcs/daemon/log.h"
#include "ftcs/daemon/phc/clock_comparison.h"
#include "ftcs/daemon/phc/phc_options.h"
#include "ftcs/daemon/phc/port_watch.h"
#include "ftcs/daemon/phc/reading_messages.h"
#include "ftcs/daemon/real_clock.h"
#include "ftcs/daemon/run_summary.h"
#include "ftcs/daemon/service_report.h"
#include "ftcs/daemon/watch/watch.h"
#include "ftcs/diagnosis/finding.h"
#include "ftcs/node/clock_follower.h"
#include "ftcs/platform/clock_device.h"

namespace ftcs::daemon {

/// "CLOCK_REALTIME", "/dev/ptp0", or the hardware clock of a network interface.
[[nodiscard]] Result<platform::ClockDevice, platform::OsError> open_clock(
    platform::Kernel& kernel, const std::string& name, platform::ClockAccess access);

/// One clock of the kernel that follows another of the same machine.
///
/// The reading before the source was latched and the one after it bound the instant from both
/// sides: its middle is a message without delay, and what a reading took longer than usual is
/// delay, as a packet's. So a slow reading counts for less by itself, and for nothing as an
/// outlier.
class PhcRunner {
 public:
  /// Opens what the options name. The error is one line for the user; no clock has been touched.
  [[nodiscard]] static Result<std::unique_ptr<PhcRunner>, std::string> open(
      platform::Kernel& kernel, const PhcOptions& options, Log& log);

  /// From now on it steers only while that PTP port is synchronised (`pairing`: while that is what
  /// it asks for, and the run ends when it asks for another), and takes UTC from it. Before run().
  void follow_port(PortWatch watch, const std::optional<Pairing>& pairing);
  /// Until SIGINT, SIGTERM, the configured duration or an error; returns an exit code.
  [[nodiscard]] int run();
  /// After a run that ended because the port asks for another pairing; otherwise no value.
  [[nodiscard]] std::optional<PortWatch> take_moved_port();
  [[nodiscard]] bool has_steered() const { return discipline().counters().commands > 0; }

 private:
  struct Clocks {
    platform::ClockDevice source;
    std::unique_ptr<RealClock> sink;
    ClockComparison comparison;
    platform::Descriptor pair;
  };
  PhcRunner(platform::Kernel& kernel, const PhcOptions& options, Log& log, Clocks clocks);

  void wait();
  [[nodiscard]] diagnosis::Finding finding(bool follows) const;
  void publish(std::int64_t raw_ns, bool follows);
  void follow_scale_change();
  [[nodiscard]] bool may_follow();
  [[nodiscard]] bool port_is_usable() const;
  void set_scale();
  void schedule_next();
  [[nodiscard]] const ClockDiscipline& discipline() const { return follower_.discipline(); }
  void on_silence();
  void take_notes();
  void take_sample();
  void report(Duration offset, std::int64_t delay_ns, bool stepped);
  void fail(const std::string& reason);
  [[nodiscard]] int finish();

  platform::Kernel& kernel_;
  PhcOptions options_;
  Log& log_;
  platform::ClockDevice source_;
  std::unique_ptr<RealClock> sink_;
  ClockComparison comparison_;
  platform::Descriptor pair_;  // held, so that the two do not follow each other
  ReadingMessages messages_;
  Duration half_width_{};  ///< of the last comparison: what an asymmetry of it may hide
  node::ClockFollower follower_;
  std::optional<PortWatch> watch_;
  std::optional<Pairing> pairing_;
  bool port_moved_ = false;
  bool following_ = true;
  std::uint64_t scales_heard_ = 0;
  RunSummary summary_;
  std::int64_t next_raw_ns_ = 0;
  std::int64_t start_ns_ = 0;
  std::int64_t next_state_ns_ = 0;
  std::unique_ptr<Watch> observers_;  ///< null: nobody watches
  bool reading_failed_ = false;
  std::optional<std::string> failure_;
  ServiceReport service_{};
};

/// Everything that `ftcs phc` does once its options are known to be consistent.
[[nodiscard]] int run_phc(platform::Kernel& kernel, const PhcOptions& options, Log& log);

}  // namespace ftcs::daemon
