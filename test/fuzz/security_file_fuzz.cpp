// SPDX-License-Identifier: MIT
//
// Any text as an sa_file: refused with one printable line that names where, or read as associations
// with keys of their length; written down again they are read as the same.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "ftcs/daemon/security_file.h"
#include "ftcs/ptp/security_association.h"
#include "test/fuzz/require.h"

namespace {

using namespace ftcs::daemon;
using ftcs::fuzz::require;
using ftcs::platform::CodeKind;

const char* type_of(CodeKind kind) {
  for (const char* name : {"SHA256-128", "SHA256", "AES128", "AES256"}) {
    if (ftcs::platform::code_kind_from_name(name) == kind) return name;
  }
  return "";
}

std::string written(const AssociationLines& association) {
  std::string text = fmt::format("[security_association]\nspp {}\nseqid_window {}\n",
                                 association.spp, association.seqid_window);
  text += fmt::format("allow_mutable {}\n", association.allow_mutable ? 1 : 0);
  for (const KeyLine& key : association.keys) {
    text += fmt::format("{} {} {} HEX:{:02x}\n", key.id, type_of(key.kind), key.key.size(),
                        fmt::join(key.key, ""));
  }
  return text;
}

void judge(const AssociationLines& association) {
  require(association.seqid_window <= 32767, "a window is less than half of all numbers");
  require(association.keys.size() <= ftcs::ptp::SecurityAssociation::kMaximumKeys,
          "there is room for the keys");
  for (const KeyLine& key : association.keys) {
    const auto same_id = [&key](const KeyLine& other) { return other.id == key.id; };
    require(key.id > 0 && std::ranges::count_if(association.keys, same_id) == 1, "ids are ids");
    const std::size_t needed = ftcs::platform::key_octets(key.kind);
    require(!key.key.empty() && (needed == 0 || key.key.size() == needed), "a key has its length");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto parsed = parse_security_file(text);
  if (!parsed) {
    const std::string& error = parsed.error();
    require(error.starts_with("line ") && error.size() < 160, "an error is short, and says where");
    const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
    require(std::ranges::all_of(error, printable), "an error is one line of plain characters");
    return 0;
  }
  std::string again;
  for (const AssociationLines& association : *parsed) {
    const auto same_spp = [&](const AssociationLines& one) { return one.spp == association.spp; };
    require(std::ranges::count_if(*parsed, same_spp) == 1, "an association comes once");
    judge(association);
    again += written(association);
  }
  const auto reread = parse_security_file(again);
  require(reread.ok() && reread->size() == parsed->size(), "what was read can be written");
  for (std::size_t i = 0; i < parsed->size(); ++i) {
    require(written(reread->at(i)) == written(parsed->at(i)), "and is read as the same");
  }
  return 0;
}
