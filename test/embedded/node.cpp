// SPDX-License-Identifier: MIT
// A whole node on a bare-metal Cortex-M with an emulated Ethernet (MPS2: SMSC LAN9118): the
// sans-I/O PTP receiver over IEEE 802.3 and ftcs_addend, with an addend clock in software on a
// timer of the board. Ends with 0 when it is locked. Stamps are taken in the adapter's interrupt,
// and as the last word of a frame is given to it: the emulation's scheduling is their noise.
#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>

#include "board.h"
#include "ftcs/ptp/time_receiver.h"
#include "ftcs_addend.h"
#include "lan9118.h"

void operator delete(void*) noexcept {}
void operator delete(void*, std::size_t) noexcept {}

namespace {
using namespace ftcs;

constexpr std::uint32_t kNominal = 1U << 31;
constexpr std::uint32_t kLockNs = 1'000'000;

// The board's first CMSDK timer, 32 bits at 25 MHz, made 64 bits by whoever asks once in two
// minutes.
class Timer {
 public:
  Timer() {
    timer()[2] = UINT32_MAX;
    timer()[1] = UINT32_MAX;
    timer()[0] = 1;
    last_ = count();
  }
  static std::uint32_t count() { return ~timer()[1]; }
  [[nodiscard]] std::int64_t ns() {
    const std::uint32_t now = count();
    ticks_ += now - last_;
    last_ = now;
    return ticks_ * 40;
  }
  // When it counted `then`, lately.
  [[nodiscard]] std::int64_t ns_at(std::uint32_t then) {
    return ns() - static_cast<std::int64_t>(last_ - then) * 40;
  }

 private:
  static volatile std::uint32_t* timer() {
    return reinterpret_cast<volatile std::uint32_t*>(0x40000000U);
  }
  std::uint32_t last_ = 0;
  std::int64_t ticks_ = 0;
};

// The frames that came, with the timer's count at the interrupt: a Sync comes while the Announce
// before it is being read, which takes milliseconds the first time, when QEMU translates the code.
class Arrivals {
 public:
  static void start() {
    at(0xE000E014U) = 25'000 - 1;  // SysTick: a millisecond,
    at(0xE000E018U) = 0;
    at(0xE000E010U) = 7;         // with its exception
    at(0xE000E100U) = 1U << 13;  // NVIC: the Ethernet adapter's interrupt
  }
  static void on_interrupt() {
    const std::uint32_t now = Timer::count();
    lan9118_acknowledge();
    const std::uint32_t waiting = lan9118_frames();
    while (came_ - taken_ < waiting) {
      counts_[came_ % kRoom] = now;
      came_ = came_ + 1;
    }
  }
  // Until something has come, a millisecond at most. A processor that polls instead has the
  // emulation's lock nearly always, and the emulated adapter gets its frames late.
  static void wait() { __asm volatile("wfi" ::: "memory"); }

  // The size of the next frame, or zero.
  static std::size_t take(std::span<std::uint8_t> frame, std::uint32_t& count) {
    __asm volatile("cpsid i" ::: "memory");
    std::size_t size = 0;
    if (came_ != taken_) {
      count = counts_[taken_++ % kRoom];
      size = lan9118_receive(frame.data(), frame.size());
    }
    __asm volatile("cpsie i" ::: "memory");
    return size;
  }

 private:
  static volatile std::uint32_t& at(std::uint32_t address) {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
  }
  static constexpr std::uint32_t kRoom = 64;  // a second has four
  static inline std::array<std::uint32_t, kRoom> counts_{};
  static inline volatile std::uint32_t came_ = 0;
  static inline std::uint32_t taken_ = 0;
};

// What a MAC has in silicon: a time that runs at addend / nominal of the timer, and an alarm on it.
class AddendRegister {
 public:
  [[nodiscard]] std::int64_t at(std::int64_t raw_ns) {
    const std::int64_t now = local_ + made_until(raw_ns);
    if (now >= until_) {  // the alarm
      until_ = INT64_MAX;
      write(raw_ns, next_);
    }
    return now;
  }
  void obey(std::int64_t raw_ns, const ftcs_addend_command& command) {
    local_ = at(raw_ns) + command.step_ns;
    raw_ = raw_ns;
    addend_ = command.addend;
    next_ = command.next_addend;
    until_ = command.until_ns;
  }

 private:
  // Since the last write, or a little before it: addend / nominal is within 1 % of one.
  [[nodiscard]] std::int64_t made_until(std::int64_t raw_ns) const {
    const std::int64_t gone = raw_ns - raw_;
    return gone + ((gone * (static_cast<std::int64_t>(addend_) - kNominal)) >> 31);
  }
  void write(std::int64_t raw_ns, std::uint32_t addend) {
    local_ += made_until(raw_ns);
    raw_ = raw_ns;
    addend_ = addend;
  }
  std::int64_t raw_ = 0;
  std::int64_t local_ = 0;
  std::int64_t until_ = INT64_MAX;
  std::uint32_t addend_ = kNominal;
  std::uint32_t next_ = kNominal;
};

// Outside of 200 us the whole offset is removed at once: the noise of the emulation is not for p.
const ftcs_addend_config kServo = [] {
  ftcs_addend_config config = ftcs_addend_default_config(kNominal);
  config.limit_ppm = 10'000;
  config.plausible_ppm = 100'000;
  config.band_enter_ns = 200'000;
  config.band_leave_ns = 1'000'000;
  config.lock_enter_ns = kLockNs;
  config.lock_leave_ns = 2 * kLockNs;
  config.step_ns = 10'000'000;
  return config;
}();

class Node {
 public:
  Node() : receiver_(config()) {
    if (ftcs_addend_init(&servo_, &kServo, kNominal) != FTCS_ADDEND_OK) {
      board_write("configuration refused\n");
    }
  }

