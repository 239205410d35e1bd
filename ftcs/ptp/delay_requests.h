// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "ftcs/ptp/counters.h"
#include "ftcs/ptp/random.h"
#include "ftcs/ptp/wire/message.h"
#include "ftcs/time/timestamp_pair.h"

namespace ftcs::ptp {

/// When to ask for the delay, and which answer belongs to which request (11.3, 9.5.11.2).
///
/// A backward pair needs two things that arrive in either order: our transmit stamp t3 and the
/// Delay_Resp with t4. free_running = t3, reference = t4 - correction. Pairs come in the order of
/// their requests.
class DelayRequests {
 public:
  static constexpr std::int8_t kLongestDemandedLogInterval = 5;

  /// `log_interval`: logMinDelayReqInterval, log2 of seconds, -7 to 7; outside, one second. `seed`:
  /// of the random intervals; two receivers with one seed ask at the same moments. `first_id`: of
  /// the first request.
  DelayRequests(std::int8_t log_interval, std::uint64_t seed, std::uint16_t first_id) noexcept;

  /// The first request is due at once, unless one was for that reason within the last interval;
  /// further ones after random intervals, uniform in [0, 2 x interval] (9.5.11.2).
  void start(FreeRunningTime now) noexcept;
  /// Forgets all open requests. Sequence ids go on, so that late answers find nothing.
  void stop(Counters& counters) noexcept;
  /// Forgets all open requests and asks again at once.
  void restart(FreeRunningTime now, Counters& counters) noexcept;
  [[nodiscard]] bool running() const noexcept { return running_; }
  [[nodiscard]] std::optional<FreeRunningTime> deadline() const noexcept;

  /// The sequence id of a request that is due, which must now be sent; none if it is not time yet.
  std::optional<std::uint16_t> begin_if_due(FreeRunningTime now, Counters& counters) noexcept;
  /// t3. A pair, if the answer was there already.
  std::optional<EventPair> on_sent(std::uint16_t sequence_id, FreeRunningTime sent,
                                   Counters& counters) noexcept;
  /// The stamp is overdue, which is counted; one that comes later is used all the same.
  void on_stamp_missing(std::uint16_t sequence_id, Counters& counters) noexcept;
  /// The answer to an open request also tells logMinDelayReqInterval as the transmitter demands it
  /// (7.7.2.4, 13.3.2.14); more than kLongestDemandedLogInterval, nobody does.
  std::optional<EventPair> on_response(const Header& header, const DelayResp& response,
                                       FreeRunningTime now, Counters& counters) noexcept;
  /// Mean time between requests.
  [[nodiscard]] Duration interval() const noexcept { return interval_; }

 private:
  struct Request {
    bool open = false;
    bool sent = false;
    bool answered = false;
    bool overdue = false;  ///< the stamp, and counted
    std::uint16_t sequence_id = 0;
    FreeRunningTime transmit{};
    ReferenceTime receive{};  ///< t4 - correction
  };
  /// Random intervals may be short against the round trip.
  static constexpr std::size_t kOpenRequests = 4;

  void honour(std::int8_t log_interval, FreeRunningTime now, Counters& counters) noexcept;
  [[nodiscard]] Request* find(std::uint16_t sequence_id) noexcept;
  std::optional<EventPair> complete(Request& request, Counters& counters) noexcept;
  void forget(Request& request, Counters& counters) noexcept;
  [[nodiscard]] Duration draw() noexcept;

  std::array<Request, kOpenRequests> requests_{};
  std::uint16_t next_id_ = 0;
  bool has_emitted_ = false;
  std::uint16_t emitted_id_ = 0;
  bool running_ = false;
  FreeRunningTime next_at_{};
  std::optional<FreeRunningTime> begun_at_once_{};
  Duration interval_;
  Random random_;
};

}  // namespace ftcs::ptp
