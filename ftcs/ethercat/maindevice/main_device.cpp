// SPDX-License-Identifier: MIT
#include "ftcs/ethercat/maindevice/main_device.h"

#include "ftcs/ethercat/maindevice/bridge_terminal.h"
#include "ftcs/time/relabel.h"

namespace ftcs::ethercat {

namespace {
/// The way to SAFEOP is announced more than once: on a bad line one frame may not arrive.
constexpr std::uint32_t kStopFrames = 5;
}  // namespace

const char* name(Stage stage) noexcept {
  switch (stage) {
    case Stage::kScan:
      return "scan";
    case Stage::kClocks:
      return "clocks";
    case Stage::kConfigure:
      return "configure";
    case Stage::kCyclic:
      return "cyclic";
    case Stage::kStopping:
      return "stopping";
    case Stage::kStopped:
      return "stopped";
  }
  return "unknown";
}

MainDevice::MainDevice(const MainDeviceConfig& config) noexcept : config_(config) {
  scanner_.start(config.expected_subdevices, config.sii_timeout, config.take_over,
                 config.listening);
}

ConstBytes MainDevice::next_frame() noexcept {
  if (outstanding_) on_timeout();
  if (stage_ == Stage::kStopped) return {};
  FrameWriter writer(buffer_, 0);
  write_frame(writer);
  const auto frame = writer.finish();
  if (!frame || !number_datagrams(*frame)) {
    // In the cyclic stage the way down goes out instead, with the next call.
    const bool running = stage_ == Stage::kCyclic;
    begin_stop({.kind = FailureKind::kFrameTooLarge});
    if (!running) stage_ = Stage::kStopped;
    return {};
  }
  outstanding_ = true;
  ++counters_.sent;
  return *frame;
}

/// The index of a datagram has eight bits: an answer 256 frames old would look right. A frame has a
/// number of 32 bits; its datagrams carry the four bytes in turn.
bool MainDevice::number_datagrams(ConstBytes frame) noexcept {
  size_ = frame.size();
  const auto written = FrameView::parse(Bytes{buffer_}.first(size_));
  if (!written) return false;
  ++number_;
  unsigned turn = 0;
  for (const Datagram datagram : *written) {
    datagram.set_index(static_cast<std::uint8_t>(number_ >> (8 * (turn++ % 4))));
  }
  return true;
}

void MainDevice::write_frame(FrameWriter& writer) noexcept {
  switch (stage_) {
    case Stage::kScan:
      return scanner_.request(writer, network_);
    case Stage::kClocks:
      return clock_setup_.request(writer, network_);
    case Stage::kConfigure:
      configurator_.request(writer, network_);
      // The clocks must not drift apart while the rest is being configured.
      if (clocks_wanted() && !configurator_.aligning()) {
        add_drift(writer, network_);
      }
      return;
    case Stage::kCyclic:
      exchange_.request(writer, network_);
      return write_reintegration(writer);
    case Stage::kStopping:
      writer.add_value({Command::kBwr, 0, reg::kAlControl},
                       static_cast<std::uint16_t>(AlState::kSafeOp));
      writer.add({Command::kBrd, 0, reg::kAlStatus}, 2);
      return;
    case Stage::kStopped:
      return;
  }
}

/// The reply is the request: number, commands, addresses and sizes of all its datagrams. Positions
/// are counted up on the way.
bool MainDevice::answers(const FrameView& frame) noexcept {
  if (!outstanding_) return false;
  const auto sent = FrameView::parse(Bytes{buffer_}.first(size_));
  if (!sent || frame.count() != sent->count()) return false;
  auto mine = sent->begin();
  for (const Datagram datagram : frame) {
    const Datagram request = *mine;
    ++mine;
    const bool same =
        datagram.index() == request.index() && datagram.command() == request.command() &&
        datagram.offset() == request.offset() && datagram.data().size() == request.data().size();
    if (!same) return false;
  }
  return true;
}

FrameOutcome MainDevice::on_frame(Bytes bytes, const FrameStamps& stamps) noexcept {
  const auto frame = FrameView::parse(bytes);
  if (!frame || !answers(*frame)) {
    ++counters_.ignored;
    return FrameOutcome::kIgnored;
  }
  outstanding_ = false;
  retries_ = 0;
  counters_.lost_in_a_row = 0;
  switch (stage_) {
    case Stage::kScan:
    case Stage::kClocks:
    case Stage::kConfigure:
      return bring_up(*frame, stamps);
    case Stage::kCyclic:
      cycle_ = exchange_.reply(*frame, network_);
      if (reintegrator_asked_) reintegrate(frame->from(exchange_.datagrams()), stamps.received);
      keep_members();
      return finish_cycle();
    case Stage::kStopping:
      return confirm_stop(*frame, stamps.received);
    case Stage::kStopped:
      break;
  }
  return FrameOutcome::kStopped;
}

FrameOutcome MainDevice::bring_up(const FrameView& frame, const FrameStamps& stamps) noexcept {
  if (!has_begun_) begun_ = stamps.received;
  has_begun_ = true;
  if (stamps.received - begun_ > Duration{config_.bring_up_timeout}) {
    return advance(fail(failure_, {.kind = FailureKind::kBringUpTimeout}));
  }
  if (stage_ == Stage::kScan) {
    return advance(scanner_.reply(frame, network_, stamps.received, failure_));
  }
  if (stage_ == Stage::kClocks) {
    const FreeRunningTime shown =
        stamps.has_system_time ? relabel<FreeRunningTime>(stamps.system_time) : stamps.sent;
    return advance(clock_setup_.reply(frame, network_, shown, failure_));
  }
  if (stamps.has_system_time) configurator_.want_system_time(stamps.system_time);
  return advance(configurator_.reply(frame, network_, stamps.received, failure_));
}

/// Asked for again until everybody has been seen out of OP. Who does not answer has been given up.
FrameOutcome MainDevice::confirm_stop(const FrameView& frame, FreeRunningTime now) noexcept {
  if (!has_begun_) begun_ = now;
  has_begun_ = true;
  const Datagram status = frame[1];
  const auto states = load<std::uint16_t>(status.data(), 0);
  const bool out_of_op = (states & static_cast<std::uint16_t>(AlState::kOp)) == 0;
  const bool all_there = status.working_counter() == network_.count;
  if (stop_frames_ > 0) --stop_frames_;
  stop_confirmed_ = out_of_op && (all_there || stop_frames_ == 0);
  const bool too_long = now - begun_ > Duration{config_.stop_timeout};
  if (!stop_confirmed_ && !too_long) return FrameOutcome::kProgress;
  if (!stop_confirmed_ && !failure_) {
    failure_ = {.kind = FailureKind::kNotStopped,
                .expected = static_cast<std::uint16_t>(network_.count),
                .received = status.working_counter()};
  }
  stage_ = Stage::kStopped;
  return FrameOutcome::kStopped;
}

FrameOutcome MainDevice::advance(Progress progress) noexcept {
  if (progress == Progress::kContinue) return FrameOutcome::kProgress;
  const auto stop = [this] {
    stage_ = Stage::kStopped;
    return FrameOutcome::kStopped;
  };
  if (progress == Progress::kFailed) return stop();
  if (stage_ == Stage::kScan && clocks_wanted()) {
    clock_setup_.start(config_.clocks);
    stage_ = Stage::kClocks;
    return FrameOutcome::kProgress;
  }
  if (stage_ == Stage::kScan && !config_.distributed_clocks) {
    network_.reference = Network::kNoReference;
  }
  if (stage_ == Stage::kConfigure) {
    exchange_.start(network_);
    has_begun_ = false;
    stage_ = Stage::kCyclic;
    return FrameOutcome::kProgress;
  }
  if (config_.scan_only) return stop();
  if (config_.needs_reference && !network_.has_reference()) {
    (void)fail(failure_, {.kind = FailureKind::kNoDistributedClock});
    return stop();
  }
  if (config_.process.bridge && !bridge::choose(network_, *config_.process.bridge)) {
    (void)fail(failure_, {.kind = FailureKind::kNoBridge});
    return stop();
  }
  configurator_.start(config_.process);
  stage_ = Stage::kConfigure;
  return FrameOutcome::kProgress;
}

void MainDevice::write_reintegration(FrameWriter& writer) noexcept {
  reintegrator_asked_ = reintegrator_.active();
  if (!reintegrator_asked_) return;
  if (writer.room() >= Reintegrator::room_needed(network_.devices[reintegrator_.position()])) {
    return reintegrator_.request(writer, network_);
  }
  // Another frame may carry fewer states of the others; if not, its turn never comes.
  reintegrator_asked_ = false;
  if (++attempts_ < config_.reintegration_attempts * kMaxSubDevices) return;
  reintegrator_.stop();
  begin_stop({.kind = FailureKind::kProcessImageTooLarge,
              .expected = static_cast<std::uint16_t>(writer.room())});
}

void MainDevice::reintegrate(const FrameView& frame, FreeRunningTime now) noexcept {
  const std::size_t position = reintegrator_.position();
  Failure failure;
  const Progress progress = reintegrator_.reply(frame, network_, cycle_.reference, now, failure);
  if (progress == Progress::kDone) {
    attempts_ = 0;
    ++counters_.reintegrated;
    exchange_.admit(network_, position);
    if (op_requested_) {
      exchange_.request_state(position, static_cast<std::uint16_t>(AlState::kOp));
    }
  }
  // A failed attempt is followed by another from the beginning (keep_members).
  if (progress == Progress::kFailed && ++attempts_ >= config_.reintegration_attempts) {
    begin_stop(failure);
  }
}

/// Who takes part: whoever is in SAFEOP or OP, and whoever has just been mapped again. Whoever is
/// there and is neither gets its configuration back, one after another.
void MainDevice::keep_members() noexcept {
  const bool all_there = cycle_.answering == network_.count;
  counters_.absent_in_a_row = all_there ? 0 : counters_.absent_in_a_row + 1;
  there_in_a_row_ = all_there ? there_in_a_row_ + 1 : 0;
  // After a wire was mended everybody is asked first: most have lost nothing.
  const bool all_asked = there_in_a_row_ >= 2 * network_.count;
  for (std::size_t n = 0; n < network_.count; ++n) {
    const AlState state = network_.devices[n].state;
    const bool coming = reintegrator_.active() && reintegrator_.position() == n;
    const bool configured = state == AlState::kSafeOp || state == AlState::kOp;
    const bool part = coming ? reintegrator_.mapped() : configured;
    if (part != exchange_.takes_part(n)) {
      part ? exchange_.admit(network_, n) : exchange_.dismiss(network_, n);
    }
    // Only what the cycle's own datagrams carry survives a wire that is cut.
    if (coming && !all_there) reintegrator_.stop();
    if (!part && !coming && all_asked && !reintegrator_.active()) {
      reintegrator_.start(n, config_.process);
    }
  }
}

bool MainDevice::complete() const noexcept {
  for (std::size_t n = 0; n < network_.count; ++n) {
    if (!exchange_.takes_part(n)) return false;
  }
  return !reintegrator_.active();
}

FrameOutcome MainDevice::finish_cycle() noexcept {
  if (counters_.absent_in_a_row >= config_.absence_limit) {
    begin_stop({.kind = FailureKind::kWorkingCounter,
                .expected = cycle_.whole,
                .received = cycle_.working_counter});
  }
  if (cycle_.inputs_valid) {
    counters_.wrong_in_a_row = 0;
    return FrameOutcome::kCycle;
  }
  ++counters_.wrong_working_counter;
  if (++counters_.wrong_in_a_row >= config_.working_counter_limit) {
    begin_stop({.kind = FailureKind::kWorkingCounter,
                .expected = cycle_.whole,
                .received = cycle_.working_counter});
  }
  return FrameOutcome::kCycle;
}

FrameOutcome MainDevice::on_timeout() noexcept {
  if (!outstanding_) return FrameOutcome::kIgnored;
  outstanding_ = false;
  ++counters_.lost;
  if (stage_ == Stage::kCyclic) {
    if (++counters_.lost_in_a_row >= config_.lost_frame_limit) {
      begin_stop({.kind = FailureKind::kLinkLost,
                  .received = static_cast<std::uint16_t>(counters_.lost_in_a_row)});
    }
    return FrameOutcome::kCycle;
  }
  if (stage_ == Stage::kStopping && (stop_frames_ == 0 || --stop_frames_ == 0)) {
    stage_ = Stage::kStopped;
    return FrameOutcome::kStopped;
  }
  if (stage_ != Stage::kStopping && ++retries_ > config_.retries) {
    failure_ = {.kind = FailureKind::kNoReply};
    stage_ = Stage::kStopped;
    return FrameOutcome::kStopped;
  }
  return FrameOutcome::kProgress;
}

void MainDevice::request_operational() noexcept {
  op_requested_ = true;
  for (std::size_t n = 0; n < network_.count; ++n) {
    exchange_.request_state(n, static_cast<std::uint16_t>(AlState::kOp));
  }
}

void MainDevice::recover(std::size_t position) noexcept {
  const SubDeviceInfo& device = network_.devices[position];
  constexpr auto kSafeOp = static_cast<std::uint16_t>(AlState::kSafeOp);
  if (device.error) {
    exchange_.request_state(position, kSafeOp | kAlErrorFlag);
  } else if (device.state == AlState::kSafeOp) {
    exchange_.request_state(position, static_cast<std::uint16_t>(AlState::kOp));
  }
}

void MainDevice::shift_system_time(std::int64_t by_ns) noexcept {
  if (by_ns == 0 || !clocks_wanted()) return;
  network_.devices[network_.reference].system_time_offset += static_cast<std::uint64_t>(by_ns);
  exchange_.write_system_time_offset();
}

void MainDevice::begin_stop(const Failure& failure) noexcept {
  if (stage_ == Stage::kStopping || stage_ == Stage::kStopped) return;
  failure_ = failure;
  stop_frames_ = kStopFrames;
  stage_ = Stage::kStopping;
}

}  // namespace ftcs::ethercat
