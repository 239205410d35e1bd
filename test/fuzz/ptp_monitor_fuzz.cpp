// SPDX-License-Identifier: MIT
//
// Any octets: the decoder of ptp4l's event monitor refuses them with an error that makes sense, or
// reports samples whose number the octets can hold.
#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/ptp/wire/monitor.h"
#include "test/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ptp;
  using ftcs::fuzz::require;
  const auto report = decode_monitor({data, size});
  if (!report) {
    require(report.error().offset <= size, "an error lies inside the message");
    require(report.error().expected != report.error().received, "expected and received differ");
    return 0;
  }
  constexpr std::size_t kShortestElement = 30;
  require(report->size * kShortestElement <= size, "each sample has its octets");
  for (const MonitorSample& sample : report->view()) {
    require(sample.local_ns >= 0, "a timestamp lies behind the epoch");
  }
  return 0;
}
