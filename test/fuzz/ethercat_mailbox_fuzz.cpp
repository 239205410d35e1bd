// SPDX-License-Identifier: MIT
//
// Any octets as a mailbox: refused with a name, or an SDO that reads the same after it was written.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ftcs/ethercat/wire/mailbox.h"
#include "test/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ethercat;
  using ftcs::fuzz::require;
  const ConstBytes octets(data, size);
  const auto sdo = decode_sdo(octets);
  if (!sdo) {
    require(name(sdo.error()) != nullptr, "an error has a name");
    return 0;
  }
  std::vector<std::uint8_t> mailbox(size + kSdoOverhead);
  require(encode_sdo(mailbox, *sdo), "what was read can be written");
  const auto again = decode_sdo(mailbox);
  require(again.ok(), "what was written can be read");
  require(again->kind == sdo->kind && again->object == sdo->object && again->abort == sdo->abort &&
              again->counter == sdo->counter,
          "nothing is lost");
  require(again->data.size() == sdo->data.size() &&
              std::equal(again->data.begin(), again->data.end(), sdo->data.begin()),
          "no data are lost");
  return 0;
}
