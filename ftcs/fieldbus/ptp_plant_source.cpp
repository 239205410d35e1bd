// SPDX-License-Identifier: MIT
#include "ftcs/fieldbus/ptp_plant_source.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "ftcs/daemon/ptp_clock.h"

namespace ftcs::daemon {

namespace {

/// Of the receiver's lines only what goes wrong: the run has lines of its own.
constexpr int kWarningsOnly = 4;

/// What a receiver of plant time is, whatever its options say.
PtpOptions plant_options(PtpOptions options) {
  options.role = Role::kTimeReceiver;
  options.source = Source::kNetwork;
  options.clock.kind = ClockKind::kVirtual;
  options.follower.first_step = true;  // before the first cycle; nobody acts on that clock yet
  // A configuration file may be that of a service, whose these are.
  options.management.socket.clear();
  options.follower.driftfile.clear();
  options.feeds.chrony_socket.clear();
  options.feeds.ntp_shm_unit.reset();
  options.output = Output::kText;
  options.duration.reset();
  options.socket.interface = options.interface;
  options.socket.unicast_messages = options.receiver.hybrid
                                        ? platform::UnicastMessages::kDelayAnswers
                                        : platform::UnicastMessages::kNone;
  return options;
}

}  // namespace

std::string PlantReceiver::objection(ReferenceTime plant) {
  if (!node().locked()) return service_sentence();
  if (plant >= ReferenceTime{}) return {};
  return fmt::format(
      "the grandmaster on {} shows a time before the year 2000: an arbitrary epoch is no plant "
      "time. Does it know the date?",
      options().interface);
}

/// UTC, as of a grandmaster with software stamps, is the same for all machines of a plant.
void PlantReceiver::warn_of_timescale() {
  const ptp::TransmitterData* transmitter = node().port().transmitter();
  if (warned_ || transmitter == nullptr) return;
  warned_ = true;
  if ((transmitter->flags & ptp::flag::kPtpTimescale) != 0) return;
  log()(LogLevel::kWarning,
        "the grandmaster on {} does not use the PTP timescale: plant time is its own, not TAI",
        options().interface);
}

void PlantReceiver::housekeeping(FreeRunningTime now) {
  PtpReceiver::housekeeping(now);
  warn_of_timescale();
  const auto reading = timestamps().read_realtime();
  const LocalTime shown = clock().local_at(oscillator().from_underlying(reading.free_running));
  const ReferenceTime plant = on_dc_epoch(shown.since_epoch().rounded_ns());
  const std::int64_t monotonic =
      reading.realtime_ns - ahead_of_monotonic_ns(kernel(), CLOCK_REALTIME);
  std::string reason = objection(plant);
  if (reason.empty()) mailbox_.put({FreeRunningTime::from_ns(monotonic), plant});
  const std::lock_guard lock(guard_);
  reason_ = std::move(reason);
}

std::string PlantReceiver::reason() {
  const std::lock_guard lock(guard_);
  return reason_;
}

PtpPlantSource::PtpPlantSource(platform::Kernel& kernel, const PtpOptions& options)
    : log_(kernel, stderr, std::min(options.log_level, kWarningsOnly)) {}

Result<std::unique_ptr<PtpPlantSource>, std::string> PtpPlantSource::start(
    platform::Kernel& kernel, const PtpOptions& given) {
  const PtpOptions options = plant_options(given);
  std::unique_ptr<PtpPlantSource> source(new PtpPlantSource(kernel, options));
  auto clocks = open_ptp_clocks(kernel, options, source->log_);
  if (!clocks) return clocks.error();
  const auto facts = port_facts(kernel, options, *clocks);
  if (!facts) return facts.error().message();
  source->receiver_ = std::make_unique<PlantReceiver>(
      kernel, options, source->log_, std::move(clocks->timestamps), *facts, nullptr);
  source->receiver_->silence_service();
  source->thread_ = std::thread([plain = source.get()] {
    (void)plain->receiver_->run([plain] { return plain->stop_.load(); });
    plain->ended_ = true;
  });
  return source;
}

PtpPlantSource::~PtpPlantSource() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::string PtpPlantSource::reason() {
  if (ended_) return "the PTP receiver has ended: its last line says why";
  return receiver_->reason();
}

Result<PlantClock, std::string> open_plant_clock(const std::string& name, PtpOptions ptp,
                                                 platform::Kernel& kernel) {
  constexpr std::string_view kWithInterface = "ptp:";
  const bool named = name.starts_with(kWithInterface);
  if (!named && name != "ptp") return PlantClock::open(name, kernel);
  if (named) ptp.interface = name.substr(kWithInterface.size());
  if (ptp.interface.empty()) {
    return std::string("on which interface? As in ptp:eth1, or by --ptp-config");
  }
  auto source = PtpPlantSource::start(kernel, ptp);
  if (!source) return source.error();
  return PlantClock(kernel, name, std::move(*source));
}

}  // namespace ftcs::daemon
