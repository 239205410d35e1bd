// SPDX-License-Identifier: MIT
#include "ftcs/ptp/wire/identity.h"

#include <charconv>

namespace ftcs::ptp {
namespace {
void append(IdentityText& text, char character) noexcept {
  text.characters[text.size++] = character;
}
}  // namespace

IdentityText to_text(const ClockIdentity& identity) noexcept {
  constexpr std::string_view kDigits = "0123456789abcdef";
  constexpr std::size_t kFirstDot = 3;
  constexpr std::size_t kSecondDot = 5;
  IdentityText text;
  for (std::size_t i = 0; i < identity.octets.size(); ++i) {
    if (i == kFirstDot || i == kSecondDot) append(text, '.');
    append(text, kDigits[identity.octets[i] >> 4]);
    append(text, kDigits[identity.octets[i] & 0xFU]);
  }
  return text;
}

IdentityText to_text(const PortIdentity& identity) noexcept {
  IdentityText text = to_text(identity.clock);
  append(text, '-');
  char* const begin = text.characters.data();
  const auto written =
      std::to_chars(begin + text.size, begin + text.characters.size(), identity.port);
  text.size = static_cast<std::uint8_t>(written.ptr - begin);
  return text;
}

}  // namespace ftcs::ptp
