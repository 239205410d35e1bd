// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "ftcs/experiment/scenario_error.h"
#include "ftcs/time/duration.h"

namespace ftcs::experiment {

/// Permitted values of a number, both ends included.
struct Range {
  double least;
  double most;
};
inline constexpr Range kPositive{1e-9, 1e18};
inline constexpr Range kNotNegative{0.0, 1e18};
inline constexpr Range kAny{-1e18, 1e18};

/// A table of a TOML file that is read key by key. Every complaint names file, line and column;
/// finish() complains about keys that nobody asked for and names the nearest one that somebody did.
/// All getters throw ScenarioError.
class TomlTable {
 public:
  TomlTable(toml::table root, std::string file);

  [[nodiscard]] bool has(std::string_view key) const { return table_->contains(key); }

  [[nodiscard]] std::optional<Duration> duration(std::string_view key, Range ns);
  [[nodiscard]] std::optional<double> ratio(std::string_view key, Range range);
  [[nodiscard]] std::optional<double> ratio_per_second(std::string_view key);
  [[nodiscard]] std::optional<double> ratio_per_root_second(std::string_view key);
  [[nodiscard]] std::optional<double> number(std::string_view key, Range range);
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view key, Range range);
  [[nodiscard]] std::optional<bool> boolean(std::string_view key);
  [[nodiscard]] std::optional<std::string> text(std::string_view key);
  /// One of the given words.
  [[nodiscard]] std::optional<std::string> word(std::string_view key,
                                                const std::vector<std::string>& words);
  [[nodiscard]] std::vector<std::string> texts(std::string_view key);
  [[nodiscard]] std::vector<double> numbers(std::string_view key);
  [[nodiscard]] std::optional<TomlTable> table(std::string_view key);
  /// [[key]]
  [[nodiscard]] std::vector<TomlTable> tables(std::string_view key);
  /// The keys as they stand, for a table whose keys are names.
  [[nodiscard]] std::vector<std::string> keys() const;

  /// Times below may then be written as "50 cycles"; holds for tables read from this one later.
  void set_cycle(Duration cycle) noexcept { cycle_ns_ = cycle.ns(); }
  /// A path as it stands in the file: relative to the file, not to the working directory.
  [[nodiscard]] std::string beside(const std::string& path) const;

  /// Complains if a key of this table was never asked for.
  void finish() const;
  [[noreturn]] void fail(std::string_view key, const std::string& message,
                         const std::string& hint = "") const;
  [[noreturn]] void fail_here(const std::string& message, const std::string& hint = "") const;

 private:
  TomlTable(const TomlTable& parent, const toml::table& table, std::string name);
  const toml::node* find(std::string_view key);
  [[nodiscard]] std::string where(const toml::source_region& region) const;
  std::optional<double> quantity(std::string_view key, std::string_view what,
                                 std::optional<double> (*parse)(std::string_view) noexcept);
  [[nodiscard]] std::optional<double> in_cycles(std::string_view key) const;
  double in_range(std::string_view key, double value, Range range) const;

  // Shared, because a copy of a toml::table forgets its lines.
  std::shared_ptr<const toml::table> root_;
  const toml::table* table_;
  std::string file_;
  std::string name_;
  double cycle_ns_ = 0.0;
  std::set<std::string, std::less<>> known_;
};

/// The root of a file or text. Throws ScenarioError on a syntax error or an unreadable file.
[[nodiscard]] toml::table parse_toml_file(const std::string& path);
[[nodiscard]] std::string read_text_file(const std::string& path);
[[nodiscard]] toml::table parse_toml_text(std::string_view text, const std::string& name);

}  // namespace ftcs::experiment
