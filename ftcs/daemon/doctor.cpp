// SPDX-License-Identifier: MIT
#include "ftcs/daemon/doctor.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "ftcs/daemon/ptp_clock.h"
#include "ftcs/daemon/ptp_receiver.h"
#include "ftcs/platform/frame_listener.h"
#include "ftcs/platform/network_interface.h"
#include "ftcs/time/duration.h"

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
  options.clock.device.clear();
  // In the place of a real clock: whatever the reference shows is followed, and compared with that
  // clock afterwards. A virtual one does what it would do.
  if (options.clock.kind != ClockKind::kVirtual) options.follower.first_step = true;
  options.clock.kind = ClockKind::kVirtual;
  options.follower.driftfile.clear();
  options.feeds.chrony_socket.clear();
  options.feeds.ntp_shm_unit.reset();
  options.management.socket.clear();
  options.output = Output::kText;
  options.log_level = 0;
  return options;
}

/// Whether somebody who is none of ours steers a clock: its frequency is looked at again and again.
/// Nothing is touched.
class ClockWatch {
 public:
  ClockWatch(platform::Kernel& kernel, const PtpOptions& options, bool hardware) {
    const auto open = [&](platform::ClockAccess access) {
      return hardware ? platform::ClockDevice::open_phc_of(kernel, options.interface, access)
                      : platform::ClockDevice::open_system(kernel, access);
    };
    // Whoever may steer it finds it held by another program of ours, which then is no stranger.
    if (!open(platform::ClockAccess::kSteer)) return;
    auto device = open(platform::ClockAccess::kRead);
    if (!device) return;
    device_.emplace(std::move(*device));
    look();
  }
  void look() {
    if (!device_) return;
    const auto now = device_->rate();
    if (!now) return;
    if (last_ && now->ratio() != last_->ratio()) ++changes_;
    last_ = *now;
  }

  /// How often it was changed.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }
  [[nodiscard]] std::string name() const { return device_ ? device_->name() : std::string(); }

 private:
  std::optional<platform::ClockDevice> device_{};
  std::optional<Rate> last_{};
  std::uint64_t changes_ = 0;
};

/// Follows, and looks at the clock that would be steered once in each turn, a second at most.
class Trial final : public PtpReceiver {
 public:
  Trial(platform::Kernel& kernel, const PtpOptions& options, Log& log,
        std::unique_ptr<platform::TimestampClock> timestamps, const PortFacts& facts,
        ClockWatch* clock)
      : PtpReceiver(kernel, options, log, std::move(timestamps), facts, nullptr), clock_(clock) {}

 private:
  void housekeeping(FreeRunningTime now) override {
    PtpReceiver::housekeeping(now);
    if (clock_ != nullptr) clock_->look();
  }
  ClockWatch* clock_;
};

/// Another one that announces itself, in this domain or another.
const diagnosis::Talker* another(const diagnosis::Talkers& heard, const PtpOptions& options,
                                 const ptp::PortIdentity& followed) {
  return heard.find([&](const diagnosis::Talker& talker) {
    return talker.announces() && talker.count(ptp::MessageType::kSync) > 0 && talker.vlan == 0 &&
           talker.version == ptp::kVersion && talker.to_group &&
           talker.way == static_cast<diagnosis::Way>(options.socket.transport) &&
           talker.major_sdo_id == options.protocol.major_sdo_id &&
           talker.port.clock != followed.clock;
  });
}

/// Two transmitters, followed one after the other: `first` is locked to `one`; `second` listened
/// to `other` alone. In doubt, where they disagree by more than what is known of each.
diagnosis::Finding compared(const ptp::PortIdentity& one, const TimeBound& first,
                            const diagnosis::Talker& other, const TimeBound& second) {
  if (second.state != TimeBound::State::kLocked) {
    return {diagnosis::Cause::kTwoTransmitters,
            fmt::format("the time of {} (domain {}) was not compared: no lock to it in as long",
                        to_text(other.port).view(), other.domain),
            "one time from both", "a longer --duration"};
  }
  const double apart_us = std::abs((first.time_at(second.at) - second.time).ns()) * 1e-3;
  const double known_us = (first.half_width_ns(second.at) + second.bound_ns) * 1e-3;
  const bool disagree = apart_us > known_us;
  std::string seen = fmt::format(
      "the transmitters {} and {} (domain {}) {} {:.3f} us, {:.3f} us of which may be noise",
      to_text(one).view(), to_text(other.port).view(), other.domain,
      disagree ? "disagree by" : "agree: they differ by", apart_us, known_us);
  if (!disagree) return {diagnosis::Cause::kTwoTransmitters, std::move(seen), "", ""};
  return {diagnosis::Cause::kTransmittersDisagree, std::move(seen), "one time from both",
          "one of them is wrong, or the path to one is asymmetric by twice as much: a third one "
          "would tell; --delayAsymmetry takes a known asymmetry off, --acceptable-transmitter "
          "chooses",
          true};
}

