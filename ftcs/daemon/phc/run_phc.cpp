// SPDX-License-Identifier: MIT
#include <set>
#include <string>
#include <utility>

#include "ftcs/daemon/exit_code.h"
#include "ftcs/daemon/phc/phc_runner.h"
#include "ftcs/platform/stop_flag.h"

namespace ftcs::daemon {

namespace {

/// -a: until the port's state says which clock follows which. No value: stopped before.
std::optional<Pairing> wait_for_pairing(platform::Kernel& kernel, const PhcOptions& options,
                                        Log& log, PortWatch& watch) {
  constexpr int kTurnMs = 50;
  const platform::StopFlag stop;
  const std::int64_t start = kernel.clock_ns(CLOCK_MONOTONIC_RAW);
  std::optional<ptp::PortState> said;
  for (std::int64_t now = start;; now = kernel.clock_ns(CLOCK_MONOTONIC_RAW)) {
    if (auto wanted = pairing(watch, options.system_may_lead)) return wanted;
    if (watch.port() && watch.port()->state != said) {
      said = watch.port()->state;
      log(LogLevel::kNotice, "the PTP port is {}: waiting", to_string(*said));
    }
    if (stop.is_set()) return std::nullopt;
    if (options.duration && now - start >= options.duration->floor_ns()) return std::nullopt;
    watch.attend(now);
    (void)kernel.poll({}, kTurnMs);
  }
}

/// -a: one run after another, each with the clocks that the port then asks for.
int run_automatic(platform::Kernel& kernel, PhcOptions options, Log& log, PortWatch watch) {
  const std::int64_t start = kernel.clock_ns(CLOCK_MONOTONIC_RAW);
  const auto duration = options.duration;
  const auto first_step = options.first_step_threshold;
  std::set<std::string> steered;
  for (;;) {
    if (duration) {
      const std::int64_t gone = kernel.clock_ns(CLOCK_MONOTONIC_RAW) - start;
      options.duration = *duration - Duration::from_whole_ns(gone);
    }
    const auto wanted = wait_for_pairing(kernel, options, log, watch);
    if (!wanted) return kNotLocked;
    if (!watch.port()->hardware_timestamps) {
      log(LogLevel::kError,
          "the PTP port on {} takes software timestamps: its clock is the system clock already",
          wanted->interface);
      return kRuntimeError;
    }
    const std::string system = "CLOCK_REALTIME";
    options.source = wanted->port_leads ? wanted->interface : system;
    options.sink = wanted->port_leads ? system : wanted->interface;
    // A clock that was near its source is not to jump because it has another one now.
    options.first_step_threshold = steered.contains(options.sink) ? Nanoseconds{0} : first_step;
    auto runner = PhcRunner::open(kernel, options, log);
    if (!runner) {
      log(LogLevel::kError, "{}", runner.error());
      return kRuntimeError;
    }
    (*runner)->follow_port(std::move(watch), wanted);
    const int code = (*runner)->run();
    auto moved = (*runner)->take_moved_port();
    if (!moved || code == kRuntimeError) return code;
    if ((*runner)->has_steered()) steered.insert(options.sink);
    watch = std::move(*moved);
  }
}

}  // namespace

int run_phc(platform::Kernel& kernel, const PhcOptions& options, Log& log) {
  const auto refuse = [&log](const std::string& reason) {
    log(LogLevel::kError, "{}", reason);
    return kRuntimeError;
  };
  std::optional<PortWatch> watch;
  if (options.automatic || options.wait_for_port) {
    auto opened = PortWatch::open(options.port);
    if (!opened) return refuse(opened.error().message());
    watch.emplace(std::move(*opened));
    const PortAddress& port = options.port;
    log(LogLevel::kNotice,
        "waiting for the PTP port at {}, domain {}, transportSpecific {} (-z, -n and "
        "--transportSpecific name another)",
        port.socket, port.domain, port.major_sdo_id);
  }
  if (options.automatic) return run_automatic(kernel, options, log, std::move(*watch));
  auto runner = PhcRunner::open(kernel, options, log);
  if (!runner) return refuse(runner.error());
  if (watch) (*runner)->follow_port(std::move(*watch), std::nullopt);
  if (options.once_open) {
    if (const auto wrong = options.once_open()) return refuse(*wrong);
  }
  return (*runner)->run();
}

}  // namespace ftcs::daemon
