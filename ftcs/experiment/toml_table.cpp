// SPDX-License-Identifier: MIT
#include "ftcs/experiment/toml_table.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "ftcs/experiment/quantity.h"

namespace ftcs::experiment {
namespace {

/// Levenshtein distance: how many letters a key is away from a known one.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0U : 1U);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string complaint(const std::string& where, const std::string& message,
                      const std::string& hint) {
  return hint.empty() ? fmt::format("{}: {}", where, message)
                      : fmt::format("{}: {} ({})", where, message, hint);
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

std::optional<double> duration_ns(std::string_view text) noexcept {
  const auto duration = parse_duration(text);
  return duration ? std::optional(duration->ns()) : std::nullopt;
}

}  // namespace

TomlTable::TomlTable(toml::table root, std::string file)
    : root_(std::make_shared<const toml::table>(std::move(root))),
      table_(root_.get()),
      file_(std::move(file)) {}

TomlTable::TomlTable(const TomlTable& parent, const toml::table& table, std::string name)
    : root_(parent.root_),
      table_(&table),
      file_(parent.file_),
      name_(std::move(name)),
      cycle_ns_(parent.cycle_ns_) {}

std::string TomlTable::where(const toml::source_region& region) const {
  if (region.begin.line == 0) return file_;
  return fmt::format("{}:{}:{}", file_, region.begin.line, region.begin.column);
}

void TomlTable::fail(std::string_view key, const std::string& message,
                     const std::string& hint) const {
  const toml::node* node = table_->get(key);
  const auto& region = node != nullptr ? node->source() : table_->source();
  throw ScenarioError(complaint(where(region), message, hint));
}

void TomlTable::fail_here(const std::string& message, const std::string& hint) const {
  throw ScenarioError(complaint(where(table_->source()), message, hint));
}

const toml::node* TomlTable::find(std::string_view key) {
  known_.emplace(key);
  return table_->get(key);
}

double TomlTable::in_range(std::string_view key, double value, Range range) const {
  if (value >= range.least && value <= range.most) return value;
  fail(key, fmt::format("{} = {} is out of range", key, value),
       fmt::format("permitted: {} to {}", range.least, range.most));
}

std::optional<double> TomlTable::quantity(
    std::string_view key, std::string_view what,
    std::optional<double> (*parse)(std::string_view) noexcept) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (const auto text = node->value_exact<std::string>()) {
    if (const auto value = parse(*text)) return value;
    fail(key, fmt::format("{} = \"{}\" is not {}", key, *text, what));
  }
  if (const auto plain = node->value<double>()) {
    if (const auto value = parse(fmt::format("{}", *plain))) return value;
  }
  fail(key, fmt::format("{} needs a text with a unit: {}", key, what));
}

std::optional<Duration> TomlTable::duration(std::string_view key, Range ns) {
  known_.emplace(key);
  if (const auto cycles = in_cycles(key)) {
    return Duration::from_ns(in_range(key, *cycles * cycle_ns_, ns));
  }
  const auto value =
      quantity(key, "a time such as \"100 us\" (ns, us, ms, s, min, h, d)", duration_ns);
  if (!value) return std::nullopt;
  return Duration::from_ns(in_range(key, *value, ns));
}

/// "50 cycles", where a cycle is known.
std::optional<double> TomlTable::in_cycles(std::string_view key) const {
  constexpr std::string_view kUnit = "cycles";
  const toml::node* node = table_->get(key);
  if (cycle_ns_ <= 0.0 || node == nullptr) return std::nullopt;
  const auto text = node->value_exact<std::string>();
  if (!text || !text->ends_with(kUnit)) return std::nullopt;
  return parse_ratio(std::string_view(*text).substr(0, text->size() - kUnit.size()));
}

std::string TomlTable::beside(const std::string& path) const {
  return (std::filesystem::path(file_).parent_path() / path).string();
}

std::optional<double> TomlTable::ratio(std::string_view key, Range range) {
  const auto value =
      quantity(key, "a fraction such as \"50 ppm\" (ppb, ppm, %, or a plain number)", parse_ratio);
  return value ? std::optional(in_range(key, *value, range)) : std::nullopt;
}

std::optional<double> TomlTable::ratio_per_second(std::string_view key) {
  return quantity(key, "a drift such as \"1 ppb/d\" (ppb, ppm, % per s, min, h, d, year)",
                  parse_ratio_per_second);
}

