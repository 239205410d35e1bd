// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/ethercat_demo.h"

#include <fmt/format.h>

#include "ftcs/fieldbus/cycle_laws.h"
#include "ftcs/fieldbus/run_html.h"
#include "ftcs/fieldbus/run_report.h"
#include "ftcs/platform/stop_flag.h"
#include "ftcs/report/cycle_report.h"
#include "ftcs/report/json.h"

namespace ftcs::daemon {

namespace {

constexpr std::size_t kDrives = 8;
/// Below the MainDevice's: the segment is hardware elsewhere, and answers when it is asked.
constexpr int kSegmentPriority = 70;
/// A shared machine without SCHED_FIFO wakes its tasks late; 2 ms leave the drives their outputs.
constexpr Nanoseconds kCycle{2'000'000};
constexpr std::uint32_t kCyclesPerSync = 250;  // 500 ms
/// Stamps are the kernel's at both ends, so that a late or slow frame still tells the phase.
constexpr Nanoseconds kGate{500'000};
/// The segment is a thread of a shared machine, which may stand still for a while.
constexpr std::uint32_t kLostFrames = 250;
/// Some hundreds let the clocks converge; the rest happens while the cycle runs.
constexpr std::uint32_t kDriftPulses = 3000;

/// Two machines, as `ftcs paper --section 5` has them, for some seconds of processor time.
experiment::TwoMachinesWorld brief_world() {
  experiment::TwoMachinesWorld world;
  world.settling_s = 20.0;
  world.measured_s = 2.0;
  return world;
}

RunOptions run_options(const EthercatDemoOptions& demo, std::uint16_t port) {
  RunOptions options;
  options.port = port;
  options.drives = kDrives;
  options.servo.cycle = kCycle;
  options.servo.cycles_per_sync = kCyclesPerSync;
  options.servo.largest_lateness = options.servo.largest_round_trip = kGate;
  options.drift_pulses = kDriftPulses;
  options.duration_s = demo.seconds_per_servo;
  options.lost_frame_limit = kLostFrames;
  options.quiet = !demo.live_view;
  options.trace = true;
  return options;
}

}  // namespace

std::vector<const MainRunner*> EthercatDemo::views() const {
  std::vector<const MainRunner*> result;
  for (const auto& run : runs) result.push_back(run.get());
  return result;
}

std::unique_ptr<EthercatDemo> run_ethercat_demo(platform::Kernel& kernel,
                                                const EthercatDemoOptions& options) {
  auto demo = std::make_unique<EthercatDemo>();
  SegmentOptions segment;
  segment.drives = kDrives;
  auto started = LocalSegment::start(kernel, segment, kSegmentPriority);
  if (!started) {
    fmt::print(stderr, "ftcs demo: {}\n", started.error().message());
    return nullptr;
  }
  demo->segment = std::move(*started);
  const platform::StopFlag stop_flag;
  const auto stop = [&stop_flag] { return stop_flag.is_set(); };
  for (const char* servo : {"ftcs", "adaptive", "pics", "soem-pi"}) {
    if (stop()) break;
    RunOptions run = run_options(options, demo->segment->port());
    set_cycle_law(run, servo);
    auto link = platform::EthercatLink::connect_udp(kernel, run.host, run.port);
    if (!link) {
      fmt::print(stderr, "ftcs demo: {}\n", link.error().message());
      return nullptr;
    }
    if (demo->runs.empty()) demo->setup = platform::make_realtime(run.priority, run.cpu);
    if (!run.quiet) fmt::print("\nEtherCAT, eight drives, servo {}\n", servo);
    auto runner = std::make_unique<MainRunner>(run, std::move(*link));
    if (!runner->bring_up(stop, false)) {
      if (stop()) break;
      fmt::print(stderr, "ftcs demo: EtherCAT: {}\n", describe(runner->main().failure()));
      return nullptr;
    }
    runner->run(stop);
    demo->runs.push_back(std::move(runner));
  }
  platform::leave_realtime();
  demo->segment->stop();
  if (!stop()) demo->machines = experiment::run_two_machines_table(brief_world(), 1, {});
  return demo;
}

std::string ethercat_demo_text(const EthercatDemo& demo) {
  const auto got = [](bool obtained) { return obtained ? "obtained" : "refused"; };
  return fmt::format(
             "\nEtherCAT over UDP on loopback: {} servo drives (reference clock +50 ppm, the "
             "others "
             "±80 ppm), distributed\nclocks with SYNC0, cycle {} ms, CiA 402 axes on circles; the "
             "host's cycle follows the drives' clock.\n"
             "SCHED_FIFO {}, mlockall {}. Phase and frame: |error| against SYNC0's grid, lateness "
             "of the sender off and on; excluded: later or slower than {} us. Locked: 20 cycles "
             "within "
             "5 us.\n\n",
             kDrives, static_cast<double>(kCycle.count()) * 1e-6, got(demo.setup.priority_set),
             got(demo.setup.memory_locked), kGate.count() / 1000) +
         runs_table(demo.views()).to_text() +
         "PICS with gains (1, 1) is deadbeat and equals FTCS with p = 1; it has to know its "
         "interval. soem-pi: SOEM's\npublished PI law, which takes the frame's time for the "
         "cycle's.\n" +
         (demo.machines.rows.empty() ? ""
                                     : "\nTwo machines, one time (simulated)\n\n" +
                                           two_machines_table(demo.machines).to_text() +
                                           two_machines_method(demo.machines) + "\n");
}

Json ethercat_demo_json(const EthercatDemo& demo) {
  Json rows = Json::array();
  for (const auto& run : demo.runs) rows.push_back(run_json(*run));
  return rows;
}

}  // namespace ftcs::daemon
