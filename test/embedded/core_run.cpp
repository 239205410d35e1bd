// SPDX-License-Identifier: MIT
// Servos of the core steering a model of an addend clock, the same stamps on every machine: a hash
// over the bits of every command, so that x86 and a Cortex-M can be compared.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <new>

#include "board.h"
#include "ftcs/clock/addend_clock.h"
#include "ftcs/clock/register_clock.h"
#include "ftcs/discipline/ftcs_cycle_servo.h"
#include "ftcs/estimation/elementary.h"
#include "ftcs/servo/adaptive/adaptive_servo.h"
#include "ftcs/servo/ftcs_servo.h"
#include "ftcs/servo/linuxptp_pi_servo.h"
#include "ftcs/servo/pics_servo.h"
#include "ftcs/servo/two_way_servo.h"

// Nothing is deleted; the core has no destructor that would need this, and no image may link a
// heap.
#ifdef __arm__
void operator delete(void*) noexcept {}
void operator delete(void*, std::size_t) noexcept {}
#endif

namespace {
using namespace ftcs;

constexpr std::int64_t kInterval = 125'000'000;
constexpr int kSamples = 300;

class Hash {
 public:
  void add(std::uint64_t value) { value_ = (value_ ^ value) * 0x100000001b3U ^ (value >> 29); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(Duration d) {
    add(static_cast<std::uint64_t>(d.floor_ns()));
    add(std::uint64_t{d.fraction()});
  }
  void print(const char* name) const {
    board_text(name);
    board_text(" hash ");
    board_hex(value_);
    board_end_line();
  }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

class Source final : public FreeRunningSource {
 public:
  [[nodiscard]] FreeRunningTime now() noexcept override { return now_; }
  void advance(std::int64_t ns) { now_ = now_ + Nanoseconds{ns}; }

 private:
  FreeRunningTime now_ = FreeRunningTime::from_ns(1'000'000'000'000);
};

// Integers only: the sum of twelve bytes is bell-shaped enough.
class Noise {
 public:
  std::int64_t next() {
    std::int64_t sum = -1530;
    for (int i = 0; i < 12; ++i) {
      state_ = state_ * 6364136223846793005U + 1442695040888963407U;
      sum += static_cast<std::int64_t>(state_ >> 56);
    }
    return sum / 7;
  }

 private:
  std::uint64_t state_ = 1;
};

struct World {
  Source source;
  AddendClock clock;
  Noise noise;
  std::int64_t reference = 1'700'000'000'000'000'000;

  World() : clock(source, config(source.now(), reference)) {}
  static AddendClockConfig config(FreeRunningTime now, std::int64_t reference) {
    AddendClockConfig c;
    c.nominal_frequency_hz = 168'000'000;
    c.increment = Nanoseconds{20};
    c.free_running = now;
    c.local = LocalTime::from_ns(reference + 1'000'000);
    return c;
  }
  void advance() {
    source.advance(kInterval + 6'250);  // 50 ppm fast
    reference += kInterval;
  }
};

// Three programs' worth of objects, one at a time: a Cortex-M has no stack for the largest.
alignas(std::max_align_t) std::byte world_place[sizeof(World)];
alignas(std::max_align_t) std::byte servo_place[32'768];

void add(Hash& hash, const ServoUpdate& update) {
  hash.add(static_cast<std::uint64_t>(update.verdict));
  hash.add(update.command.correction_rate.ratio());
  hash.add(update.command.tracking_rate.ratio());
  hash.add(update.command.correction_time);
}

template <class Law>
void run_law(const char* name) {
  World& world = *new (world_place) World;
  static_assert(sizeof(Law) <= sizeof servo_place);
  Law& law = *new (servo_place) Law;
  Hash hash;
  for (int n = 0; n < kSamples; ++n) {
    const FreeRunningTime stamp = world.source.now() + Nanoseconds{world.noise.next()};
    const SyncSample sample{ReferenceTime::from_ns(world.reference - 500), Nanoseconds{500},
                            world.clock.local_at(stamp), stamp};
    const ServoUpdate update = law.update(sample, world.clock.read());
    if (update.has_command) hash.add(std::uint64_t{world.clock.apply(update.command).ok()});
    add(hash, update);
    world.advance();
  }
  hash.print(name);
}

template <class Servo, class... Configs>
void run_servo(const char* name, const Configs&... configs) {
  World& world = *new (world_place) World;
  static_assert(sizeof(Servo) <= sizeof servo_place);
  Servo& servo = *new (servo_place) Servo(configs...);
  Hash hash;
  for (int n = 0; n < 2 * kSamples; ++n) {
    const bool forward = n % 2 == 0;
    const std::int64_t way = world.noise.next() + (forward ? 500 : -500);
    const FreeRunningTime stamp = world.source.now() + Nanoseconds{way};
    const TimestampPair pair{forward ? Direction::kForward : Direction::kBackward,
                             ReferenceTime::from_ns(world.reference), world.clock.local_at(stamp),
                             stamp};
    const ServoUpdate update = servo.update(pair, world.clock.read());
    if (update.has_command) hash.add(std::uint64_t{world.clock.apply(update.command).ok()});
    add(hash, update);
    if (!forward) world.advance();
  }
  hash.print(name);
}

// Registers as hardware has them: the steered face alone can be read.
class Registers final : public AddendRegister {
 public:
  explicit Registers(Source& source) : source_(source) {}
  [[nodiscard]] LocalTime now() noexcept override { return line_(source_.now()); }
  void write(std::uint32_t addend) noexcept override {
    line_ =
        line_.continued(source_.now(), Rate::from_ratio(static_cast<double>(addend) / kNominal));
  }
  void step(Duration by) noexcept override { line_ = line_.stepped(by); }
  void alarm(LocalTime) noexcept override {}

  static constexpr std::uint32_t kNominal = 0x4C30C30C;

 private:
  Source& source_;
  AffineMap<FreeRunningTime, LocalTime> line_{
      source_.now(), LocalTime::from_ns(1'700'000'000'001'000'000), Rate{}};
};

void run_register_clock(const char* name) {
  Source source;
  Registers registers(source);
  RegisterClock& clock = *new (world_place) RegisterClock(
      registers, {Registers::kNominal, Registers::kNominal, RateLimits::symmetric_ppb(1e8)});
  static_assert(sizeof(RegisterClock) <= sizeof world_place);
  FtcsServo& servo = *new (servo_place) FtcsServo;
  Noise noise;
  Hash hash;
  std::int64_t reference = 1'700'000'000'000'000'000;
  for (int n = 0; n < kSamples; ++n) {
    const LocalTime stamp = registers.now() + Nanoseconds{noise.next()};
    source.advance(300'000);
    const ServoUpdate update = servo.update(
        {ReferenceTime::from_ns(reference), Duration{}, stamp, clock.from_stamp(stamp)},
        clock.read());
    if (update.has_command) hash.add(std::uint64_t{clock.apply(update.command).ok()});
    hash.add(std::uint64_t{clock.addend()});
    add(hash, update);
    source.advance(kInterval + 6'250 - 300'000);
    clock.on_alarm();
    reference += kInterval;
  }
  hash.print(name);
}

void run_elementary(const char* name) {
  Hash hash;
  for (int n = 0; n < 20'000; ++n) {
    const double x = n * 0.03125 + 0.001;
    hash.add(estimation::portable_exp(x - 300.0));
    hash.add(estimation::portable_log(x));
    hash.add(estimation::scaled_erfc(x));
  }
  hash.print(name);
}

void run_cycle_servo(const char* name, std::int32_t law) {
  auto& servo = *new (servo_place) ftcs_cycle_servo;
  static_assert(sizeof(ftcs_cycle_servo) <= sizeof servo_place);
  ftcs_cycle_config config = ftcs_cycle_default_config();
  config.law = law;
  config.cycles_per_sync = 10;
  Hash hash;
  Noise noise;
  if (ftcs_cycle_init(&servo, sizeof servo, &config) != FTCS_CYCLE_OK)
    board_write("configuration refused\n");
  std::int64_t host = 5'000'000'000;
  ftcs_cycle_decision decision = ftcs_cycle_start(&servo, host);
  for (int n = 0; n < 10 * kSamples; ++n) {
    host = decision.wake_ns;
    const std::int64_t sent = host + 20'000 + noise.next();
    ftcs_cycle_sample sample{};
    sample.has_reference = 1;
    sample.sent_ns = sent;
    sample.reference_ns = 700'000'000'000 + sent + sent / 30'000;
    decision = ftcs_cycle_update(&servo, &sample, sent + 30'000);
    hash.add(static_cast<std::uint64_t>(decision.wake_ns));
    hash.add(decision.rate_ppb);
  }
  hash.print(name);
}

}  // namespace

int main() {
  run_law<FtcsServo>("ftcs");
  run_law<PicsServo>("pics");
  run_law<LinuxptpPiServo>("linuxptp-pi");
  run_servo<TwoWayServo<FtcsServo>>("two-way ftcs", TwoWayConfig{}, FtcsConfig{});
  run_register_clock("ftcs on an addend register");
  run_elementary("exp, log, scaled erfc");
  run_servo<SmallAdaptiveServo>("small adaptive", AdaptiveConfig{});
  run_servo<AdaptiveServo>("adaptive", AdaptiveConfig{});
  run_cycle_servo("cycle servo ftcs", FTCS_CYCLE_FTCS);
  run_cycle_servo("cycle servo adaptive", FTCS_CYCLE_ADAPTIVE);
  return 0;
}
