// SPDX-License-Identifier: MIT
#include "ftcs/platform/keyed_code.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <gcrypt.h>
#include <utility>

namespace ftcs::platform {
namespace {

struct Kind {
  std::string_view name;
  CodeKind kind;
  gcry_mac_algos algorithm;
  std::uint8_t code_octets;
  std::size_t key_octets;
};

constexpr std::array kKinds{
    Kind{"SHA256-128", CodeKind::kHmacSha256Truncated, GCRY_MAC_HMAC_SHA256, 16, 0},
    Kind{"SHA256", CodeKind::kHmacSha256, GCRY_MAC_HMAC_SHA256, 32, 0},
    Kind{"AES128", CodeKind::kCmacAes128, GCRY_MAC_CMAC_AES, 16, 16},
    Kind{"AES256", CodeKind::kCmacAes256, GCRY_MAC_CMAC_AES, 16, 32},
};

const Kind& kind_of(CodeKind kind) noexcept { return kKinds[static_cast<std::size_t>(kind)]; }

bool same_word(std::string_view a, std::string_view b) noexcept {
  return std::ranges::equal(a, b, [](unsigned char one, unsigned char other) {
    return std::tolower(one) == std::tolower(other);
  });
}

/// Once for the process. Memory that is never swapped is not asked for: the keys stand in a file.
void initialize_library() {
  static const bool done = [] {
    gcry_check_version(nullptr);
    gcry_control(GCRYCTL_DISABLE_SECMEM, 0);
    gcry_control(GCRYCTL_INITIALIZATION_FINISHED, 0);
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace

struct KeyedCode::Handle {
  gcry_mac_hd_t mac = nullptr;
  ~Handle() {
    if (mac != nullptr) gcry_mac_close(mac);
  }
};

std::optional<CodeKind> code_kind_from_name(std::string_view name) noexcept {
  const auto* const found =
      std::ranges::find_if(kKinds, [&](const Kind& kind) { return same_word(kind.name, name); });
  if (found == kKinds.end()) return std::nullopt;
  return found->kind;
}

std::uint8_t code_octets(CodeKind kind) noexcept { return kind_of(kind).code_octets; }

std::size_t key_octets(CodeKind kind) noexcept { return kind_of(kind).key_octets; }

Result<std::unique_ptr<KeyedCode>, KeyedCode::Error> KeyedCode::open(
    CodeKind kind, std::span<const std::uint8_t> key) {
  initialize_library();
  auto handle = std::make_unique<Handle>();
  auto error = gcry_mac_open(&handle->mac, kind_of(kind).algorithm, 0, nullptr);
  if (error == 0) error = gcry_mac_setkey(handle->mac, key.data(), key.size());
  if (error != 0) return Error{gcry_strerror(error)};
  return std::unique_ptr<KeyedCode>(new KeyedCode(std::move(handle)));
}

KeyedCode::KeyedCode(std::unique_ptr<Handle> handle) noexcept : handle_(std::move(handle)) {}

KeyedCode::~KeyedCode() = default;

bool KeyedCode::compute(std::span<const std::span<const std::uint8_t>> parts,
                        std::span<std::uint8_t> code) noexcept {
  if (gcry_mac_reset(handle_->mac) != 0) return false;
  for (const auto part : parts) {
    if (!part.empty() && gcry_mac_write(handle_->mac, part.data(), part.size()) != 0) return false;
  }
  std::size_t size = code.size();
  return gcry_mac_read(handle_->mac, code.data(), &size) == 0 && size == code.size();
}

}  // namespace ftcs::platform
