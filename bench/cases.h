// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

#include "bench/ethercat_cases.h"
#include "ftcs/clock/virtual_clock.h"
#include "ftcs/discipline/clock_discipline.h"
#include "ftcs/measurement/outlier_gate.h"
#include "ftcs/measurement/path_delay_estimator.h"
#include "ftcs/platform/keyed_code.h"
#include "ftcs/ptp/security_association.h"
#include "ftcs/ptp/wire/codec.h"
#include "ftcs/servo/any_servo.h"

namespace ftcs::bench {

/// A reference and an oscillator that is 50 ppm fast, seen every 125 ms with some 100 ns of
/// bell-shaped jitter, each direction its own: what a servo in steady state is given. Integer
/// arithmetic: its few instructions are part of every figure, and `input_alone` says how much that
/// is. With a load a message finds a frame of 120 us on its way that often, each way, and waits for
/// what is left of it.
class World {
 public:
  explicit World(unsigned load_percent = 0) noexcept : load_percent_{load_percent} {}

  void next() noexcept {
    origin_ns_ += kIntervalNs;
    const std::int64_t ahead = jitter() + wait();
    back_ns_ = jitter();
    back_wait_ns_ = wait();
    free_running_ns_ = origin_ns_ + origin_ns_ / 20'000;
    received_ns_ = free_running_ns_ + ahead;
    local_ns_ = origin_ns_ + kPathDelayNs + ahead;
  }
  [[nodiscard]] ReferenceTime origin() const noexcept { return ReferenceTime::from_ns(origin_ns_); }
  [[nodiscard]] FreeRunningTime received() const noexcept {
    return FreeRunningTime::from_ns(received_ns_);
  }
  [[nodiscard]] LocalTime local() const noexcept { return LocalTime::from_ns(local_ns_); }
  [[nodiscard]] SyncSample sample() const noexcept {
    return {origin(), Nanoseconds{kPathDelayNs}, local(), received()};
  }
  [[nodiscard]] ClockReading now() const noexcept {
    return {FreeRunningTime::from_ns(received_ns_ + kLatencyNs),
            LocalTime::from_ns(local_ns_ + kLatencyNs)};
  }
  [[nodiscard]] EventPair forward() const noexcept {
    return {Direction::kForward, origin(), received()};
  }
  [[nodiscard]] EventPair backward() const noexcept {
    return {Direction::kBackward,
            ReferenceTime::from_ns(origin_ns_ + 2 * kPathDelayNs + kTurnaroundNs + back_wait_ns_),
            FreeRunningTime::from_ns(free_running_ns_ + back_ns_ + kTurnaroundNs)};
  }

 private:
  static constexpr std::int64_t kIntervalNs = 125'000'000;
  static constexpr std::int64_t kPathDelayNs = 10'000;
  static constexpr std::int64_t kLatencyNs = 30'000;
  static constexpr std::int64_t kTurnaroundNs = 1'000'000;
  static constexpr std::uint32_t kFrameNs = 120'000;

  /// Sum of three bytes: mean zero, standard deviation 128 ns.
  std::int64_t jitter() noexcept {
    jitter_state_ = jitter_state_ * 1664525U + 1013904223U;
    const std::uint32_t sum =
        (jitter_state_ >> 24U) + ((jitter_state_ >> 16U) & 255U) + ((jitter_state_ >> 8U) & 255U);
    return static_cast<std::int64_t>(sum) - 382;
  }

  /// ns; 0 without a load, and no number is drawn.
  std::int64_t wait() noexcept {
    if (load_percent_ == 0) return 0;
    if (random() % 100U >= load_percent_) return 0;
    return static_cast<std::int64_t>(random() % kFrameNs);
  }

  /// xorshift64 (Marsaglia, Journal of Statistical Software 8, 2003), its upper half.
  std::uint32_t random() noexcept {
    wait_state_ ^= wait_state_ << 13U;
    wait_state_ ^= wait_state_ >> 7U;
    wait_state_ ^= wait_state_ << 17U;
    return static_cast<std::uint32_t>(wait_state_ >> 32U);
  }