diagnosis::Finding failure(std::string text, std::string remedy = {}) {
  return {diagnosis::Cause::kOther, std::move(text), "", std::move(remedy)};
}

std::int64_t utc_s(platform::Kernel& kernel) {
  return kernel.clock_ns(CLOCK_REALTIME) / kNsPerSecond;
}

}  // namespace

namespace {

constexpr std::uint16_t kPortOfItsOwn = 0x7FFF;

/// A second one is followed for as long, by a port of its own, and its time compared.
std::optional<diagnosis::Finding> compare_with_another(platform::Kernel& kernel,
                                                       const PtpOptions& options, Log& log,
                                                       const ptp::ClockIdentity& own,
                                                       PtpReceiver& first,
                                                       const diagnosis::Talkers& heard) {
  const auto followed = first.transmitter();
  if (!followed || first.time().state != TimeBound::State::kLocked) return std::nullopt;
  const diagnosis::Talker* const other = another(heard, options, *followed);
  if (other == nullptr) return std::nullopt;
  PtpOptions of_other = options;
  of_other.protocol.domain = other->domain;
  of_other.receiver.acceptable = {};
  (void)of_other.receiver.acceptable.add(other->port.clock);
  of_other.follower.first_step = true;
  auto clocks = open_ptp_clocks(kernel, of_other, log);
  if (!clocks) return std::nullopt;
  PortFacts facts{{own, kPortOfItsOwn - 1}};
  facts.hardware_stamps = clocks->timestamps->is_hardware();
  PtpReceiver second(kernel, of_other, log, std::move(clocks->timestamps), facts, nullptr);
  (void)second.run();
  return compared(*followed, first.time(), *other, second.time());
}

bool has_adapter_stamps(platform::Kernel& kernel, const PtpOptions& options) {
  const auto adapter = platform::interface_capabilities(kernel, options.interface);
  return adapter && adapter->hardware_timestamps;
}

/// Switching the adapter's stamps on, or to another filter, may take them from a program that runs.
/// An adapter without any is left to say so.
PtpOptions trial(platform::Kernel& kernel, const PtpOptions& given, bool adapter_stamps) {
  PtpOptions options = quiet(given);
  const bool ethernet = options.socket.transport == platform::NetworkTransport::kEthernet;
  if (adapter_stamps &&
      !platform::has_hardware_timestamps_on(kernel, options.interface, ethernet)) {
    options.timestamps = platform::TimestampMode::kSoftware;
  }
  return options;
}

/// The hardware clock that is to be steered is not there.
std::optional<diagnosis::Finding> missing_clock(platform::Kernel& kernel, const PtpOptions& given,
                                                bool phc) {
  if (!phc) return std::nullopt;
  const auto device =
      platform::ClockDevice::open_phc_of(kernel, given.interface, platform::ClockAccess::kRead);
  if (device) return std::nullopt;
  return failure(device.error().message(), "--clock system steers the system clock instead");
}

/// It can be told without listening: the interface is not there, or it is down.
std::optional<diagnosis::Finding> unusable(platform::Kernel& kernel, const PtpOptions& options) {
  const auto state = platform::interface_state(kernel, options.interface);
  if (!state) return failure(state.error().message());
  if (state->up) return std::nullopt;
  diagnosis::PortSeen seen;
  seen.settings = port_settings(options);
  seen.link = diagnosis::Link::kDown;
  return diagnosis::link_trouble(seen);
}

/// How far the real clock that would be steered is from the reference, if that is farther than is
/// slewed and no step is allowed.
std::optional<Duration> first_offset(platform::Kernel& kernel, const PtpOptions& given,
                                     bool hardware, PtpReceiver& port) {
  const TimeBound reference = port.time();
  const DisciplineConfig config = follower_config(given, hardware, std::nullopt).discipline;
  if (config.step.permits(true) || reference.state != TimeBound::State::kLocked) {
    return std::nullopt;
  }
  auto device = hardware ? platform::ClockDevice::open_phc_of(kernel, given.interface,
                                                              platform::ClockAccess::kRead)
                         : platform::ClockDevice::open_system(kernel, platform::ClockAccess::kRead);
  const auto now = device ? device->read_clock() : std::nullopt;
  if (!now) return std::nullopt;
  // The system clock shows UTC.
  const Duration scale = Duration{
      std::chrono::seconds{hardware || !port.follows_tai() ? 0 : given.transmitter.utc_offset}};
  const Duration offset =
      LocalTime::from_ns(*now).since_epoch() + scale - reference.time.since_epoch();
  return abs(offset) > Duration{config.largest_offset} ? std::optional(offset) : std::nullopt;
}

/// What the port, the wire and the clock that would be steered have shown.
diagnosis::PortSeen seen_by(platform::Kernel& kernel, PtpReceiver& port, WireWatch& wire,
                            const ClockWatch* clock) {
  diagnosis::PortSeen seen = port.seen();
  seen.on_wire = wire.finish();
  seen.utc_s = utc_s(kernel);
  if (clock != nullptr) {
    seen.foreign_changes = clock->changes();
    seen.clock = clock->name();
  }
  return seen;
}

/// What was found, the answer that the comparison with another transmitter puts in doubt behind it.
void add_findings(std::vector<diagnosis::Finding>& findings,
                  std::vector<diagnosis::Finding> diagnosed,
                  const std::optional<diagnosis::Finding>& comparison) {
  if (comparison && comparison->in_doubt) findings.push_back(*comparison);
  for (diagnosis::Finding& finding : diagnosed) {
    // Beside a doubt it is no answer that the clock would lock.
    const bool locked = finding.cause == diagnosis::Cause::kLocked;
    if (!locked || findings.empty()) findings.push_back(std::move(finding));
  }
  if (comparison && !comparison->in_doubt) findings.push_back(*comparison);
}

}  // namespace

