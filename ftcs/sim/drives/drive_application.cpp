// SPDX-License-Identifier: MIT
#include "ftcs/sim/drives/drive_application.h"

#include <algorithm>

namespace ftcs::ethercat {

namespace {
constexpr std::size_t kMailboxOut = 0;
constexpr std::size_t kMailboxIn = 1;
constexpr std::size_t kOutputs = 2;
constexpr std::size_t kInputs = 3;

/// Longer than any start delay of SYNC0 that main devices use (100 ms).
constexpr Nanoseconds kOpTimeout{500'000'000};
/// Cycles with outputs before each SYNC0 that prove to the drive that it is in step.
constexpr unsigned kGoodCyclesForOp = 2;
/// ETG.1020: a missed event counts three, a good one takes one off.
constexpr std::uint32_t kMissWeight = 3;
/// A drive's loop follows a crystal and its correction; a SYNC0 period further off than this for
/// several cycles is a slewing clock.
constexpr double kSteadyDeviation = 600e-6;
constexpr unsigned kUnsteadyCyclesForFault = 8;

constexpr std::uint16_t kDriveErrorSync = 0x8700;           // CiA 402: sync controller
constexpr std::uint16_t kDriveErrorCommunication = 0x7500;  // CiA 402: communication

constexpr std::uint16_t kAlStatusEvent = 0x0008;
}  // namespace

void DriveApplication::power_on(Duration now) noexcept {
  objects_.reset();
  motor_.reset();
  statistics_ = {};
  error_ = false;
  code_ = AlStatusCode::kNoError;
  outputs_crystal_ = now;
  enter(AlState::kInit);
}

void DriveApplication::publish_state() noexcept {
  const unsigned status = static_cast<unsigned>(state_) | (error_ ? kAlErrorFlag : 0U);
  memory_.set(reg::kAlStatus, static_cast<std::uint16_t>(status));
  memory_.set(reg::kAlStatusCode, static_cast<std::uint16_t>(code_));
  const auto event = memory_.get<std::uint16_t>(reg::kEventRequest);
  memory_.set(reg::kEventRequest, static_cast<std::uint16_t>(event | kAlStatusEvent));
}

void DriveApplication::enter(AlState state) noexcept {
  state_ = state;
  op_requested_ = false;
  if (state_ == AlState::kInit || state_ == AlState::kPreOp) synchronous_ = false;
  if (state_ != AlState::kOp) motor_.control(0, false);
  publish_state();
  publish_inputs();
}

void DriveApplication::remember(AlStatusCode code) noexcept {
  for (std::size_t i = 0; i < fault_kinds_; ++i) {
    if (faults_[i].code != code) continue;
    ++faults_[i].count;
    return;
  }
  if (fault_kinds_ < kFaultKinds) faults_[fault_kinds_++] = {code, 1};
}

void DriveApplication::refuse(AlStatusCode code) noexcept {
  remember(code);
  error_ = true;
  code_ = code;
  op_requested_ = false;
  publish_state();
}

void DriveApplication::fail(AlStatusCode code) noexcept {
  remember(code);
  error_ = true;
  code_ = code;
  const bool communication = code == AlStatusCode::kSyncManagerWatchdog;
  motor_.fault(communication ? kDriveErrorCommunication : kDriveErrorSync);
  enter(AlState::kSafeOp);
}

void DriveApplication::request_state(std::uint16_t control, Duration now) noexcept {
  const auto wanted = static_cast<AlState>(control & kAlStateMask);
  if (error_) {
    if ((control & kAlErrorFlag) == 0) return;  // first the error must be acknowledged
    error_ = false;
    code_ = AlStatusCode::kNoError;
  }
  using enum AlState;
  if (wanted == kBootstrap) return refuse(AlStatusCode::kBootstrapNotSupported);
  const bool known = wanted == kInit || wanted == kPreOp || wanted == kSafeOp || wanted == kOp;
  if (!known) return refuse(AlStatusCode::kUnknownRequestedState);
  if (!is_legal_transition(state_, wanted)) {
    return refuse(AlStatusCode::kInvalidRequestedStateChange);
  }
  AlStatusCode problem = AlStatusCode::kNoError;
  if (state_ == kInit && wanted == kPreOp) problem = check_mailbox();
  if (state_ == kPreOp && wanted == kSafeOp) {
    problem = check_process_data();
    if (problem == AlStatusCode::kNoError) problem = check_sync();
  }
  if (problem != AlStatusCode::kNoError) return refuse(problem);
  if (state_ == kSafeOp && wanted == kOp) return begin_op(now);
  if (state_ == kPreOp && wanted == kSafeOp) {
    synchronous_ = (memory_.get<std::uint8_t>(reg::kDcActivation) & reg::kActivateSync0) != 0;
    objects_.set(obj::kSync0Cycle, memory_.get<std::uint32_t>(reg::kSync0CycleTime));
  }
  enter(wanted);
}

void DriveApplication::begin_op(Duration now) noexcept {
  if (!op_requested_) {
    good_cycles_ = 0;
    sync0_since_request_ = 0;
    op_deadline_ = now + kOpTimeout;
  }
  op_requested_ = true;
  publish_state();
  // Who takes no outputs has none to wait for.
  if (!synchronous_ && objects_.mapped_bytes(obj::kReceiveAssign) == 0) enter(AlState::kOp);
}

AlStatusCode DriveApplication::check_mailbox() const noexcept {
  const SyncManagerChannel out = memory_.sync_manager(kMailboxOut);
  const SyncManagerChannel in = memory_.sync_manager(kMailboxIn);
  const auto usable = [](const SyncManagerChannel& channel) {
    return channel.active && channel.mailbox() && channel.length >= kSdoOverhead &&
           channel.start >= reg::kProcessRam && EscMemory::contains(channel.start, channel.length);
  };
  const bool good =
      usable(out) && out.main_device_writes() && usable(in) && !in.main_device_writes();
  return good ? AlStatusCode::kNoError : AlStatusCode::kInvalidMailboxConfiguration;
}

AlStatusCode DriveApplication::check_process_data() const noexcept {
  const auto fits = [this](std::size_t manager, std::size_t bytes, bool written) {
    const SyncManagerChannel channel = memory_.sync_manager(manager);
    if (bytes == 0) return !channel.active || channel.length == 0;
    return channel.active && !channel.mailbox() && channel.length == bytes &&
           channel.main_device_writes() == written && channel.start >= reg::kProcessRam &&
           EscMemory::contains(channel.start, channel.length);
  };
  if (!fits(kOutputs, objects_.mapped_bytes(obj::kReceiveAssign), true)) {
    return AlStatusCode::kInvalidOutputConfiguration;
  }
  if (!fits(kInputs, objects_.mapped_bytes(obj::kTransmitAssign), false)) {
    return AlStatusCode::kInvalidInputConfiguration;
  }
  return AlStatusCode::kNoError;
}

AlStatusCode DriveApplication::check_sync() const noexcept {
  constexpr std::uint8_t kBoth = reg::kActivateCyclic | reg::kActivateSync0;
  const bool active = (memory_.get<std::uint8_t>(reg::kDcActivation) & kBoth) == kBoth;
  if (!active) {
    return objects_.get(obj::kSyncType) == obj::kSyncTypeSync0
               ? AlStatusCode::kInvalidDcSyncConfiguration
               : AlStatusCode::kNoError;
  }
  const auto cycle = memory_.get<std::uint32_t>(reg::kSync0CycleTime);
  if (cycle < objects_.get(obj::kSyncMinCycle)) return AlStatusCode::kInvalidSync0CycleTime;
  const std::uint32_t configured = objects_.get(obj::kSyncCycle);
  if (configured != 0 && configured != cycle) return AlStatusCode::kInvalidSyncCycleTime;
  // 0x60C2: value * 10^index seconds; only if the MainDevice wrote it.
  std::uint64_t period = objects_.get(obj::kInterpolationPeriod);
  const auto exponent = static_cast<std::int8_t>(objects_.get(obj::kInterpolationIndex));
  for (int i = std::max<int>(exponent, -9); i > -9; --i) period *= 10;
  if (period != 0 && period != cycle) return AlStatusCode::kInvalidSync0CycleTime;
  return AlStatusCode::kNoError;
}

void DriveApplication::on_outputs(std::uint64_t system_time, Duration now) noexcept {
  fresh_outputs_ = true;
  outputs_at_ = system_time;
  outputs_crystal_ = now;
  if (state_ != AlState::kOp && !op_requested_) return;
  const SyncManagerChannel channel = memory_.sync_manager(kOutputs);
  objects_.write_mapped(memory_.window(channel));
  if (synchronous_) return;
  // Free run: the frame itself is the sample instant.
  if (op_requested_) enter(AlState::kOp);
  sample_motor();
}

void DriveApplication::on_sync0(const Sync0Event& event) noexcept {
  const bool fresh = fresh_outputs_;
  fresh_outputs_ = false;
  ++sync0_since_request_;
  if (op_requested_) {
    good_cycles_ = fresh ? good_cycles_ + 1 : 0;
    if (good_cycles_ >= kGoodCyclesForOp) {
      enter(AlState::kOp);
      error_counter_ = 0;
      unsteady_ = 0;
    }
  } else if (state_ == AlState::kOp) {
    record_margin(event, fresh);
    supervise(event, fresh);
  }
  last_sync0_ = event.oscillator;
  sample_motor();
}

void DriveApplication::supervise(const Sync0Event& event, bool fresh) noexcept {
  if (fresh) {
    error_counter_ -= std::min<std::uint32_t>(error_counter_, 1);
  } else {
    error_counter_ += kMissWeight;
    objects_.set(obj::kEventMissed, objects_.get(obj::kEventMissed) + 1);
  }
  const double cycle = memory_.get<std::uint32_t>(reg::kSync0CycleTime);
  const double deviation = (event.oscillator - last_sync0_).ns() / cycle - 1.0;
  const bool steady = deviation < kSteadyDeviation && deviation > -kSteadyDeviation;
  unsteady_ = steady ? 0 : unsteady_ + 1;
  const std::uint32_t limit = objects_.get(obj::kSyncErrorLimit);
  const bool lost = limit != 0 && error_counter_ > limit;
  objects_.set(obj::kSyncError, lost ? 1 : 0);
  if (lost) {
    fail(AlStatusCode::kSynchronizationError);
  } else if (unsteady_ >= kUnsteadyCyclesForFault) {
    fail(AlStatusCode::kPllError);
  }
}

void DriveApplication::record_margin(const Sync0Event& event, bool fresh) noexcept {
  ++statistics_.events;
  if (!fresh) {
    ++statistics_.missed;
    return;
  }
  const auto margin = static_cast<std::int64_t>(event.system_time - outputs_at_);
  statistics_.last_margin_ns = margin;
  statistics_.smallest_margin_ns = std::min(statistics_.smallest_margin_ns, margin);
  statistics_.largest_margin_ns = std::max(statistics_.largest_margin_ns, margin);
  const auto cycle = std::max<std::int64_t>(memory_.get<std::uint32_t>(reg::kSync0CycleTime), 1);
  constexpr auto kLast = static_cast<std::int64_t>(SyncStatistics::kBins) - 1;
  const std::int64_t bin = std::clamp<std::int64_t>(margin * (kLast + 1) / cycle, 0, kLast);
  ++statistics_.histogram[static_cast<std::size_t>(bin)];
}

void DriveApplication::sample_motor() noexcept {
  if (state_ == AlState::kOp) {
    motor_.control(static_cast<std::uint16_t>(objects_.get(obj::kControlword)), true);
    motor_.sample(objects_.get_signed(obj::kTargetPosition),
                  static_cast<std::int8_t>(objects_.get(obj::kMode)));
    objects_.set(obj::kModeDisplay, objects_.get(obj::kMode));
  }
  publish_inputs();
}

void DriveApplication::publish_inputs() noexcept {
  objects_.set(obj::kStatusword, motor_.statusword());
  objects_.set(obj::kPositionActual, static_cast<std::uint32_t>(motor_.position()));
  objects_.set(obj::kVelocityActual, static_cast<std::uint32_t>(motor_.velocity_per_sample()));
  objects_.set(obj::kFollowingError, static_cast<std::uint32_t>(motor_.following_error()));
  objects_.set(obj::kErrorCode, motor_.error_code());
  if (state_ != AlState::kSafeOp && state_ != AlState::kOp) return;
  objects_.read_mapped(memory_.window(memory_.sync_manager(kInputs)));
}

void DriveApplication::show_stamps(std::uint64_t internal,
                                   std::optional<std::uint64_t> external) noexcept {
  constexpr std::uint32_t kPrimaryIsMaster = 2;
  objects_.set(obj::kOtherSideMissing, external ? 0 : 1);
  objects_.set(obj::kSyncMode, external ? kPrimaryIsMaster : 0);
  if (external) {
    objects_.set(obj::kStampsUpdated, objects_.get(obj::kStampsUpdated) ^ 1U);
    objects_.set(obj::kInternalStamp, internal);
    objects_.set(obj::kExternalStamp, *external);
  }
  publish_inputs();
}

Duration DriveApplication::watchdog_time() const noexcept {
  constexpr std::int64_t kTick = 40;  // ns, 25 MHz
  const std::int64_t divider = memory_.get<std::uint16_t>(reg::kWatchdogDivider) + 2;
  const std::int64_t time = memory_.get<std::uint16_t>(reg::kWatchdogTimeProcessData);
  return Duration::from_whole_ns(divider * kTick * time);
}

void DriveApplication::tick(Duration now) noexcept {
  if (op_requested_ && now > op_deadline_) {
    if (!synchronous_) {
      fail(AlStatusCode::kSyncManagerWatchdog);
    } else {
      fail(sync0_since_request_ == 0 ? AlStatusCode::kNoSyncError
                                     : AlStatusCode::kSynchronizationError);
    }
  }
  const Duration limit = watchdog_time();
  const SyncManagerChannel outputs = memory_.sync_manager(kOutputs);
  const bool watched = outputs.active && outputs.watchdog() && limit > Duration{};
  const bool expired = watched && now - outputs_crystal_ > limit;
  if (expired && state_ == AlState::kOp) {
    const auto count = memory_.get<std::uint8_t>(reg::kWatchdogCounter);
    memory_.set(reg::kWatchdogCounter,
                static_cast<std::uint8_t>(count == 0xFF ? count : count + 1));
    fail(AlStatusCode::kSyncManagerWatchdog);
  }
  memory_.set(reg::kWatchdogStatus, static_cast<std::uint16_t>(expired ? 0 : 1));
}

Sdo DriveApplication::answer(const Sdo& request, ObjectDictionary::Upload& upload) noexcept {
  Sdo reply;
  reply.object = request.object;
  reply.counter = request.counter;
  SdoAbort abort = SdoAbort::kNone;
  if (request.complete_access) {
    abort = SdoAbort::kUnsupportedAccess;
  } else if (request.kind == SdoKind::kDownloadRequest) {
    reply.kind = SdoKind::kDownloadResponse;
    abort = objects_.download(request.object, request.data, state_ == AlState::kPreOp);
  } else if (request.kind == SdoKind::kUploadRequest) {
    reply.kind = SdoKind::kUploadResponse;
    upload = objects_.upload(request.object);
    abort = upload.abort;
    reply.data = ConstBytes{upload.bytes}.first(upload.size);
  } else {
    abort = SdoAbort::kUnknownCommand;
  }
  if (abort != SdoAbort::kNone) {
    reply.kind = SdoKind::kAbort;
    reply.abort = abort;
    reply.data = {};
  }
  return reply;
}

void DriveApplication::serve_mailbox() noexcept {
  if (state_ == AlState::kInit) return;
  if (!memory_.mailbox_full(kMailboxOut) || memory_.mailbox_full(kMailboxIn)) return;
  const Bytes request = memory_.window(memory_.sync_manager(kMailboxOut));
  const Bytes reply = memory_.window(memory_.sync_manager(kMailboxIn));
  memory_.set_mailbox_full(kMailboxOut, false);
  const auto sdo = decode_sdo(request);
  bool answered = false;
  if (sdo) {
    ObjectDictionary::Upload upload;
    answered = encode_sdo(reply, answer(*sdo, upload));
  } else if (sdo.error() == MailboxError::kNotCoe && reply.size() >= kMailboxHeaderSize + 4) {
    // Mailbox error reply: unsupported protocol (ETG.1000.4, 5.6, type 0).
    std::fill(reply.begin(), reply.end(), std::uint8_t{0});
    store(reply, 0, std::uint16_t{4});
    store(reply, kMailboxHeaderSize, std::uint16_t{1});
    store(reply, kMailboxHeaderSize + 2, std::uint16_t{2});
    answered = true;
  } else {
    Sdo abort;
    abort.kind = SdoKind::kAbort;
    abort.abort = SdoAbort::kUnknownCommand;
    answered = encode_sdo(reply, abort);
  }
  memory_.set_mailbox_full(kMailboxIn, answered);
}

}  // namespace ftcs::ethercat
