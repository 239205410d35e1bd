// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "ftcs/ptp/security_association.h"
#include "ftcs/time/result.h"

namespace ftcs::platform {

/// How a key makes a message authentication code: the types of linuxptp's sa_file.
enum class CodeKind : std::uint8_t {
  kHmacSha256Truncated,  ///< HMAC-SHA256-128 (RFC 4868): the first 16 octets
  kHmacSha256,           ///< RFC 4231: 32 octets, any length of key
  kCmacAes128,           ///< RFC 4493: 16 octets, key of 16
  kCmacAes256,           ///< 16 octets, key of 32
};

/// "SHA256-128", "SHA256", "AES128", "AES256", in any case of letters.
[[nodiscard]] std::optional<CodeKind> code_kind_from_name(std::string_view name) noexcept;
/// Octets of the ICV.
[[nodiscard]] std::uint8_t code_octets(CodeKind kind) noexcept;
/// Octets that the key must have; 0: any number but none.
[[nodiscard]] std::size_t key_octets(CodeKind kind) noexcept;

/// A message authentication code by libgcrypt. All memory is taken when it is made; the key is
/// wiped with it.
class KeyedCode final : public ptp::MessageAuthenticationCode {
 public:
  struct Error {
    std::string_view reason{};  ///< the library's words
  };
  [[nodiscard]] static Result<std::unique_ptr<KeyedCode>, Error> open(
      CodeKind kind, std::span<const std::uint8_t> key);
  ~KeyedCode();

  [[nodiscard]] bool compute(std::span<const std::span<const std::uint8_t>> parts,
                             std::span<std::uint8_t> code) noexcept override;

 private:
  struct Handle;
  explicit KeyedCode(std::unique_ptr<Handle> handle) noexcept;
  std::unique_ptr<Handle> handle_;
};

}  // namespace ftcs::platform
