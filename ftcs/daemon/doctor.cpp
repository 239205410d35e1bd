// SPDX-License-Identifier: MIT
#include "ftcs/daemon/doctor.h"

#include <atomic>
#include <thread>
#include <utility>

#include "ftcs/daemon/ptp_clock.h"
#include "ftcs/daemon/ptp_receiver.h"
#include "ftcs/platform/frame_listener.h"
#include "ftcs/platform/network_interface.h"

namespace ftcs::daemon {
namespace {

/// Listens in a thread of its own for as long as it lives.
class WireWatch {
 public:
  WireWatch(const std::string& interface, const ptp::ClockIdentity& own) {
    talkers_.set_own(own);
    auto opened = platform::FrameListener::open(interface);
    if (!opened) {
      error_ = opened.error().message();
      return;
    }
    thread_ = std::thread([this, listener = std::move(*opened)]() mutable {
      constexpr std::chrono::milliseconds kTurn{100};
      while (!stop_) {
        if (const auto frame = listener.next(kTurn)) talkers_.on_frame(*frame);
      }
    });
  }
  WireWatch(const WireWatch&) = delete;
  WireWatch& operator=(const WireWatch&) = delete;
  ~WireWatch() { (void)finish(); }

  /// What was heard; none: nothing could be. Ends the listening.
  [[nodiscard]] std::optional<diagnosis::Talkers> finish() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return error_ ? std::nullopt : std::optional(talkers_);
  }
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

 private:
  std::atomic<bool> stop_ = false;
  diagnosis::Talkers talkers_;
  std::optional<std::string> error_{};
  std::thread thread_;
};

/// A port that steers nothing, says nothing and has a number of its own, so that an instance which
/// runs already takes its messages for nobody's.
PtpOptions quiet(PtpOptions options) {
  options.role = Role::kTimeReceiver;
  options.source = Source::kNetwork;
  options.clock = ClockKind::kVirtual;
  options.clock_device.clear();
  options.first_step = true;  // of the virtual clock: whatever the reference shows is followed
  options.driftfile.clear();
  options.chrony_socket.clear();
  options.ntp_shm_unit.reset();
  options.uds_address.clear();
  options.output = Output::kText;
  options.log_level = 0;
  return options;
}

diagnosis::Finding failure(std::string text) {
  return {diagnosis::Cause::kOther, std::move(text), "", ""};
}

bool is_link_up(platform::Kernel& kernel, const std::string& interface) {
  const auto state = platform::interface_state(kernel, interface);
  return !state || (state->up && state->running);
}

std::int64_t utc_s(platform::Kernel& kernel) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return kernel.clock_ns(CLOCK_REALTIME) / kNsPerSecond;
}

}  // namespace

Examination examine(platform::Kernel& kernel, PtpOptions given) {
  const bool steers = given.clock != ClockKind::kVirtual && !given.epoch.any_epoch;
  const PtpOptions options = quiet(std::move(given));
  Examination result;
  Log log(kernel, stdout, options.log_level);
  auto clocks = open_ptp_clocks(kernel, options, log);
  if (!clocks) {
    result.findings.push_back(failure(clocks.error()));
    return result;
  }
  const auto identity = port_identity(kernel, options);
  if (!identity) {
    result.findings.push_back(failure(identity.error().message()));
    return result;
  }
  constexpr std::uint16_t kPortOfItsOwn = 0x7FFF;
  PortFacts facts{{identity->clock, kPortOfItsOwn}};
  facts.hardware_stamps = clocks->timestamps->is_hardware();
  WireWatch wire(options.interface, identity->clock);
  PtpReceiver port(kernel, options, log, std::move(clocks->timestamps), facts, nullptr);
  (void)port.run();
  diagnosis::PortSeen seen = port.seen();
  seen.on_wire = wire.finish();
  seen.steers_real_clock = steers;
  seen.link_up = is_link_up(kernel, options.interface);
  seen.utc_s = utc_s(kernel);
  result.wire_unheard = wire.error();
  const diagnosis::Talkers& talkers = seen.on_wire ? *seen.on_wire : seen.at_port;
  result.heard.assign(talkers.all().begin(), talkers.all().end());
  if (port.failure() && seen.link_up) result.findings.push_back(failure(*port.failure()));
  for (diagnosis::Finding& finding : diagnosis::diagnose_all(seen)) {
    result.findings.push_back(std::move(finding));
  }
  return result;
}

}  // namespace ftcs::daemon
