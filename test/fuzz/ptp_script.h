// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "ftcs/ptp/counters.h"
#include "ftcs/ptp/wire/byte_order.h"
#include "ftcs/ptp/wire/codec.h"
#include "test/fuzz/require.h"
#include "test/support/sum_code.h"

namespace ftcs::ptp {

/// The port that the scripts drive.
inline const PortIdentity kUs{ClockIdentity::from_mac({2, 0, 0, 0, 0, 1}), 1};

/// Octets as a script: what the scripts for both roles of a port draw from them. Plausible and
/// extreme values; what lies behind the end reads as zero.
class PtpScript {
 protected:
  explicit PtpScript(std::span<const std::uint8_t> octets) : octets_(octets), reader_(octets) {}

  [[nodiscard]] bool ended() const { return reader_.offset() >= octets_.size(); }
  std::uint8_t octet() { return reader_.read<std::uint8_t>(); }

  /// A length, and so many octets as they are.
  struct Raw {
    std::array<std::uint8_t, 255> bytes{};
    std::size_t size = 0;
    [[nodiscard]] std::span<const std::uint8_t> view() const { return {bytes.data(), size}; }
  };
  Raw raw() {
    Raw message;
    message.size = octet();
    for (std::size_t i = 0; i < message.size; ++i) message.bytes[i] = octet();
    return message;
  }
  PortIdentity port() {
    return {ClockIdentity::from_mac({2, 0, 0, 0, 0, static_cast<std::uint8_t>(octet() % 12)}), 1};
  }
  Duration correction() {
    const std::uint8_t choice = octet();
    if (choice < 64) return Duration::from_whole_ns(choice);
    if (choice < 128) return Duration::from_whole_ns(-std::int64_t{choice});
    return Duration::from_scaled_ns(std::int64_t{choice} << 55);
  }
  /// The last octet but one says whether the port has keys.
  [[nodiscard]] const SecurityAssociation* keys() const {
    const bool wanted = octets_.size() > 1 && octets_[octets_.size() - 2] % 4 == 3;
    return wanted ? &keys_.association : nullptr;
  }
  /// Most messages to a port with keys have a code; the interval says whether.
  void authenticate(MessageBytes& bytes) {
    constexpr std::size_t kInterval = 33;
    if (keys() == nullptr || bytes.octets[kInterval] % 16 == 1) return;
    keys_.association.active_key_id = bytes.octets[kInterval] % 16 == 2 ? 1 : 2;
    fuzz::require(seal(keys_.association, bytes), "the code fits behind each message");
    keys_.association.active_key_id = 2;
  }
  /// Near the right time, a jump away, or at an end of what a Timestamp can hold.
  ReferenceTime time() {
    using namespace std::chrono_literals;
    const std::uint8_t choice = octet();
    if (choice == 255) return ReferenceTime::from_ns(std::numeric_limits<std::int64_t>::max());
    if (choice == 254) return {};
    const Duration jump{1s * (choice > 200 ? int{choice} - 227 : 0)};
    return ReferenceTime{now_.since_epoch() + jump + Duration{100us * int{choice}}};
  }

  /// Asked after each input; its own comparisons tell the fuzzer nothing and would be half of the
  /// time.
  [[clang::no_sanitize("coverage")]] void require_growth(const Counters& counters) {
    for (std::size_t i = 0; i < kCounters; ++i) {
      const auto counter = static_cast<Counter>(i);
      fuzz::require(counters[counter] >= before_[counter], "counters only grow");
    }
    fuzz::require(counters[Counter::kActionsDropped] == 0, "the list holds all actions");
    before_ = counters;
  }

  /// Whatever is due at this instant; it comes to an end.
  template <class Core, class Check>
  void fire_timers(Core& core, Check check) {
    constexpr int kAtOnce = 64;
    for (int i = 0; i < kAtOnce; ++i) {
      const auto due = core.deadline();
      if (!due || *due > now_) return;
      check(core.on_timer(now_));
    }
    fuzz::require(false, "timers at one instant come to an end");
  }

  FreeRunningTime now_ = FreeRunningTime{Duration{std::chrono::hours{1}}};

 private:
  std::span<const std::uint8_t> octets_;
  ByteReader reader_;
  Counters before_;
  SumAssociation keys_;
};

}  // namespace ftcs::ptp