  std::int64_t origin_ns_ = 0;
  std::int64_t free_running_ns_ = 0;
  std::int64_t received_ns_ = 0;
  std::int64_t back_ns_ = 0;
  std::int64_t back_wait_ns_ = 0;
  std::int64_t local_ns_ = 0;
  std::uint32_t jitter_state_ = 1;
  std::uint64_t wait_state_ = 88172645463325252ULL;
  unsigned load_percent_ = 0;
};

struct InputCase {
  World world{};
  SyncSample step() noexcept {
    world.next();
    return world.sample();
  }
};

/// One update of a control law.
template <class Law>
struct LawCase {
  World world{};
  Law law{typename Law::Config{}};
  ServoUpdate step() noexcept {
    world.next();
    return law.update(world.sample(), world.now());
  }
};

/// One forward message through gate, path delay and control law.
struct TwoWayCase {
  World world{};
  AnyServo servo = make_servo({.kind = ServoKind::kFtcs});
  ServoUpdate step() noexcept {
    world.next();
    const EventPair pair = world.backward();
    (void)servo.update({pair.direction, pair.reference, {}, pair.free_running}, world.now());
    return servo.update({Direction::kForward, world.origin(), world.local(), world.received()},
                        world.now());
  }
};

/// One message, of alternating direction, into a whole servo.
template <class Servo, unsigned kLoadPercent = 0>
struct MessageCase {
  World world{kLoadPercent};
  Servo servo{typename Servo::Config{}};
  bool forward = false;
  ServoUpdate step() noexcept {
    prepare();
    return update();
  }
  void prepare() noexcept {
    forward = !forward;
    if (forward) world.next();
  }
  ServoUpdate update() noexcept {
    if (forward) {
      return servo.update({Direction::kForward, world.origin(), world.local(), world.received()},
                          world.now());
    }
    const EventPair pair = world.backward();
    return servo.update({pair.direction, pair.reference, {}, pair.free_running}, world.now());
  }
};

struct BenchSource final : FreeRunningSource {
  World world{};
  [[nodiscard]] FreeRunningTime now() noexcept override { return world.now().free_running; }
};

/// One cycle of the whole way from the protocol's pairs to the clock's registers: Sync, Delay_Req,
/// command.
struct DisciplineCase {
  BenchSource source{};
  VirtualClock clock{source, {.free_running = {}, .local = {}, .rate = {}, .limits = {}}};
  ClockDiscipline discipline{DisciplineConfig{{}, {.kind = ServoKind::kFtcs}}, clock};
  Telemetry step() noexcept {
    source.world.next();
    (void)discipline.on_pair(source.world.forward());
    return discipline.on_pair(source.world.backward());
  }
};

struct ClockApplyCase {
  BenchSource source{};
  VirtualClock clock{source, {.free_running = {}, .local = {}, .rate = {}, .limits = {}}};
  LocalTime step() noexcept {
    source.world.next();
    const auto taken = clock.apply({.correction_rate = Rate::from_ppm(100.0),
                                    .correction_time = Nanoseconds{125'000'000},
                                    .tracking_rate = Rate::from_ppm(50.0),
                                    .step = {}});
    return taken->local;
  }
};

struct ClockReadCase {
  BenchSource source{};
  VirtualClock clock{source,
                     {.free_running = {}, .local = {}, .rate = Rate::from_ppm(50.0), .limits = {}}};
  LocalTime step() noexcept {
    source.world.next();
    return clock.read().local;
  }
};

struct GateCase {
  World world{};
  OutlierGate gate{};
  GateDecision step() noexcept {
    world.next();
    return gate.decide(world.local().since_epoch() - world.origin().since_epoch());
  }
};

struct PathDelayCase {
  World world{};
  PathDelayEstimator estimator{PathDelayConfig{}};
  Duration step() noexcept {
    world.next();
    estimator.on_forward(world.origin(), world.received());
    return estimator.on_backward(world.backward().free_running, world.backward().reference).raw;
  }
};

/// One message of the given body, as it comes from the socket.
template <class Body>
struct DecodeCase {
  ptp::MessageBytes bytes = ptp::encode(ptp::Message{ptp::Header{}, Body{}}).value();
  Result<ptp::Message, ptp::DecodeError> step() noexcept {
    ++bytes.octets[31];  // another sequenceId each time
    return ptp::decode(bytes.view());
  }
};

/// A key of each type of the sa_file, as a port has it.
template <platform::CodeKind kKind>
struct KeyCase {
  KeyCase() {
    constexpr std::array<std::uint8_t, 32> kKey{1, 2, 3};
    const std::size_t size = platform::key_octets(kKind);
    code =
        std::move(*platform::KeyedCode::open(kKind, std::span(kKey).first(size == 0 ? 32 : size)));
    association.active_key_id = 1;
    association.add({1, platform::code_octets(kKind), code.get()});
  }
  std::unique_ptr<platform::KeyedCode> code;
  ptp::SecurityAssociation association{};
  ptp::MessageBytes plain = ptp::encode(ptp::Message{ptp::Header{}, ptp::Sync{}}).value();
};

/// A Sync gets its authentication code.
template <platform::CodeKind kKind>
struct SealCase : KeyCase<kKind> {
  bool step() noexcept {
    ++this->plain.octets[31];
    ptp::MessageBytes message = this->plain;
    return ptp::seal(this->association, message);
  }
};

/// The code of a Sync is verified.
template <platform::CodeKind kKind>
struct AuthenticateCase : KeyCase<kKind> {
  AuthenticateCase() { static_cast<void>(ptp::seal(this->association, this->plain)); }
  ptp::Authenticity step() noexcept {
    return ptp::authenticate(this->association, this->plain.view());
  }
};

/// Calls visit(name, std::type_identity of the case) for each case: none is made that is not asked
/// for, some take a bring-up.
template <class Visit>
void for_each_case(const Visit& visit) {
  visit("input_alone", std::type_identity<InputCase>{});
  visit("ftcs_update", std::type_identity<LawCase<FtcsServo>>{});
  visit("pics_update", std::type_identity<LawCase<PicsServo>>{});
  visit("linuxptp_pi_update", std::type_identity<LawCase<LinuxptpPiServo>>{});
  visit("adaptive_message", std::type_identity<MessageCase<AdaptiveServo>>{});
  visit("adaptive_message_load_40", std::type_identity<MessageCase<AdaptiveServo, 40>>{});
  visit("adaptive_message_load_80", std::type_identity<MessageCase<AdaptiveServo, 80>>{});
  visit("small_adaptive_message", std::type_identity<MessageCase<SmallAdaptiveServo>>{});
  visit("kalman_message", std::type_identity<MessageCase<KalmanServo>>{});
  visit("regression_update", std::type_identity<LawCase<RegressionServo>>{});
  visit("pid_update", std::type_identity<LawCase<PidServo>>{});
  visit("frequency_compensated_update", std::type_identity<LawCase<FrequencyCompensatedServo>>{});
  visit("two_way_servo_cycle", std::type_identity<TwoWayCase>{});
  visit("discipline_cycle", std::type_identity<DisciplineCase>{});
  visit("virtual_clock_apply", std::type_identity<ClockApplyCase>{});
  visit("virtual_clock_read", std::type_identity<ClockReadCase>{});
  visit("outlier_gate", std::type_identity<GateCase>{});
  visit("path_delay_exchange", std::type_identity<PathDelayCase>{});
  visit("decode_sync", std::type_identity<DecodeCase<ptp::Sync>>{});
  visit("decode_follow_up", std::type_identity<DecodeCase<ptp::FollowUp>>{});
  visit("decode_delay_resp", std::type_identity<DecodeCase<ptp::DelayResp>>{});
  visit("decode_announce", std::type_identity<DecodeCase<ptp::Announce>>{});
  using platform::CodeKind;
  visit("seal_sha256_128", std::type_identity<SealCase<CodeKind::kHmacSha256Truncated>>{});
  visit("authenticate_sha256_128",
        std::type_identity<AuthenticateCase<CodeKind::kHmacSha256Truncated>>{});
  visit("authenticate_sha256", std::type_identity<AuthenticateCase<CodeKind::kHmacSha256>>{});
  visit("authenticate_aes128", std::type_identity<AuthenticateCase<CodeKind::kCmacAes128>>{});
  visit("ethercat_wire_alone", std::type_identity<EthercatWireCase>{});
  visit("ethercat_cycle_ftcs", std::type_identity<EthercatCycleCase<CycleLaw::kFtcs>>{});
  visit("ethercat_cycle_adaptive", std::type_identity<EthercatCycleCase<CycleLaw::kAdaptive>>{});
  visit("ethercat_cycle_plant_time", std::type_identity<EthercatPlantTimeCase>{});
}

}  // namespace ftcs::bench
