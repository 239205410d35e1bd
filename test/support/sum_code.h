// SPDX-License-Identifier: MIT
#pragma once

#include "ftcs/ptp/security_association.h"

namespace ftcs::ptp {

/// Stands in for a message authentication code: no protection at all, but it differs when an octet
/// does.
class SumCode final : public MessageAuthenticationCode {
 public:
  explicit SumCode(std::uint8_t key = 1) : key_(key) {}
  bool compute(std::span<const std::span<const std::uint8_t>> parts,
               std::span<std::uint8_t> code) noexcept override {
    std::uint64_t sum = key_;
    for (const auto part : parts) {
      for (const std::uint8_t octet : part) sum = sum * 31 + octet;
    }
    for (std::uint8_t& octet : code) {
      sum = sum * 31 + 7;
      octet = static_cast<std::uint8_t>(sum >> 24U);
    }
    return works;
  }
  bool works = true;

 private:
  std::uint8_t key_;
};

/// An association with a short and a long code.
struct SumAssociation {
  SumCode code{};
  SecurityAssociation association{};
  SumAssociation() {
    association.active_key_id = 2;
    association.add({1, 16, &code});
    association.add({2, 32, &code});
  }
  SumAssociation(const SumAssociation&) = delete;
  SumAssociation& operator=(const SumAssociation&) = delete;
};

}  // namespace ftcs::ptp
