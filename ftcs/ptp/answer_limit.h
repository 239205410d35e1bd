// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "ftcs/ptp/wire/message.h"
#include "ftcs/time/instant.h"

namespace ftcs::ptp {

/// How many requests (Delay_Req, Pdelay_Req) are answered: who floods us shall neither keep us busy
/// nor make us flood others, nor take the answers of those who were there before.
///
/// Each known sender has a bucket of one second's answers, 256 a second: twice what the shortest
/// interval of 2^-7 s asks for. From 17 senders within a second on they share 4,096 a second
/// evenly. Who is not known takes a place that is free or was not used for ten seconds; else he
/// shares 1,024 a second with all others who found none, so that invented senders drive nobody out.
/// In all at most 5,120 answers a second beyond the buckets; `Senders` comparisons a request.
///
/// Senders are told apart by what they say they are: who uses another's name takes from that one's
/// bucket.
template <std::size_t Senders>
class AnswerLimit {
 public:
  static constexpr std::int64_t kEachPerSecond = 256;
  static constexpr std::int64_t kAllPerSecond = 4096;
  static constexpr std::int64_t kStrangersPerSecond = 1024;

  /// Whether a request of `sender` that came at `now` is answered. `now` by any one clock; after a
  /// step back of it all buckets are full.
  [[nodiscard]] bool admits(const PortIdentity& sender, FreeRunningTime now) noexcept {
    std::int64_t busy = 1;
    Place* own = nullptr;
    Place* free = nullptr;
    for (Place& place : places_) {
      const Duration silent = now - place.heard;
      const bool forgotten = !place.taken || silent < Duration{} || silent >= Duration{kForgotten};
      if (place.taken && place.sender == sender) {
        own = &place;
      } else if (forgotten) {
        free = &place;
      } else if (silent < Duration{kSecond}) {
        ++busy;
      }
    }
    if (own == nullptr && free == nullptr) return strangers_.take(now, kStrangersPerSecond);
    if (own == nullptr) {
      own = free;
      *own = Place{.taken = true, .sender = sender, .heard = now, .bucket = {}};
    }
    own->heard = now;
    return own->bucket.take(now, std::min(kEachPerSecond, kAllPerSecond / busy));
  }

 private:
  static constexpr Nanoseconds kSecond{1'000'000'000};
  static constexpr Nanoseconds kForgotten{10'000'000'000};

  /// Full where `paid` has passed; each answer moves it on by one interval, at most a second ahead.
  struct Bucket {
    FreeRunningTime paid{};
    [[nodiscard]] bool take(FreeRunningTime now, std::int64_t per_second) noexcept {
      const Duration interval{kSecond / per_second};
      const bool stepped_back = paid - now > Duration{kSecond};
      if (paid < now || stepped_back) paid = now;
      if (paid + interval - now > Duration{kSecond}) return false;
      paid = paid + interval;
      return true;
    }
  };
  struct Place {
    bool taken = false;
    PortIdentity sender{};
    FreeRunningTime heard{};
    Bucket bucket{};
  };

  std::array<Place, Senders> places_{};
  Bucket strangers_{};
};

}  // namespace ftcs::ptp