Examination examine(platform::Kernel& kernel, const PtpOptions& given,
                    const std::function<void()>& listens) {
  const bool steers = given.clock.kind != ClockKind::kVirtual;
  const bool any_epoch = given.follower.epoch.any_epoch;
  const bool adapter_stamps = has_adapter_stamps(kernel, given);
  const PtpOptions options = trial(kernel, given, adapter_stamps);
  Examination result;
  if (auto known = unusable(kernel, given)) {
    result.findings.push_back(std::move(*known));
    return result;
  }
  // The hardware clock is looked at even where a trial without its stamps has to do.
  const bool phc = given.clock.kind == ClockKind::kPhc ||
                   (given.clock.kind == ClockKind::kAuto && adapter_stamps);
  if (auto missing = missing_clock(kernel, given, phc)) {
    result.findings.push_back(std::move(*missing));
    return result;
  }
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
  PortFacts facts{{identity->clock, kPortOfItsOwn}};
  facts.hardware_stamps = clocks->timestamps->is_hardware();
  result.listened = true;
  if (listens) listens();
  std::optional<ClockWatch> clock;
  if (steers) clock.emplace(kernel, options, phc);
  WireWatch wire(options.interface, identity->clock);
  Trial port(kernel, options, log, std::move(clocks->timestamps), facts, clock ? &*clock : nullptr);
  (void)port.run();
  const auto far = steers ? first_offset(kernel, given, phc, port) : std::nullopt;
  diagnosis::PortSeen seen = seen_by(kernel, port, wire, clock ? &*clock : nullptr);
  seen.steers_real_clock = steers && !any_epoch;
  seen.first_offset = far;
  result.wire_unheard = wire.error();
  const diagnosis::Talkers& talkers = seen.on_wire ? *seen.on_wire : seen.at_port;
  result.heard.assign(talkers.all().begin(), talkers.all().end());
  if (port.failure()) result.findings.push_back(failure(*port.failure()));
  const auto comparison =
      compare_with_another(kernel, options, log, identity->clock, port, talkers);
  add_findings(result.findings, diagnosis::diagnose_all(seen), comparison);
  return result;
}

}  // namespace ftcs::daemon
