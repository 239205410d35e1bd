// SPDX-License-Identifier: MIT
#include "ftcs/ptp/security_association.h"

#include <algorithm>

namespace ftcs::ptp {
namespace {

using Code = std::array<std::uint8_t, kMaximumCodeSize>;

/// The ICV of the first `covered` octets; with allow_mutable the correctionField counts as zero.
bool compute(const SecurityAssociation& association, const SecurityKey& key,
             std::span<const std::uint8_t> covered, std::span<std::uint8_t> code) noexcept {
  constexpr std::size_t kCorrection = 8;
  constexpr std::array<std::uint8_t, 8> kZero{};
  if (key.code == nullptr) return false;
  const std::array<std::span<const std::uint8_t>, 3> parts{
      covered.first(kCorrection),
      association.allow_mutable ? std::span<const std::uint8_t>(kZero)
                                : covered.subspan(kCorrection, kZero.size()),
      covered.subspan(kCorrection + kZero.size())};
  return key.code->compute(parts, code);
}

/// In a time that does not tell where they differ.
bool equal(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) noexcept {
  unsigned different = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    different |= static_cast<unsigned>(a[i] ^ b[i]);
  }
  return different == 0;
}

}  // namespace

bool SecurityAssociation::add(const SecurityKey& key) noexcept {
  if (key_count == keys.size()) return false;
  keys[key_count++] = key;
  return true;
}

const SecurityKey* SecurityAssociation::find(std::uint32_t key_id) const noexcept {
  const auto* const end = keys.begin() + key_count;
  const auto* const found =
      std::find_if(keys.begin(), end, [&](const SecurityKey& key) { return key.id == key_id; });
  return found == end ? nullptr : found;
}

Authenticity authenticate(const SecurityAssociation& association,
                          std::span<const std::uint8_t> message) noexcept {
  const auto tlv = find_authentication(message);
  if (!tlv) {
    return tlv.error() == AuthenticationFault::kMissing ? Authenticity::kMissing
                                                        : Authenticity::kUnsupported;
  }
  const SecurityKey* const key = association.find(tlv->key_id);
  if (tlv->spp != association.spp || key == nullptr) return Authenticity::kUnknownKey;
  // A shorter code would be easier to guess: its length is the key's to say.
  if (tlv->code_octets != key->code_octets) return Authenticity::kUnsupported;
  Code expected{};
  const std::span<std::uint8_t> code = std::span(expected).first(key->code_octets);
  const bool computed = compute(association, *key, message.first(tlv->covered), code);
  const bool same = equal(code, message.subspan(tlv->covered, tlv->code_octets));
  return computed && same ? Authenticity::kAuthentic : Authenticity::kWrongCode;
}

bool seal(const SecurityAssociation& association, MessageBytes& message) noexcept {
  const SecurityKey* const key = association.find(association.active_key_id);
  if (key == nullptr || key->code_octets > kMaximumCodeSize) return false;
  const std::size_t length = message.size;
  const std::size_t covered = length + kAuthenticationHeaderSize;
  if (covered + key->code_octets > message.octets.size()) return false;
  write_authentication(message.octets, length, association.spp, key->id, key->code_octets);
  if (!compute(association, *key, std::span(message.octets).first(covered),
               std::span(message.octets).subspan(covered, key->code_octets))) {
    return false;
  }
  message.size = static_cast<std::uint8_t>(covered + key->code_octets);
  return true;
}

}  // namespace ftcs::ptp