  bool run() {
    lan9118_start();
    Arrivals::start();
    handle(receiver_.start(now()));
    while (timer_.ns() < 30'000'000'000 && !locked_) {
      Arrivals::wait();
      static_cast<void>(clock_.at(timer_.ns()));
      std::uint32_t came = 0;
      while (const std::size_t size = Arrivals::take(frame_, came)) {
        if (size > 14) receive(size, timer_.ns_at(came));
      }
      if (receiver_.deadline() && *receiver_.deadline() <= now()) handle(receiver_.on_timer(now()));
    }
    return locked_;
  }

 private:
  static ptp::TimeReceiverConfig config() {
    ptp::TimeReceiverConfig c;
    c.port = {{0x02, 0x00, 0x5E, 0xFF, 0xFE, 0x00, 0x01, 0x19}, 1};
    c.fast_start = true;
    c.log_min_delay_req_interval = -2;
    return c;
  }
  FreeRunningTime now() { return FreeRunningTime::from_ns(timer_.ns()); }

  // The steered clock's reading beside the timer's, kept until a Follow_Up or a Delay_Resp asks for
  // it.
  FreeRunningTime stamp(std::int64_t raw) {
    stamps_[next_stamp_++ % stamps_.size()] = {raw, clock_.at(raw)};
    return FreeRunningTime::from_ns(raw);
  }
  std::int64_t local_of(FreeRunningTime stamp) const {
    for (const auto& known : stamps_) {
      if (known.raw == stamp.since_epoch().floor_ns()) return known.local;
    }
    return 0;
  }

  void receive(std::size_t size, std::int64_t came) {
    if (frame_[12] != 0x88 || frame_[13] != 0xF7) return;
    const std::span<const std::uint8_t> message(frame_.data() + 14, size - 14);
    if ((message[0] & 0x0FU) < 8) {
      if ((message[0] & 0x0FU) == 0) ++syncs_;
      const FreeRunningTime received = stamp(came);
      handle(receiver_.on_event_message(message, received, received));
    } else {
      handle(receiver_.on_general_message(message, now()));
    }
  }

  void handle(const ptp::ActionList& actions) {
    for (const ptp::Action& action : actions) {
      if (const auto* send = std::get_if<ptp::SendMessage>(&action)) transmit(*send);
      if (const auto* emit = std::get_if<ptp::EmitPair>(&action)) steer(emit->pair);
    }
  }

  void transmit(const ptp::SendMessage& send) {
    static constexpr std::array<std::uint8_t, 14> kHeader{0x01, 0x1B, 0x19, 0,    0,    0,    0x02,
                                                          0,    0x5E, 0,    0x01, 0x19, 0x88, 0xF7};
    std::array<std::uint8_t, 128> out{};
    std::size_t size = 0;
    for (const std::uint8_t octet : kHeader) out[size++] = octet;
    for (const std::uint8_t octet : send.bytes.view()) out[size++] = octet;
    // Whoever gets the frame may run before the emulation goes on: stamped before.
    const std::uint32_t last = lan9118_load(out.data(), size < 60 ? 60 : size);
    const std::int64_t went = timer_.ns();
    lan9118_go(last);
    if (send.channel != ptp::Channel::kEvent) return;
    const FreeRunningTime sent = stamp(went);
    handle(receiver_.on_transmit_timestamp(send.id(), sent, sent));
  }

  void steer(const EventPair& pair) {
    const std::int64_t local = local_of(pair.free_running);
    const std::int64_t reference = pair.reference.since_epoch().floor_ns();
    if (pair.direction == Direction::kBackward) {
      // ((t4 - t1) - (t3 - t2)) / 2, t3 - t2 in reference time
      if (servo_.phase != 0)
        path_delay_ =
            ((reference - servo_.origin_ns) * 65'536 - ftcs_addend_elapsed(&servo_, local)) / 2;
      return;
    }
    const std::int64_t raw = timer_.ns();
    const ftcs_addend_sample sample = {reference, local, clock_.at(raw), path_delay_, 0, 0};
    const ftcs_addend_command command = ftcs_addend_update(&servo_, &sample);
    if (command.act != 0) clock_.obey(raw, command);
    say(command);
    locked_ = command.state == FTCS_ADDEND_LOCKED;
  }

  void say(const ftcs_addend_command& command) const {
    board_text("Sync ");
    board_decimal(syncs_);
    board_text(" offset ");
    board_decimal(command.offset_ns);
    board_text(" ns, step ");
    board_decimal(command.step_ns);
    board_text(" ns, path delay ");
    board_decimal(path_delay_ / 65'536);
    board_text(" ns, rate ");
    board_decimal(ftcs_addend_rate_ppb(&servo_));
    board_text(" ppb: ");
    board_text(ftcs_addend_state_name(command.state));
    board_end_line();
  }

  struct Stamp {
    std::int64_t raw = -1;
    std::int64_t local = 0;
  };
  Timer timer_;
  AddendRegister clock_;
  ptp::TimeReceiver receiver_;
  ftcs_addend_servo servo_{};
  std::array<Stamp, 8> stamps_{};
  std::size_t next_stamp_ = 0;
  std::array<std::uint8_t, 1536> frame_{};
  std::int64_t path_delay_ = 0;
  int syncs_ = 0;  // heard, the transmitter's first one included
  bool locked_ = false;
};

}  // namespace

void board_ethernet_interrupt(void) { Arrivals::on_interrupt(); }

int main() {
  static Node node;
  const bool locked = node.run();
  board_write(locked ? "locked\n" : "not locked\n");
  return locked ? 0 : 1;
}
