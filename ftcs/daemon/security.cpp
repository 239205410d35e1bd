// SPDX-License-Identifier: MIT
#include "ftcs/daemon/security.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/core.h>

#include "ftcs/daemon/security_file.h"
#include "ftcs/platform/durable_file.h"
#include "ftcs/platform/os_error.h"

namespace ftcs::daemon {
namespace {

/// The content of a regular file that is not absurdly large.
Result<std::vector<char>, std::string> read_text(const std::string& path) {
  constexpr std::size_t kLargest = 1 << 20;
  auto text = platform::read_regular(path, kLargest);
  if (text) return std::move(*text);
  switch (text.error()) {
    case EINVAL:
      return std::string("expected a regular file");
    case EFBIG:
      return std::string("more than 1 MiB");
    case EACCES:
      return std::string("cannot be read (its owner and root may; --user changes who asks)");
    default:
      return std::generic_category().message(text.error());
  }
}

}  // namespace

std::optional<std::string> Security::load() {
  const auto complain = [this](const std::string& what) {
    return fmt::format("sa_file {}: {}", options_.sa_file, what);
  };
  const auto text = read_text(options_.sa_file);
  if (!text) return complain(text.error());
  const auto parsed = parse_security_file({text->data(), text->size()});
  if (!parsed) return complain(parsed.error());
  const auto lines = std::ranges::find_if(
      *parsed, [this](const AssociationLines& one) { return one.spp == options_.spp; });
  if (lines == parsed->end()) return complain(fmt::format("has no spp {}", *options_.spp));

  ptp::SecurityAssociation association;
  std::vector<std::unique_ptr<platform::KeyedCode>> codes;
  association.spp = lines->spp;
  association.sequence_window = lines->seqid_window;
  association.allow_mutable = lines->allow_mutable;
  association.active_key_id = options_.active_key_id;
  for (const KeyLine& key : lines->keys) {
    auto code = platform::KeyedCode::open(key.kind, key.key);
    if (!code) return complain(fmt::format("key {}: {}", key.id, code.error().reason));
    association.add({key.id, platform::code_octets(key.kind), code->get()});
    codes.push_back(std::move(*code));
  }
  if (association.find(options_.active_key_id) == nullptr) {
    return complain(
        fmt::format("spp {} has no key {} (active_key_id)", lines->spp, options_.active_key_id));
  }
  association_ = association;
  codes_ = std::move(codes);
  return std::nullopt;
}

std::string Security::description() const {
  return fmt::format("spp {}, {} key{}, sends by key {}", association_.spp, association_.key_count,
                     association_.key_count == 1 ? "" : "s", association_.active_key_id);
}

bool Security::is_readable_by_others() const {
  using std::filesystem::perms;
  std::error_code wrong;
  const auto status = std::filesystem::status(options_.sa_file, wrong);
  return !wrong && (status.permissions() & perms::others_read) != perms::none;
}

}  // namespace ftcs::daemon
