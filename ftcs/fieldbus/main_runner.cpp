// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/main_runner.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "ftcs/fieldbus/run_report.h"

namespace ftcs::daemon {

namespace {

/// A frame of the bring-up that is not back by then is lost.
constexpr Nanoseconds kReplyTimeout{5'000'000};
/// A segment in software may have to wait for its processor: half a second until nobody answers.
constexpr std::uint32_t kRetries = 100;
/// The part of a cycle in which its frame must be back.
constexpr double kReplyShare = 0.8;
/// Live lines on the terminal.
constexpr Nanoseconds kLineInterval{1'000'000'000};

/// Longer than another MainDevice waits for the answer of a drive without writing anything.
constexpr Nanoseconds kListening{100'000'000};
/// From the request to all drives in OP; a busy host may make them fault some times before.
constexpr double kOpPatienceS = 30.0;
/// Without --await-lock so long is waited for plant time.
constexpr double kPatienceS = 30.0;
Nanoseconds plant_time_patience(const RunOptions& options) {
  const double patience_s = options.await_lock_s > 0.0 ? options.await_lock_s : kPatienceS;
  return Nanoseconds{static_cast<std::int64_t>(patience_s * 1e9)};
}

}  // namespace

node::CycleNodeConfig node_config(const RunOptions& options, bool scan_only) {
  node::CycleNodeConfig config;
  const double cycle_s = static_cast<double>(options.servo.cycle.count()) * 1e-9;
  const auto cycles = [cycle_s](double seconds) {
    return static_cast<std::uint64_t>(seconds / cycle_s);
  };
  config.main.expected_subdevices = options.drives;
  config.main.take_over = options.take_over;
  config.main.listening = kListening;
  config.main.retries = kRetries;
  config.main.lost_frame_limit = options.lost_frame_limit;
  config.main.scan_only = scan_only;
  config.main.clocks.drift_pulses = scan_only ? 0 : options.drift_pulses;
  config.main.absence_limit = std::max(config.main.absence_limit,
                                       static_cast<std::uint32_t>(cycles(options.ride_through_s)));
  config.main.process.bridge = options.bridge;
  config.main.process.bridge_timeout = plant_time_patience(options);
  config.main.bring_up_timeout += config.main.process.bridge_timeout;
  config.servo = options.servo;
  config.sync0_phase = options.sync0_phase;
  config.sync_error_limit = static_cast<std::uint16_t>(options.sync_error_limit);
  config.supervision.lock_policy = options.lock_policy;
  config.supervision.unlocked_limit = cycles(options.unlocked_limit_s);
  config.supervision.await_limit = cycles(options.await_lock_s);
  config.supervision.op_limit = cycles(kOpPatienceS);
  config.axes.move = options.move;
  config.axes.radius = options.radius;
  config.axes.turn_s = options.turn_s;
  config.axes.fault_resets = options.fault_resets;
  config.axes.start_s = options.start_s;
  config.drive_sync = options.drive_sync;
  config.difference_limit = options.difference_limit;
  config.bus_mode = options.bus_mode;
  config.bus_write = options.bus_write;
  config.bus.limits = RateLimits::symmetric_ppb(1e3 * options.bus_limit_ppm);
  config.bus.largest_slope_ppb_per_s = 1e3 * options.bus_slope_ppm_s;
  return config;
}

MainRunner::MainRunner(const RunOptions& options, platform::EthercatLink link)
    : options_(options),
      link_(std::move(link)),
      node_(std::make_unique<node::CycleNode>(node_config(options, false))),
      watch_({options.duration_s, options.trace, options.contour}),
      observer_(options) {}

bool MainRunner::transfer(ethercat::ConstBytes frame, FreeRunningTime deadline) {
  stamps_.sent = stamps_.received = now();
  if (frame.empty()) return false;
  const int error = link_.send(frame);
  // Plant time of the first reading: the stamp of the card comes later, and is some microseconds
  // off.
  const auto plant = plant_ ? plant_->at(stamps_.sent) : std::nullopt;
  const FreeRunningTime read = stamps_.sent;
  stamps_.has_system_time = plant.has_value();
  stamps_.system_time = plant.value_or(ReferenceTime{});
  bool answered = false;
  while (error == 0 && !answered) {
    const auto back = link_.receive(deadline, false);
    if (!back) break;
    stamps_.received = back->stamp;
    answered = node_->on_frame(back->frame, stamps_) != ethercat::FrameOutcome::kIgnored;
  }
  if (const auto stamp = link_.transmit_stamp()) stamps_.sent = *stamp;
  stamps_.system_time = stamps_.system_time + (stamps_.sent - read);
  return answered;
}

void MainRunner::exchange() {
  const ethercat::ConstBytes frame = node_->next_frame();
  if (!transfer(frame, now() + Duration{kReplyTimeout})) node_->on_timeout();
}

std::optional<std::string> MainRunner::await_plant_time(const std::function<bool()>& stop) {
  constexpr Nanoseconds kLook{10'000'000};
  const Duration patience{plant_time_patience(options_)};
  const FreeRunningTime start = now();
  while (plant_ && !plant_->at(now())) {
    if (stop()) return "stopped by a signal before plant time was known";
    if (now() - start > patience) {
      const std::string reason = plant_->reason();
      return fmt::format("--plant-time {}: not known after {:g} s{}{}", plant_->name(),
                         patience.seconds(), reason.empty() ? "" : ": ", reason);
    }
    link_.clock().wait_until(now() + Duration{kLook}, Nanoseconds{0});
  }
  return std::nullopt;
}

bool MainRunner::bring_up(const std::function<bool()>& stop, bool scan_only) {
  if (scan_only) node_ = std::make_unique<node::CycleNode>(node_config(options_, true));
  auto stage = ethercat::Stage::kStopped;
  while (!node_->cyclic() && !node_->stopped()) {
    if (stop()) return false;
    if (stage != main().stage() && !options_.quiet && !scan_only) {
      stage = main().stage();
      say(fmt::format("{} ...\n", ethercat::name(stage)));
    }
    exchange();
  }
  return !main().failure();
}

void MainRunner::run(const std::function<bool()>& stop) {
  csv_.begin();
  const FreeRunningTime start = now();
  watch_.reserve(*node_, start);
  next_line_ = start + Duration{kLineInterval};
  node_->start(now());
  while (!stop() && node_->cyclic()) {
    const double elapsed_s = (now() - start).seconds();
    if (options_.duration_s > 0.0 && elapsed_s > options_.duration_s) break;
    cycle();
  }
  stop_drives();
}

/// They shall not find out by their watchdogs.
void MainRunner::stop_drives() {
  service_.stopping();
  node_->stop();
  while (!node_->stopped()) exchange();
}

void MainRunner::cycle() {
  link_.clock().wait_until(decision().wake, options_.spin);
  const auto limit =
      static_cast<std::int64_t>(kReplyShare * static_cast<double>(options_.servo.cycle.count()));
  const FreeRunningTime woken = now();
  const bool answered =
      transfer(node_->begin_cycle(woken, plant_now(woken)), now() + Duration::from_whole_ns(limit));
  node_->end_cycle(answered, stamps_, now());
  watch_.note(*node_, now());
  observer_.note(*node_, figures(), now());
  service_.turn(now(), decision().state == CycleState::kLocked,
                [this] { return service_sentence(); });
  if (csv_.is_open()) {
    csv_.write(figures().cycles, *node_);
  }
  if (now() >= next_line_) {
    next_line_ = next_line_ + Duration{kLineInterval};
    if (status_ != nullptr) {
      status_->publish(RunSnapshot::of(*node_, seen()));
    }
    if (!options_.quiet) say_live();
  }
}

/// Only the ways to move the bus that write a time ask for it.
std::optional<ReferenceTime> MainRunner::plant_now(FreeRunningTime now) {
  const bool wanted = plant_ && options_.bus_write != node::BusWrite::kOffset;
  return wanted ? plant_->at(now) : std::nullopt;
}

std::string_view MainRunner::service_sentence() {
  return observer_.sentence(sentence_, *node_, figures());
}

void MainRunner::say(std::string_view lines) {
  std::fflush(stdout);  // the rest of the program prints by its buffer
  lines_.write(lines);
  if (lines_.error() == 0 || std::exchange(output_failed_, true)) return;
  fmt::print(stderr, "ftcs ethercat: standard output: {}; the run goes on\n",
             platform::write_failure(lines_.error()));
}

void MainRunner::say_live() {
  const ethercat::CycleReport& report = main().last_cycle();
  const double rate = decision().rate.ratio();
  const std::size_t worst = clocks().worst(main().network().count);
  fmt::memory_buffer text;  // what fits needs no heap
  const auto add = [&text](auto... arguments) {
    fmt::format_to(std::back_inserter(text), arguments...);
  };
  add(FMT_STRING(
          "margin {:7.1f} us  {:9} (first after {})  phase {:+8.3f} us  rate {:+9.3f} ppm  cycle "
          "{:.6f} ms  "
          "wkc {}/{}  al 0x{:02X}  |0x092C| {} ns (drive {})  lost {}  late {}\n"),
      figures().margin.quantile(0.5) * 1e-3, name(decision().state), figures().lock_cycle,
      decision().phase_error.ns() * 1e-3, decision().rate.ppm(),
      static_cast<double>(options_.servo.cycle.count()) * 1e-6 / rate, report.working_counter,
      report.expected, report.states, clocks()[worst].last.value_or(0), worst,
      main().counters().lost, servo_counters().late);
  if (!options_.plant_time.empty()) {
    add(FMT_STRING("bus {:9}  dc to plant {:+12.3f} us (sigma {:.3f})  bus rate {:+9.3f} ppm\n"),
        ftcs::name(bus().state), bus().dc_to_plant.ns() * 1e-3, bus().sigma_ns * 1e-3,
        bus().rate_ppb * 1e-3);
  }
  say({text.data(), text.size()});
}

}  // namespace ftcs::daemon
