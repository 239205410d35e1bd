// SPDX-License-Identifier: MIT
#include "ftcs/ptp/delay_requests.h"

#include <algorithm>
#include <chrono>

#include "ftcs/ptp/interval.h"
#include "ftcs/ptp/sequence.h"

namespace ftcs::ptp {

DelayRequests::DelayRequests(std::int8_t log_interval, std::uint64_t seed,
                             std::uint16_t first_id) noexcept
    : next_id_(first_id),
      interval_(interval_from_log(log_interval).value_or(Duration{std::chrono::seconds{1}})),
      random_(seed) {}

void DelayRequests::start(FreeRunningTime now) noexcept {
  running_ = true;
  // A reference that jumps with each Sync would otherwise make each of them a request.
  const bool at_once = !begun_at_once_ || now - *begun_at_once_ >= interval_;
  if (at_once) begun_at_once_ = now;
  next_at_ = at_once ? now : now + draw();
}

void DelayRequests::stop(Counters& counters) noexcept {
  running_ = false;
  for (Request& request : requests_) forget(request, counters);
}

void DelayRequests::restart(FreeRunningTime now, Counters& counters) noexcept {
  stop(counters);
  start(now);
}

std::optional<FreeRunningTime> DelayRequests::deadline() const noexcept {
  if (!running_) return std::nullopt;
  return next_at_;
}

std::optional<std::uint16_t> DelayRequests::begin_if_due(FreeRunningTime now,
                                                         Counters& counters) noexcept {
  if (!running_ || now < next_at_) return std::nullopt;
  next_at_ = now + draw();
  const std::uint16_t sequence_id = next_id_++;
  // Ids are consecutive: this place belongs to the request four before.
  Request& request = requests_[sequence_id % kOpenRequests];
  forget(request, counters);
  request.open = true;
  request.sequence_id = sequence_id;
  return sequence_id;
}

std::optional<EventPair> DelayRequests::on_sent(std::uint16_t sequence_id, FreeRunningTime sent,
                                                Counters& counters) noexcept {
  Request* const request = find(sequence_id);
  if (request == nullptr || request->sent) {
    counters.add(Counter::kUnexpectedTransmitStamp);
    return std::nullopt;
  }
  request->sent = true;
  request->transmit = sent;
  return complete(*request, counters);
}

void DelayRequests::on_stamp_missing(std::uint16_t sequence_id, Counters& counters) noexcept {
  Request* const request = find(sequence_id);
  const bool awaited = request != nullptr && !request->sent && !request->overdue;
  counters.add(awaited ? Counter::kMissingTransmitStamp : Counter::kUnexpectedTransmitStamp);
  if (awaited) request->overdue = true;
}

std::optional<EventPair> DelayRequests::on_response(const Header& header, const DelayResp& response,
                                                    FreeRunningTime now,
                                                    Counters& counters) noexcept {
  Request* const request = find(header.sequence_id);
  if (request == nullptr || request->answered) {
    counters.add(Counter::kStaleDelayResp);
    return std::nullopt;
  }
  honour(header.log_interval, now, counters);
  request->answered = true;
  request->receive = response.receive - header.correction;
  return complete(*request, counters);
}

std::optional<EventPair> DelayRequests::complete(Request& request, Counters& counters) noexcept {
  if (!request.sent || !request.answered) return std::nullopt;
  const EventPair pair{Direction::kBackward, request.receive, request.transmit};
  const std::uint16_t sequence_id = request.sequence_id;
  request = Request{};
  if (has_emitted_ && sequence_distance(sequence_id, emitted_id_) <= 0) {
    counters.add(Counter::kStaleDelayResp);
    return std::nullopt;
  }
  has_emitted_ = true;
  emitted_id_ = sequence_id;
  return pair;
}

void DelayRequests::honour(std::int8_t log_interval, FreeRunningTime now,
                           Counters& counters) noexcept {
  if (log_interval == kNoLogInterval) return;
  auto interval = interval_from_log(log_interval);
  if (log_interval > kLongestDemandedLogInterval) interval.reset();
  if (!interval) {
    counters.add(Counter::kBadInterval);
    return;
  }
  if (*interval == interval_) return;
  interval_ = *interval;
  if (running_) next_at_ = now + draw();
}

DelayRequests::Request* DelayRequests::find(std::uint16_t sequence_id) noexcept {
  Request& request = requests_[sequence_id % kOpenRequests];
  return request.open && request.sequence_id == sequence_id ? &request : nullptr;
}

void DelayRequests::forget(Request& request, Counters& counters) noexcept {
  const bool stamp_is_what_was_missing = request.answered || (request.overdue && !request.sent);
  if (request.open && !stamp_is_what_was_missing) counters.add(Counter::kLostDelayResp);
  request = Request{};
}

Duration DelayRequests::draw() noexcept {
  return Duration::from_ns(2.0 * interval_.ns() * random_.uniform());
}

}  // namespace ftcs::ptp
