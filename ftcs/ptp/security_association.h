// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ftcs/ptp/wire/authentication.h"
#include "ftcs/ptp/wire/codec.h"

namespace ftcs::ptp {

/// A keyed function from octets to a message authentication code (HMAC, RFC 2104; CMAC, SP
/// 800-38B). It has its key when it is given to a SecurityAssociation.
class MessageAuthenticationCode {
 public:
  /// The code of all parts one behind the other; its first octets, as many as `code` has. False if
  /// it cannot be computed.
  [[nodiscard]] virtual bool compute(std::span<const std::span<const std::uint8_t>> parts,
                                     std::span<std::uint8_t> code) noexcept = 0;

  MessageAuthenticationCode(const MessageAuthenticationCode&) = delete;
  MessageAuthenticationCode& operator=(const MessageAuthenticationCode&) = delete;

 protected:
  MessageAuthenticationCode() = default;
  ~MessageAuthenticationCode() = default;
};

/// One key; the function it is used by is not owned, and must outlive the association.
struct SecurityKey {
  std::uint32_t id = 0;           ///< keyID, 1 or more
  std::uint8_t code_octets = 16;  ///< of the ICV, at most kMaximumCodeSize
  MessageAuthenticationCode* code = nullptr;
};

/// What those who share keys have agreed on (16.14.4.2): how each message is authenticated.
struct SecurityAssociation {
  static constexpr std::size_t kMaximumKeys = 16;

  std::uint8_t spp = 0;
  /// How far ahead of the last one a Sync's or Follow_Up's sequenceId may be; 0: not looked at.
  std::uint16_t sequence_window = 3;
  /// The correctionField is left out of the ICV, so that transparent clocks without the keys may
  /// change it; so may everybody else.
  bool allow_mutable = false;
  std::uint32_t active_key_id = 0;  ///< of what is sent; received is what any key fits
  std::array<SecurityKey, kMaximumKeys> keys{};
  std::size_t key_count = 0;

  /// False if there is no room.
  bool add(const SecurityKey& key) noexcept;
  /// Null: not in the association.
  [[nodiscard]] const SecurityKey* find(std::uint32_t key_id) const noexcept;
};

/// What authenticate() found.
enum class Authenticity : std::uint8_t {
  kAuthentic,
  kMissing,      ///< no AUTHENTICATION TLV at the end
  kUnsupported,  ///< one that we cannot judge
  kUnknownKey,   ///< of another association, or none of its keys
  kWrongCode,    ///< another key under this number, or a changed message
};

/// Whether a message that decode() accepts comes from who has the key that it names. Takes the same
/// time wherever its code differs.
[[nodiscard]] Authenticity authenticate(const SecurityAssociation& association,
                                        std::span<const std::uint8_t> message) noexcept;

/// Appends the TLV by the active key. False, and the message unchanged in length, if there is none
/// or its code cannot be computed: then it must not be sent.
[[nodiscard]] bool seal(const SecurityAssociation& association, MessageBytes& message) noexcept;

}  // namespace ftcs::ptp
