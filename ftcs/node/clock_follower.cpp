// SPDX-License-Identifier: MIT
#include "ftcs/node/clock_follower.h"

#include <cmath>
#include <utility>

namespace ftcs::node {
namespace {

// In a row, each after an exchange with somebody else. One is usual when a transmitter comes back.
constexpr int kSyncsWithoutStamps = 4;
// In units of the noise of one stamp: the mean of a few exchanges is good to half of it, one to
// 0.7.
constexpr double kStartDelayDoubt = 3.0;
constexpr double kAnotherLinkFrom = 4.0;

/// The delay is added to the reference before the servo sees a pair.
DisciplineConfig discipline_config(const ClockFollowerConfig& config) noexcept {
  DisciplineConfig discipline = config.discipline;
  if (config.peer_to_peer) discipline.servo.two_way.fixed_path_delay = Nanoseconds{0};
  return discipline;
}

/// The adaptive servo hears of one direction alone peer to peer: what the link delay moves by, it
/// follows. The others keep ptp4l's filter.
PathDelayConfig link_delay_config(const ClockFollowerConfig& config) noexcept {
  const ServoConfig& servo = config.discipline.servo;
  PathDelayConfig link = servo.two_way.path_delay;
  if (servo.kind == ServoKind::kAdaptive && !config.filter_is_chosen) {
    link.filter.kind = DelayFilterKind::kSteadyMean;
  }
  return link;
}

// Of what a row of commands at a limit is worth telling.
constexpr std::uint32_t kSaturatedFrom = 8;
// How well the oscillator's rate is known: as bad as any that a clock is allowed, and once locked.
constexpr double kUnknownRate = 500e-6;
constexpr double kKnownRate = 1e-6;

// Syncs in a row whose offset is refused: the reference was set while it was not heard.
constexpr std::uint32_t kRefusedToBegin = 16;

constexpr bool is_power_of_two(std::uint32_t times) noexcept { return (times & (times - 1)) == 0; }

Note note(NoteKind kind) noexcept {
  Note result;
  result.kind = kind;
  return result;
}

}  // namespace

ClockFollower::ClockFollower(const ClockFollowerConfig& config, AdjustableClock& clock,
                             ReferenceGate* gate) noexcept
    : config_(config),
      clock_(clock),
      gate_(gate),
      discipline_(discipline_config(config), clock),
      link_delay_(link_delay_config(config)),
      path_limit_(config.largest_path_delay) {}

bool ClockFollower::admits(const EventPair& pair) noexcept {
  return gate_ == nullptr || gate_->admits(pair.reference, pair.free_running);
}

void ClockFollower::on_pair(const EventPair& pair, std::optional<Duration> sync_interval) noexcept {
  if (admits(pair)) follow(pair, sync_interval);
}

void ClockFollower::follow(const EventPair& pair, std::optional<Duration> sync_interval) noexcept {
  if (config_.peer_to_peer) {
    if (!link_delay_.known()) {
      waiting_ = pair;
      return;
    }
    follow_timescale(pair);
  }
  if (!config_.peer_to_peer && !path_is_short(pair)) return;
  discipline_.on_announced_interval(sync_interval.value_or(Duration{}));
  hear_response(pair.free_running);
  const Steered steered = steer(pair, true);
  if (pair.direction != Direction::kForward) return;
  const bool used = steered.telemetry.verdict == SampleVerdict::kUsed;
  refused_syncs_ = used ? 0 : refused_syncs_ + 1;
}

Steered ClockFollower::steer(EventPair pair, bool paces) noexcept {
  const Duration delay = delay_taken_off();
  const bool forward = pair.direction == Direction::kForward;
  pair.reference = forward ? pair.reference + delay : pair.reference - delay;
  Steered result;
  result.event = pair.free_running;
  result.paces = paces;
  result.local = clock_.local_at(pair.free_running);
  const std::uint64_t clamps = discipline_.counters().clamps;
  result.telemetry = discipline_.on_pair(pair, paces);
  note_refusals(result.telemetry);
  note_saturation(result.telemetry, discipline_.counters().clamps != clamps);
  Duration& path_delay = result.telemetry.servo.path_delay;
  result.perceived = offset_from_reference(result.local, pair.reference + path_delay);
  path_delay += delay;
  tell(result);
  return result;
}

void ClockFollower::note_refusals(const Telemetry& telemetry) noexcept {
  const bool refuses = telemetry.error.has_value();
  if (refuses && (!clock_refuses_ || is_lasting(*telemetry.error))) {
    Note refused = note(NoteKind::kClockRefused);
    refused.error = *telemetry.error;
    tell(refused);
  }
  clock_refuses_ = refuses;
  if (telemetry.commanded) refused_offsets_ = 0;
  if (!telemetry.offset_refused || !is_power_of_two(++refused_offsets_)) return;
  Note refused = note(NoteKind::kOffsetRefused);
  refused.offset = telemetry.servo.offset;
  refused.times = refused_offsets_;
  tell(refused);
  const bool may_step = config_.discipline.step.permits(true);
  if (may_step && refused_offsets_ == kRefusedToBegin) on_reference_jump(-telemetry.servo.offset);
}

void ClockFollower::note_saturation(const Telemetry& telemetry, bool at_limit) noexcept {
  if (!telemetry.commanded) return;
  saturated_ = at_limit ? saturated_ + 1 : 0;
  if (saturated_ < kSaturatedFrom || !is_power_of_two(saturated_)) return;
  Note saturated = note(NoteKind::kSaturated);
  saturated.offset = telemetry.servo.offset;
  saturated.times = saturated_;
  tell(saturated);
}

bool ClockFollower::path_is_short(const EventPair& pair) noexcept {
  const double doubt = discipline_.locked() ? kKnownRate : kUnknownRate;
  const auto excess = path_limit_.excess(pair, discipline_.latest().tracking_rate, doubt);
  if (!excess) {
    refused_paths_ = 0;
    return true;
  }
  refuse_path(*excess);
  return false;
}

void ClockFollower::refuse_path(Duration delay) noexcept {
  if (!is_power_of_two(++refused_paths_)) return;
  Note refused = note(NoteKind::kPathDelayRefused);
  refused.path_delay = delay;
  refused.times = refused_paths_;
  tell(refused);
}

// Syncs and responses are of one direction, and a servo takes those in order. Which of two comes to
// be known first depends on when their Follow_Ups come.
void ClockFollower::hear_stamps(const ptp::PeerStamps& stamps) noexcept {
  unstamped_exchanges_ = syncs_without_stamps_ = 0;
  timescale_.on_response(stamps.response);
  if (!shares_timescale() || !timescale_.checked()) return;
  hear_response(stamps.response.free_running);
  if (stamps.response.free_running > timescale_.last_sync()) response_ = stamps.response;
  (void)steer(stamps.request, false);
}

void ClockFollower::hear_response(FreeRunningTime before) noexcept {
  if (!response_ || before <= response_->free_running) return;
  const EventPair response = *std::exchange(response_, std::nullopt);
  if (shares_timescale()) (void)steer(response, false);
}

void ClockFollower::follow_timescale(const EventPair& sync) noexcept {
  const SharedTimescale::Verdict before = timescale_.verdict();
  timescale_.on_sync(sync);
  if (timescale_.verdict() != before) return follow_verdict(before);
  if (!shares_timescale()) return;
  if (unstamped_exchanges_ > 0) ++syncs_without_stamps_;
  unstamped_exchanges_ = 0;
  if (syncs_without_stamps_ < kSyncsWithoutStamps) return;
  forget_stamps();
  begin_anew(note(NoteKind::kNeighbourIsAnother));
}

void ClockFollower::follow_verdict(SharedTimescale::Verdict before) noexcept {
  if (shares_timescale()) {
    start_delay_ = link_delay_.value();
    discipline_.free_path_delay(kStartDelayDoubt * discipline_.latest().servo.timestamp_noise_ns);
    return tell(note(NoteKind::kStampsShared));
  }
  const bool departed = before == SharedTimescale::Verdict::kShared;
  Note foreign = note(departed ? NoteKind::kStampsDeparted : NoteKind::kStampsForeign);
  foreign.difference_ns = timescale_.difference_ns();
  if (departed) return begin_anew(foreign);
  tell(foreign);
}

void ClockFollower::begin_anew(const Note& note) noexcept {
  tell(note);
  discipline_.on_new_reference();
}

void ClockFollower::forget_stamps() noexcept {
  timescale_.reset();
  response_.reset();
  unstamped_exchanges_ = syncs_without_stamps_ = 0;
}

// What one exchange says, against what the servo has found.
bool ClockFollower::is_another_link(Duration mean_link_delay) const noexcept {
  const ServoSnapshot& servo = discipline_.latest().servo;
  const Duration difference = mean_link_delay - start_delay_ - servo.path_delay;
  return std::abs(difference.ns()) > kAnotherLinkFrom * servo.timestamp_noise_ns;
}

// A filter that was asked for filters, and is not gone round.
bool ClockFollower::hears_stamps() const noexcept {
  return config_.discipline.servo.kind == ServoKind::kAdaptive && !config_.filter_is_chosen;
}

void ClockFollower::on_link_delay(const ptp::EmitPeerDelay& measured,
                                  std::optional<Duration> sync_interval) noexcept {
  if (path_limit_.exceeds(measured.mean_link_delay)) return refuse_path(measured.mean_link_delay);
  refused_paths_ = 0;
  if (!link_delay_.add(measured.mean_link_delay, measured.first)) return;
  if (measured.first && shares_timescale() && is_another_link(measured.mean_link_delay)) {
    forget_stamps();
    begin_anew(note(NoteKind::kAnotherLink));
  }
  if (waiting_) follow(*std::exchange(waiting_, std::nullopt), sync_interval);
  if (!hears_stamps()) return;
  // The delay is one, whatever its stamps say of time.
  if (measured.stamps && admits(measured.stamps->request)) return hear_stamps(*measured.stamps);
  if (shares_timescale()) ++unstamped_exchanges_;
}

void ClockFollower::on_new_link() noexcept {
  path_limit_.reset();
  link_delay_.reset();
  waiting_.reset();
  response_.reset();
}

void ClockFollower::on_new_reference() noexcept {
  path_limit_.reset();
  refused_offsets_ = 0;
  waiting_.reset();
  forget_stamps();
  discipline_.on_new_reference();
}

void ClockFollower::on_reference_jump(Duration jump) noexcept {
  path_limit_.reset();
  waiting_.reset();
  forget_stamps();
  Note jumped = note(NoteKind::kReferenceJumped);
  jumped.jump = jump;
  jumped.plan.response = JumpResponse::kRefused;
  jumped.gated = gate_ != nullptr && !gate_->admits_change(jump);
  if (!jumped.gated) jumped.plan = discipline_.on_reference_jump(jump);
  tell(jumped);
}

void ClockFollower::on_new_timescale() noexcept {
  forget_stamps();
  discipline_.on_new_timescale();
}

void ClockFollower::on_silence() noexcept {
  const Telemetry telemetry = discipline_.on_silence();
  const bool holdover = telemetry.servo.state == ServoState::kHoldover;
  if (holdover && !in_holdover_) {
    Note silent = note(NoteKind::kHoldover);
    silent.refused_syncs = refused_syncs_;
    tell(silent);
  }
  in_holdover_ = holdover;
}

// Taken after each input, so that the oldest is never in the way; if it is, the newest is missed.
void ClockFollower::tell(const FollowerEvent& event) noexcept {
  if (taken_ == told_) taken_ = told_ = 0;
  if (told_ < kMostEvents) events_[told_++] = event;
}

std::optional<FollowerEvent> ClockFollower::next() noexcept {
  if (taken_ == told_) return std::nullopt;
  return events_[taken_++];
}

}  // namespace ftcs::node
