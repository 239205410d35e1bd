// SPDX-License-Identifier: MIT
//
// Several servos on the samples that one running ptp4l reports to its slave_event_monitor, each on
// a virtual clock of its own, judged by the truth: transmitter and receiver stand on one machine
// and take software timestamps, so that the reference is CLOCK_REALTIME itself. The clocks start
// 100 us away on an oscillator that is 20 ppm fast; nobody may step.
//
// monitor_trial SOCKET SECONDS: one JSON object on standard output.
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "ftcs/analysis/statistics.h"
#include "ftcs/clock/skewed_source.h"
#include "ftcs/experiment/servo_trial.h"
#include "ftcs/platform/kernel.h"
#include "ftcs/platform/local_socket.h"
#include "ftcs/platform/timestamp_clock.h"
#include "ftcs/ptp/monitor_source.h"

namespace {

using namespace ftcs;
using platform::TimestampClock;

constexpr Duration kOffset{Nanoseconds{100'000}};
constexpr double kSkewPpb = 20'000.0;
constexpr double kLockBandNs = 20'000.0;

double drift_ns(const TimestampClock::RealtimeReading& a,
                const TimestampClock::RealtimeReading& b) {
  return static_cast<double>(b.realtime_ns - a.realtime_ns) -
         (b.free_running - a.free_running).ns();
}

class Trials {
 public:
  Trials(SkewedSource& source, const TimestampClock::RealtimeReading& start)
      : source_(source),
        truth_{Duration::from_whole_ns(start.realtime_ns) - start.free_running.since_epoch()} {
    VirtualClockConfig clock;
    clock.free_running = start.free_running;
    clock.local = LocalTime::from_ns(start.realtime_ns) + kOffset;
    for (const ServoKind kind : {ServoKind::kAdaptive, ServoKind::kFtcs, ServoKind::kLinuxptpPi}) {
      DisciplineConfig discipline;
      discipline.servo.kind = kind;
      discipline.servo.linuxptp_pi.first_step_threshold = Nanoseconds{0};
      trials_.push_back(std::make_unique<experiment::ServoTrial>(
          experiment::ServoTrial::Setup{std::string(servo_kind_name(kind)), discipline, clock,
                                        truth_},
          source));
    }
  }
  void on_pair(const EventPair& pair) {
    for (const auto& trial : trials_) trial->on_pair(pair);
    const Duration later = truth_.at(source_.to_underlying(pair.free_running)) - pair.reference;
    if (pair.direction == Direction::kForward) {
      ahead_ns_.push_back(later.ns());
    } else {
      back_ns_.push_back(-later.ns());
    }
  }
  void print(std::uint64_t syncs, double drift) const {
    const double asymmetry = ahead_ns_.empty() || back_ns_.empty()
                                 ? 0.0
                                 : (summarize(ahead_ns_).median - summarize(back_ns_).median) / 2.0;
    std::printf(
        "{\"syncs\": %llu, \"realtime_drift_ns\": %.1f, \"asymmetry_ns\": %.1f, \"servos\": [",
        static_cast<unsigned long long>(syncs), drift, asymmetry);
    for (std::size_t i = 0; i < trials_.size(); ++i) {
      const experiment::TrialResult result = trials_[i]->result(kLockBandNs);
      std::printf(
          "%s{\"servo\": \"%s\", \"locked\": %s, \"cycles_to_lock\": %lld, "
          "\"true_error_rms_ns\": %.1f, \"true_error_mean_ns\": %.1f, "
          "\"perceived_rms_ns\": %.1f, \"rejected\": %llu}",
          i == 0 ? "" : ", ", result.servo.c_str(), result.locked ? "true" : "false",
          result.cycles_to_lock ? static_cast<long long>(*result.cycles_to_lock) : -1LL,
          result.rms_second_half_ns, result.mean_second_half_ns, result.rms_perceived_offset_ns,
          static_cast<unsigned long long>(result.rejected));
    }
    std::printf("]}\n");
  }

 private:
  SkewedSource& source_;
  experiment::TrueReference truth_;
  std::vector<double> ahead_ns_;
  std::vector<double> back_ns_;
  std::vector<std::unique_ptr<experiment::ServoTrial>> trials_;
};

int run(const std::string& path, double seconds) {
  platform::LinuxKernel kernel;
  TimestampClock timestamps(kernel, platform::TimestampMode::kSoftware, std::nullopt);
  auto socket = platform::LocalSocket::bind(path);
  if (!socket) {
    std::fprintf(stderr, "monitor_trial: %s\n", socket.error().message().c_str());
    return 1;
  }
  const auto start = timestamps.read_realtime();
  SkewedSource source(timestamps.source(), Rate::from_ppb(kSkewPpb), start.free_running);
  Trials trials(source, start);
  ptp::MonitorSource reports;
  const FreeRunningTime end = timestamps.source().now() + Duration::from_ns(seconds * 1e9);
  while (timestamps.source().now() < end) {
    socket->wait(100);
    while (const auto datagram = socket->receive()) {
      const ptp::MonitorReport report = reports.on_datagram(datagram->bytes);
      for (const ptp::MonitorSample& sample : report.view()) {
        const auto stamp = timestamps.convert({sample.local_ns, 0});
        if (!stamp) continue;
        const auto event = reports.on_sample(sample, source.from_underlying(stamp->time));
        if (event) trials.on_pair(event->pair);
      }
    }
  }
  trials.print(reports.counters().syncs, drift_ns(start, timestamps.read_realtime()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: monitor_trial SOCKET SECONDS\n");
    return 2;
  }
  return run(argv[1], std::atof(argv[2]));
}
