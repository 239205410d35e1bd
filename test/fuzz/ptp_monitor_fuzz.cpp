// SPDX-License-Identifier: MIT
//
// Datagrams of ptp4l's event monitor: an octet with the length before each, or all octets as one.
// The decoder refuses them with an error that makes sense, or reports samples whose number the
// octets can hold; the source behind it hands each of them on, or counts why not.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/ptp/monitor_source.h"
#include "test/fuzz/require.h"

namespace ftcs::ptp {
namespace {
using fuzz::require;

void check_decoder(std::span<const std::uint8_t> datagram) {
  const auto report = decode_monitor(datagram);
  if (!report) {
    require(report.error().offset <= datagram.size(), "an error lies inside the message");
    require(report.error().expected != report.error().received, "expected and received differ");
    return;
  }
  constexpr std::size_t kShortestElement = 30;
  require(report->size * kShortestElement <= datagram.size(), "each sample has its octets");
  for (const MonitorSample& sample : report->view()) {
    require(sample.local_ns >= 0, "a timestamp lies behind the epoch");
  }
}

void feed(MonitorSource& source, std::span<const std::uint8_t> datagram) {
  const MonitorCounters before = source.counters();
  const MonitorReport report = source.on_datagram(datagram);
  require(decode_monitor(datagram).ok() == (source.counters().malformed == before.malformed),
          "what cannot be read is counted");
  for (const MonitorSample& sample : report.view()) {
    const auto event = source.on_sample(sample, FreeRunningTime::from_ns(sample.local_ns));
    if (!event) continue;
    require(event->pair.direction == sample.direction && event->pair.reference == sample.reference,
            "a sample is handed on as it is");
    require(source.transmitter() == sample.transmitter, "and where it came from is known");
  }
  const MonitorCounters& after = source.counters();
  const std::uint64_t seen = (after.syncs + after.delays + after.repeated) -
                             (before.syncs + before.delays + before.repeated);
  require(seen == report.size, "each sample is handed on or counted as a copy");
  require(after.missed_syncs - before.missed_syncs <= report.size * std::uint64_t{64},
          "no more is missed than a sequence that goes on can leave out");
}

}  // namespace
}  // namespace ftcs::ptp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ptp;
  const std::span<const std::uint8_t> octets(data, size);
  check_decoder(octets);
  MonitorSource source;
  feed(source, octets);
  for (std::size_t at = 0; at < size;) {
    const std::size_t length = std::min<std::size_t>(octets[at], size - at - 1);
    feed(source, octets.subspan(at + 1, length));
    at += 1 + length;
  }
  return 0;
}
