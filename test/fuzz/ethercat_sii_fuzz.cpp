// SPDX-License-Identifier: MIT
//
// Any octets as an SII image, checksum made right so that the categories are reached.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "ftcs/ethercat/wire/sii.h"
#include "test/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ftcs::ethercat;
  using ftcs::fuzz::require;
  std::vector<std::uint8_t> image(data, data + size);
  const auto check = [](const std::vector<std::uint8_t>& octets) {
    const auto content = decode_sii(octets);
    if (!content) {
      require(name(content.error()) != nullptr, "an error has a name");
      return;
    }
    require(content->sync_manager_count <= SiiContent::kMaxSyncManagers, "sync managers fit");
    require(std::memchr(content->device_name.data(), 0, SiiContent::kMaxName) != nullptr,
            "the name ends");
  };
  check(image);
  constexpr std::size_t kChecksumAt = sii::kChecksumWord * 2;
  if (image.size() > kChecksumAt) image[kChecksumAt] = sii_checksum(image);
  check(image);
  return 0;
}
