// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ftcs/platform/keyed_code.h"
#include "ftcs/ptp/security_association.h"

namespace ftcs::daemon {

/// ptp4l's settings of these names.
struct SecurityOptions {
  std::string sa_file{};
  std::optional<std::uint8_t> spp{};  ///< none (ptp4l's -1): nothing is authenticated
  std::uint32_t active_key_id = 0;    ///< of what is sent
};

/// The security association of a port: keys by their file, ready to use.
class Security {
 public:
  explicit Security(SecurityOptions options) : options_(std::move(options)) {}
  Security(const Security&) = delete;
  Security& operator=(const Security&) = delete;

  /// Reads the file. Returns what is wrong with it; then the keys before stay in use.
  [[nodiscard]] std::optional<std::string> load();
  /// Its address stays while this object lives.
  [[nodiscard]] const ptp::SecurityAssociation& association() const { return association_; }
  /// "spp 1, 2 keys, sends by key 1".
  [[nodiscard]] std::string description() const;
  /// Others than the owner may read the file, and so the keys.
  [[nodiscard]] bool is_readable_by_others() const;

 private:
  SecurityOptions options_;
  ptp::SecurityAssociation association_{};
  std::vector<std::unique_ptr<platform::KeyedCode>> codes_{};
};

}  // namespace ftcs::daemon
