// SPDX-License-Identifier: MIT
#include "ftcs/platform/transmission_log.h"

#include <algorithm>

namespace ftcs::platform {
namespace {

using Bytes = std::span<const std::uint8_t>;

bool octets_equal(Bytes a, Bytes b, std::size_t from, std::size_t to) {
  to = std::min({to, a.size(), b.size()});
  return from >= to || std::equal(a.begin() + static_cast<std::ptrdiff_t>(from),
                                  a.begin() + static_cast<std::ptrdiff_t>(to),
                                  b.begin() + static_cast<std::ptrdiff_t>(from));
}

// IEEE 1588-2019, 13.3: octets 0..7 are type, version, length, domain and flags; 8..15 the
// correctionField, which an adapter may fill in on the way out, as it may the body's
// timestamp; 20..31 the port's identity and the sequence id. Of an answer (Pdelay_Resp) the
// requesting port, 44..53, tells apart what two neighbours asked with one sequence id.
bool same_message(Bytes sent, Bytes looped) {
  return octets_equal(sent, looped, 0, 8) && octets_equal(sent, looped, 20, 32) &&
         octets_equal(sent, looped, 44, 54);
}

// An Ethernet header without and with a VLAN tag: behind it, in a frame that the driver has filled
// up to the shortest length, the message does not end where the frame does.
constexpr std::size_t kHeaderSizes[] = {14, 18};

bool holds(Bytes packet, Bytes sent) {
  if (packet.size() < sent.size()) return false;
  if (same_message(sent, packet.last(sent.size()))) return true;
  return std::ranges::any_of(kHeaderSizes, [&](std::size_t header) {
    return packet.size() >= header + sent.size() &&
           same_message(sent, packet.subspan(header, sent.size()));
  });
}

}  // namespace

void TransmissionLog::remember(Bytes message, FreeRunningTime now) noexcept {
  if (message.size() > kLongest) return;  // its stamp will match nothing and be counted
  Slot& slot = slots_[next_];
  next_ = (next_ + 1) % kCapacity;
  std::copy(message.begin(), message.end(), slot.bytes.begin());
  slot.length = message.size();
  slot.sent_at = now;
  slot.expired = false;
}

std::optional<TransmissionLog::Entry> TransmissionLog::match(Bytes packet) noexcept {
  for (Slot& slot : slots_) {
    if (slot.length == 0 || !holds(packet, slot.view())) continue;
    const Entry entry{slot.view(), slot.expired};
    slot.length = 0;
    return entry;
  }
  return std::nullopt;
}

std::optional<Bytes> TransmissionLog::expire(FreeRunningTime now, Duration timeout) noexcept {
  for (Slot& slot : slots_) {
    if (slot.length == 0 || slot.expired || now - slot.sent_at < timeout) continue;
    slot.expired = true;
    return slot.view();
  }
  return std::nullopt;
}

std::optional<FreeRunningTime> TransmissionLog::oldest() const noexcept {
  std::optional<FreeRunningTime> oldest;
  for (const Slot& slot : slots_) {
    if (slot.length == 0 || slot.expired) continue;
    if (!oldest || slot.sent_at < *oldest) oldest = slot.sent_at;
  }
  return oldest;
}

}  // namespace ftcs::platform
