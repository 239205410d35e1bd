// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ftcs/daemon/live_view.h"
#include "ftcs/daemon/ptp_core_port.h"
#include "ftcs/experiment/servo_trial.h"
#include "ftcs/platform/child_process.h"
#include "ftcs/ptp/time_receiver.h"

namespace ftcs::daemon {

struct DemoOptions {
  double duration_s = 20.0;
  std::int8_t log_sync_interval = -3;  ///< 125 ms
  double skew_ppb = 50'000.0;
  Duration offset{Nanoseconds{1'000'000}};
  double max_frequency_ppb = 100'000'000.0;  ///< ±100,000 ppm
  std::uint16_t event_port =
      0;  ///< 0: chosen from the process number, and the next one for general
  /// Listen there, on PTP's own ports, to a time transmitter that stamps with this machine's
  /// CLOCK_REALTIME, instead of starting one on loopback. Empty: an own one.
  std::string interface {};
  bool live_view = true;  ///< on a terminal only
  bool ptp = true;
  bool ethercat = true;
};

struct DemoResult {
  std::string timestamps;  ///< who took the stamps
  double sync_interval_ns = 0.0;
  double lock_band_ns = 0.0;   ///< common to all servos: 5 x 1.4826 x MAD of the link's t2 - t1
  double link_delay_ns = 0.0;  ///< median of t2 - t1 on the common oscillator
  /// Half the difference of the two ways' medians: the part of the true error that nobody can see.
  double asymmetry_ns = 0.0;
  std::uint64_t samples = 0;
  bool interrupted = false;  ///< stopped before its time was up
  std::vector<experiment::TrialResult> servos;
};

/// Time receiver of the demonstration: one protocol core, and every servo on its own virtual clock
/// behind it.
class DemoReceiver final : public PtpCorePort<ptp::TimeReceiver> {
 public:
  DemoReceiver(platform::Kernel& kernel, const PtpOptions& options, const DemoOptions& demo,
               Log& log, std::unique_ptr<platform::TimestampClock> timestamps,
               platform::ChildProcess* transmitter);  ///< null: somebody else's

  /// Meaningful after run().
  [[nodiscard]] DemoResult result() const;

 private:
  void act(const ptp::Action& action) override;
  void housekeeping(FreeRunningTime now) override;
  [[nodiscard]] int finish() override;

  void on_pair(const EventPair& pair);
  void draw();

  DemoOptions demo_;
  platform::ChildProcess* transmitter_;
  experiment::TrueReference truth_;
  std::vector<std::unique_ptr<experiment::ServoTrial>> trials_;
  // t2 - t1 of every Sync and t4 - t3 of every answered request, on the common oscillator.
  std::vector<double> one_way_ns_;
  std::vector<double> way_back_ns_;
  LiveView view_;
  bool interrupted_ = false;
};

}  // namespace ftcs::daemon