std::optional<double> TomlTable::ratio_per_root_second(std::string_view key) {
  return quantity(key, "a random walk such as \"1e-9 /sqrt(s)\"", parse_ratio_per_root_second);
}

std::optional<double> TomlTable::number(std::string_view key, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const auto value = node->value<double>();
  if (!value || node->is_boolean())
    fail(key, fmt::format("{} must be a number without a unit", key));
  return in_range(key, *value, range);
}

std::optional<std::int64_t> TomlTable::integer(std::string_view key, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const auto value = node->value_exact<std::int64_t>();
  if (!value) fail(key, fmt::format("{} must be a whole number", key));
  (void)in_range(key, static_cast<double>(*value), range);
  return value;
}

std::optional<bool> TomlTable::boolean(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const auto value = node->value_exact<bool>();
  if (!value) fail(key, fmt::format("{} must be true or false", key));
  return value;
}

std::optional<std::string> TomlTable::text(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  auto value = node->value_exact<std::string>();
  if (!value) fail(key, fmt::format("{} must be a text in quotes", key));
  return value;
}

std::optional<std::string> TomlTable::word(std::string_view key,
                                           const std::vector<std::string>& words) {
  auto value = text(key);
  if (value && std::find(words.begin(), words.end(), *value) == words.end()) {
    fail(key, fmt::format("{} = \"{}\" is unknown", key, *value), "one of: " + joined(words));
  }
  return value;
}

std::vector<std::string> TomlTable::texts(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr) fail(key, fmt::format("{} must be a list of texts", key));
  std::vector<std::string> values;
  for (const toml::node& element : *array) {
    auto value = element.value_exact<std::string>();
    if (!value) fail(key, fmt::format("{} must be a list of texts", key));
    values.push_back(std::move(*value));
  }
  return values;
}

std::vector<double> TomlTable::numbers(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr) fail(key, fmt::format("{} must be a list of numbers", key));
  std::vector<double> values;
  for (const toml::node& element : *array) {
    const auto value = element.value<double>();
    if (!value) fail(key, fmt::format("{} must be a list of numbers", key));
    values.push_back(*value);
  }
  return values;
}

std::optional<TomlTable> TomlTable::table(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const toml::table* inner = node->as_table();
  if (inner == nullptr)
    fail(key, fmt::format("{} must be a table", key), fmt::format("write [{}]", key));
  return TomlTable(*this, *inner,
                   name_.empty() ? std::string(key) : name_ + "." + std::string(key));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    fail(key, fmt::format("{} must be a list of tables", key), fmt::format("write [[{}]]", key));
  }
  std::vector<TomlTable> all;
  for (const toml::node& element : *array)
    all.push_back(TomlTable(*this, *element.as_table(), std::string(key)));
  return all;
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, value] : *table_) names.emplace_back(key.str());
  return names;
}

void TomlTable::finish() const {
  for (const auto& [key, value] : *table_) {
    if (known_.contains(key.str())) continue;
    std::string nearest;
    std::size_t least = key.str().size();  // farther than that is no misspelling
    for (const auto& known : known_) {
      const std::size_t d = distance(key.str(), known);
      if (d < least) {
        least = d;
        nearest = known;
      }
    }
    const std::string place = name_.empty() ? "" : fmt::format(" in [{}]", name_);
    std::vector<std::string> all(known_.begin(), known_.end());
    const std::string hint = nearest.empty() || least > 4
                                 ? "known: " + joined(all)
                                 : fmt::format("did you mean {}?", nearest);
    throw ScenarioError(
        complaint(where(key.source()), fmt::format("unknown key {}{}", key.str(), place), hint));
  }
}

toml::table parse_toml_text(std::string_view text, const std::string& name) {
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw ScenarioError(fmt::format("{}:{}:{}: {}", name, error.source().begin.line,
                                    error.source().begin.column, error.description()));
  }
}

std::string read_text_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw ScenarioError(
        fmt::format("{}: cannot be read: {}", path, std::generic_category().message(errno)));
  }
  std::ostringstream content;
  if (file && file.peek() != std::ifstream::traits_type::eof()) content << file.rdbuf();
  if (!file && !file.eof()) throw ScenarioError(fmt::format("{}: cannot be read", path));
  return content.str();
}

toml::table parse_toml_file(const std::string& path) {
  return parse_toml_text(read_text_file(path), path);
}

}  // namespace ftcs::experiment
