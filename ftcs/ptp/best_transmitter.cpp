// SPDX-License-Identifier: MIT
#include "ftcs/ptp/best_transmitter.h"

#include <algorithm>
#include <tuple>

#include "ftcs/ptp/interval.h"

namespace ftcs::ptp {
namespace {

/// 9.3.2.4.4: FOREIGN_MASTER_TIME_WINDOW, in announce intervals.
constexpr int kTimeWindowIntervals = 4;

/// 9.3.4, part 1: what a grandmaster says about itself, the most important word first.
auto grandmaster_rank(const Announce& announce) noexcept {
  return std::tuple(announce.priority1, announce.quality.clock_class,
                    announce.quality.clock_accuracy, announce.quality.offset_scaled_log_variance,
                    announce.priority2, announce.grandmaster);
}

}  // namespace

bool better(const TransmitterData& a, const TransmitterData& b) noexcept {
  if (a.announce.grandmaster == b.announce.grandmaster) {
    return std::tie(a.announce.steps_removed, a.port) < std::tie(b.announce.steps_removed, b.port);
  }
  return grandmaster_rank(a.announce) < grandmaster_rank(b.announce);
}

bool ForeignTransmitters::qualified(const Record& record, FreeRunningTime now,
                                    bool first_suffices) noexcept {
  const Duration window = multiply(record.announce_interval, kTimeWindowIntervals);
  if (first_suffices) return now - record.last <= window;
  return record.heard_twice && now - record.before_last <= window;
}

const ForeignTransmitters::Record* ForeignTransmitters::find(
    const PortIdentity& port) const noexcept {
  const auto* found = std::ranges::find_if(
      records_, [&](const Record& record) { return record.used && record.data.port == port; });
  return found == records_.end() ? nullptr : found;
}

ForeignTransmitters::Record* ForeignTransmitters::place_for(const PortIdentity& port,
                                                            const PortIdentity& selected,
                                                            FreeRunningTime now) noexcept {
  Record* free_place = nullptr;
  for (Record& record : records_) {
    if (record.used && record.data.port == port) return &record;
    const bool silent =
        record.data.port != selected &&
        now - record.last > multiply(record.announce_interval, kTimeWindowIntervals);
    if (free_place == nullptr && (!record.used || silent)) free_place = &record;
  }
  if (free_place != nullptr) *free_place = Record{};
  return free_place;
}

ForeignTransmitters::Heard ForeignTransmitters::hear(const TransmitterData& data,
                                                     Duration announce_interval,
                                                     FreeRunningTime now,
                                                     const PortIdentity& selected,
                                                     std::uint16_t sequence_id) noexcept {
  Record* const record = place_for(data.port, selected, now);
  if (record == nullptr) return Heard::kTableFull;
  const bool known = record->used;
  *record = Record{.used = true,
                   .heard_twice = known,
                   .data = data,
                   .announce_interval = announce_interval,
                   .last = now,
                   .before_last = record->last,
                   .sequence_id = sequence_id,
                   .doubted_until = record->doubted_until};
  return known ? Heard::kKnown : Heard::kNew;
}

const TransmitterData* ForeignTransmitters::best(const PortIdentity& selected, FreeRunningTime now,
                                                 bool first_suffices) const noexcept {
  const TransmitterData* best = nullptr;
  bool best_is_doubted = false;
  for (const Record& record : records_) {
    if (!record.used || !(record.data.port == selected || qualified(record, now, first_suffices))) {
      continue;
    }
    const bool doubted = record.doubted_until && now < *record.doubted_until;
    const bool wins = best == nullptr ||
                      (doubted == best_is_doubted ? better(record.data, *best) : best_is_doubted);
    if (!wins) continue;
    best = &record.data;
    best_is_doubted = doubted;
  }
  return best;
}

std::optional<std::uint16_t> ForeignTransmitters::sequence_id(
    const PortIdentity& port) const noexcept {
  const Record* const record = find(port);
  if (record == nullptr) return std::nullopt;
  return record->sequence_id;
}

std::optional<FreeRunningTime> ForeignTransmitters::receipt_timeout(const PortIdentity& port,
                                                                    int intervals) const noexcept {
  const Record* const record = find(port);
  if (record == nullptr) return std::nullopt;
  return record->last + multiply(record->announce_interval, intervals);
}

std::optional<FreeRunningTime> ForeignTransmitters::last_heard(
    const PortIdentity& port) const noexcept {
  const Record* const record = find(port);
  if (record == nullptr) return std::nullopt;
  return record->last;
}

bool ForeignTransmitters::doubt(const PortIdentity& port, FreeRunningTime now) noexcept {
  bool anew = false;
  for (Record& record : records_) {
    if (!record.used || record.data.port != port) continue;
    anew = !record.doubted_until || now >= *record.doubted_until;
    record.doubted_until = now + Duration{kDoubtTime};
  }
  return anew;
}

void ForeignTransmitters::forget(const PortIdentity& port) noexcept {
  for (Record& record : records_) {
    if (record.used && record.data.port == port) record = Record{};
  }
}

}  // namespace ftcs::ptp
