// SPDX-License-Identifier: MIT
#include "apps/ftcs/config_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

#include <fmt/core.h>

#include "apps/ftcs/ptp_option_table.h"

namespace ftcs::app {
namespace {

constexpr std::string_view kBlank = " \t\r";
constexpr std::size_t kLongestLine = 1'000;
constexpr std::size_t kLargestFile = 1'000'000;

/// A terminal obeys control characters.
std::string printable(std::string text) {
  for (char& c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < ' ' || code == 0x7F) c = '?';
  }
  return text;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// ptp4l's tables of unicast transmitters and the like, and what else cannot be an interface.
bool is_unsupported_section(std::string_view section) {
  return section == "unicast_master_table" || section == "message_tag" || section.empty();
}

std::optional<std::string> enter_section(std::string_view line, daemon::PtpOptions& options) {
  if (line.back() != ']') return "a section needs a closing bracket";
  const std::string_view section = trimmed(line.substr(1, line.size() - 2));
  if (section == "global") return std::nullopt;
  if (is_unsupported_section(section)) {
    return fmt::format("section '{}' is not supported", section);
  }
  if (!options.interface.empty() && options.interface != section) {
    return fmt::format("a second interface '{}': only one port is supported", section);
  }
  options.interface = section;
  return std::nullopt;
}

std::optional<std::string> read_line(std::string_view line, bool& in_section,
                                     daemon::PtpOptions& options) {
  if (line.front() == '[') {
    in_section = true;
    return enter_section(line, options);
  }
  if (!in_section) return "a setting before the first section";
  const std::size_t blank = line.find_first_of(kBlank);
  if (blank == std::string_view::npos) return fmt::format("'{}' has no value", line);
  return apply_setting(options, line.substr(0, blank), trimmed(line.substr(blank)));
}

}  // namespace

std::optional<std::string> read_config_text(std::string_view text, std::string_view name,
                                            daemon::PtpOptions& options) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // UTF-8, as some editors begin
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  bool in_section = false;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    if (line.size() > kLongestLine) {
      return fmt::format("{}:{}: a line of {} characters; expected {} at most", name, number,
                         line.size(), kLongestLine);
    }
    if (const auto wrong = read_line(line, in_section, options)) {
      return fmt::format("{}:{}: {}", name, number, printable(*wrong));
    }
  }
  return std::nullopt;
}

std::optional<std::string> read_config_file(const std::string& path, daemon::PtpOptions& options) {
  std::ifstream file(path);
  // A folder can be opened, but not read.
  if (!file || (file.peek(), file.bad())) return fmt::format("{}: {}", path, std::strerror(errno));
  std::string text(kLargestFile + 1, '\0');
  if (!file.eof()) file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kLargestFile) {
    return fmt::format("{}: longer than {} characters: no configuration file", path, kLargestFile);
  }
  return read_config_text(text, path, options);
}

}  // namespace ftcs::app
