// SPDX-License-Identifier: MIT
//
// Any octets as an EtherCAT frame: refused with a name, or a chain of datagrams that lies within
// the octets and that three SubDevices process without harm.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "ftcs/sim/drives/segment.h"
#include "test/fuzz/require.h"

namespace {

/// Made once: the memory of a whole segment takes longer than any frame. A SubDevice that was
/// switched off and on is like a new one.
ftcs::ethercat::Segment& line_of_three() {
  static ftcs::ethercat::AffineOscillator crystal;
  static const auto segment = std::make_unique<ftcs::ethercat::Segment>();
  for (int n = 0; n < 3; ++n) {
    ftcs::fuzz::require(segment->add({}, {.parent = n - 1}, crystal).ok(), "a line");
  }
  return *segment;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ethercat;
  using ftcs::fuzz::require;
  std::vector<std::uint8_t> octets(data, data + size);
  const auto ethernet = decode_ethernet(octets);
  if (ethernet) require(ethernet->size() + kEthernetHeaderSize == size, "the payload is the rest");
  const auto frame = FrameView::parse(octets);
  if (!frame) {
    require(name(frame.error()) != nullptr, "an error has a name");
    return 0;
  }
  std::size_t used = kFrameHeaderSize;
  std::size_t count = 0;
  for (const Datagram datagram : *frame) {
    used += kDatagramOverhead + datagram.data().size();
    ++count;
  }
  require(used <= size && count == frame->count(), "datagrams lie within the frame");
  static Segment& segment = line_of_three();
  const auto now = WireTime::from_ns(1'000'000);
  for (std::size_t n = 0; n < segment.size(); ++n) segment.power_cycle(n, now);
  const auto passage = segment.pass(*frame, now);
  require(passage.returned, "a frame that went in comes out");
  require(FrameView::parse(octets).ok(), "what comes out is a frame");
  return 0;
}
