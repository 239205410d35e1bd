// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/time/result.h"

namespace ftcs::ptp {

/// AUTHENTICATION TLV, 16.14.3, as immediate security processing sends it (16.14.4.1): neither
/// disclosedKey nor sequenceNo nor RES. The integrity check value (ICV) at its end is computed over
/// everything before it, from the first octet of the header.
struct AuthenticationTlv {
  std::uint8_t spp = 0;         ///< securityParameterPointer: which security association
  std::uint32_t key_id = 0;     ///< which of its keys
  std::size_t covered = 0;      ///< octets of the message before the ICV
  std::size_t code_octets = 0;  ///< of the ICV
};

/// Octets before the ICV: tlvType, lengthField, SPP, secParamIndicator, keyID.
inline constexpr std::size_t kAuthenticationHeaderSize = 10;
/// The longest ICV (16.14.3.7: HMAC-SHA256; HMAC-SHA256-128 has 16).
inline constexpr std::size_t kMaximumCodeSize = 32;

enum class AuthenticationFault : std::uint8_t {
  kMissing,      ///< the last TLV is another one, or there is none
  kUnsupported,  ///< it has fields of delayed processing, or no ICV, or octets stand behind it
};

/// The TLV of a message that decode() accepts. It must be the last one (16.14.2).
[[nodiscard]] Result<AuthenticationTlv, AuthenticationFault> find_authentication(
    std::span<const std::uint8_t> message) noexcept;

/// Writes the TLV but for its ICV behind `length` octets of `message`, and the new messageLength.
/// `message` must have room for kAuthenticationHeaderSize + code_size more.
void write_authentication(std::span<std::uint8_t> message, std::size_t length, std::uint8_t spp,
                          std::uint32_t key_id, std::size_t code_size) noexcept;

}  // namespace ftcs::ptp
