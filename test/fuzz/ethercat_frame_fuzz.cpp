// SPDX-License-Identifier: MIT
//
// Any octets as an EtherCAT frame: refused with a name, or a chain of datagrams that lies within
// the octets and that three SubDevices process without harm.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "ftcs/ethercat/subdevice/segment.h"
#include "test/fuzz/require.h"

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
  static AffineOscillator crystal;
  const auto segment = std::make_unique<Segment>();
  for (int n = 0; n < 3; ++n) require(segment->add({}, {.parent = n - 1}, crystal).ok(), "a line");
  const auto passage = segment->pass(*frame, ftcs::ethercat::WireTime::from_ns(1'000'000));
  require(passage.returned, "a frame that went in comes out");
  require(FrameView::parse(octets).ok(), "what comes out is a frame");
  return 0;
}
