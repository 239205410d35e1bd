// SPDX-License-Identifier: MIT
#include "ftcs/daemon/security_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <optional>

#include <fmt/core.h>

#include "ftcs/ptp/security_association.h"

namespace ftcs::daemon {
namespace {

using Wrong = std::optional<std::string>;
using Words = std::vector<std::string_view>;
using Octets = std::vector<std::uint8_t>;

constexpr std::string_view kBlank = " \t\r";

Words split(std::string_view line) {
  Words words;
  while (true) {
    const auto begin = line.find_first_not_of(kBlank);
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const auto end = std::min(line.find_first_of(kBlank), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

bool same_word(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char one, unsigned char other) {
    return std::tolower(one) == std::tolower(other);
  });
}

std::optional<std::uint32_t> whole(std::string_view text, std::uint32_t lowest,
                                   std::uint32_t highest) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (value < lowest || value > highest) return std::nullopt;
  return value;
}

template <class Target>
Wrong set(std::string_view name, std::string_view text, std::uint32_t highest, Target& target) {
  const auto value = whole(text, 0, highest);
  if (!value) return fmt::format("{}: expected a number, 0 to {}", name, highest);
  target = static_cast<Target>(*value);
  return std::nullopt;
}

std::optional<Octets> from_hex(std::string_view text) {
  constexpr int kHexadecimal = 16;
  Octets octets;
  if (text.size() % 2 != 0) return std::nullopt;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    std::uint8_t octet = 0;
    const char* const end = text.data() + i + 2;
    const auto read = std::from_chars(text.data() + i, end, octet, kHexadecimal);
    if (read.ec != std::errc{} || read.ptr != end) return std::nullopt;
    octets.push_back(octet);
  }
  return octets;
}

/// RFC 4648, 4.
std::optional<Octets> from_base64(std::string_view text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  Octets octets;
  if (text.size() % 4 != 0) return std::nullopt;
  for (int padding = 0; padding < 2 && text.ends_with('='); ++padding) text.remove_suffix(1);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char digit : text) {
    const auto value = kDigits.find(digit);
    if (value == std::string_view::npos) return std::nullopt;
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    octets.push_back(static_cast<std::uint8_t>(bits >> static_cast<unsigned>(count)));
  }
  return octets;
}

std::optional<Octets> key_from(std::string_view text) {
  const auto behind = [&text](std::string_view prefix) { return text.substr(prefix.size()); };
  if (text.starts_with("HEX:")) return from_hex(behind("HEX:"));
  if (text.starts_with("B64:")) return from_base64(behind("B64:"));
  if (text.starts_with("ASCII:")) text = behind("ASCII:");
  return Octets(text.begin(), text.end());
}

Result<KeyLine, std::string> parse_key(const Words& words) {
  if (words.size() < 3 || words.size() > 4) {
    return std::string(
        "expected spp, seqid_window, allow_mutable or a key: id type [length] value");
  }
  const auto id = whole(words[0], 1, std::numeric_limits<std::uint32_t>::max());
  if (!id) return std::string("the id of a key: expected a number, 1 to 4294967295");
  const auto kind = platform::code_kind_from_name(words[1]);
  if (!kind) {
    return fmt::format("key {}: its type: expected SHA256-128, SHA256, AES128 or AES256", *id);
  }
  auto key = key_from(words.back());
  if (!key || key->empty()) {
    return fmt::format(
        "key {}: expected ASCII:text, HEX: with two digits for each octet or B64: in Base64", *id);
  }
  const std::size_t needed = platform::key_octets(*kind);
  if (needed != 0 && key->size() != needed) {
    return fmt::format("key {}: has {} octets, {} needs {}", *id, key->size(), words[1], needed);
  }
  if (words.size() == 3) return KeyLine{*id, *kind, std::move(*key)};
  const auto length = whole(words[2], 1, std::numeric_limits<std::uint32_t>::max());
  if (!length) return fmt::format("key {}: its length: expected a number, at least 1", *id);
  if (*length != key->size()) {
    return fmt::format("key {}: has {} octets, its length says {}", *id, key->size(), *length);
  }
  return KeyLine{*id, *kind, std::move(*key)};
}

class Parser {
 public:
  Wrong read(std::string_view line) {
    const Words words = split(line);
    if (words.empty() || words[0].starts_with('#')) return std::nullopt;
    if (words.size() == 1 && same_word(words[0], "[security_association]")) {
      open_ = false;
      return std::nullopt;
    }
    if (words.size() == 2 && words[0] == "spp") return begin(words[1]);
    if (!open_) return "expected 'spp N' at the beginning of an association";
    AssociationLines& association = found_.back();
    return words.size() == 2 ? setting(words, association) : key(words, association);
  }
  [[nodiscard]] std::vector<AssociationLines>& found() { return found_; }

 private:
  Wrong begin(std::string_view text) {
    AssociationLines association;
    if (auto wrong = set("spp", text, 255, association.spp)) return wrong;
    for (const AssociationLines& known : found_) {
      if (known.spp == association.spp) return fmt::format("spp {} comes twice", known.spp);
    }
    found_.push_back(association);
    open_ = true;
    return std::nullopt;
  }
  static Wrong setting(const Words& words, AssociationLines& association) {
    constexpr std::uint32_t kWidest = 32767;
    std::uint32_t unused = 0;
    if (words[0] == "seqid_window") {
      return set(words[0], words[1], kWidest, association.seqid_window);
    }
    if (words[0] == "allow_mutable") return set(words[0], words[1], 1, association.allow_mutable);
    // Fields of the TLV that IEEE 1588-2019 reserves; ptp4l takes the same one value.
    if (words[0] == "seqnum_length" || words[0] == "res_length") {
      return set(words[0], words[1], 0, unused);
    }
    return "expected seqid_window, allow_mutable or a key: id type [length] value";
  }
  static Wrong key(const Words& words, AssociationLines& association) {
    auto key = parse_key(words);
    if (!key) return key.error();
    for (const KeyLine& known : association.keys) {
      if (known.id == key->id) return fmt::format("key {} comes twice", known.id);
    }
    if (association.keys.size() == ptp::SecurityAssociation::kMaximumKeys) {
      return fmt::format("more than {} keys in one association",
                         ptp::SecurityAssociation::kMaximumKeys);
    }
    association.keys.push_back(std::move(*key));
    return std::nullopt;
  }

  std::vector<AssociationLines> found_{};
  bool open_ = false;
};

}  // namespace

Result<std::vector<AssociationLines>, std::string> parse_security_file(std::string_view text) {
  Parser parser;
  for (int number = 1; !text.empty(); ++number) {
    const auto end = std::min(text.find('\n'), text.size());
    if (const auto wrong = parser.read(text.substr(0, end))) {
      return fmt::format("line {}: {}", number, *wrong);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return std::move(parser.found());
}

}  // namespace ftcs::daemon
