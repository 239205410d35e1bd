// SPDX-License-Identifier: MIT
//
// Any octets: the decoder refuses them with an error that makes sense, or reads a message that it
// reads again from what the encoder wrote.
#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/ptp/wire/authentication.h"
#include "ftcs/ptp/wire/codec.h"
#include "test/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ptp;
  using ftcs::fuzz::require;
  const std::span<const std::uint8_t> octets(data, size);
  const auto message = decode(octets);
  if (!message) {
    require(message.error().offset <= size, "an error lies inside the message");
    require(message.error().expected != message.error().received, "expected and received differ");
    require(!to_string(message.error().reason).empty(), "a reason has a name");
    return 0;
  }
  const auto tlv = find_authentication(octets);
  if (tlv) {
    require(tlv->covered + tlv->code_octets <= size, "the code lies inside the message");
    require(tlv->code_octets > 0 && tlv->code_octets <= kMaximumCodeSize, "it is a code");
  }
  const auto bytes = encode(*message);
  require(bytes.ok(), "what was read can be written");
  require(bytes->size <= size, "what is written is no longer than what was read");
  const auto again = decode(bytes->view());
  require(again.ok(), "what was written can be read");
  require(*again == *message, "nothing is lost");
  return 0;
}
