// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace ftcs {

/// One entry of a table: what people read, and the number behind it for CSV.
struct Cell {
  std::string text;
  double number = 0.0;
  bool numeric = false;

  Cell(std::string words) : text(std::move(words)) {}  // NOLINT(google-explicit-constructor)
  Cell(const char* words) : text(words) {}             // NOLINT(google-explicit-constructor)
  [[nodiscard]] static Cell significant(double value, int digits = 4);
  [[nodiscard]] static Cell fixed(double value, int decimals);
  [[nodiscard]] static Cell count(unsigned long long value);
};

/// Rows under headings. One table serves the console, CSV and HTML.
class Table {
 public:
  explicit Table(std::vector<std::string> headings) : headings_(std::move(headings)) {}

  /// Shorter rows are filled with empty cells; cells beyond the headings are dropped.
  void add_row(std::vector<Cell> cells);

  [[nodiscard]] const std::vector<std::string>& headings() const noexcept { return headings_; }
  [[nodiscard]] const std::vector<std::vector<Cell>>& rows() const noexcept { return rows_; }
  /// A column is right-justified if none of its cells holds words other than "-".
  [[nodiscard]] bool right_justified(std::size_t column) const noexcept;

  /// Columns two spaces apart, a line of dashes under the headings, every line ends with a newline.
  /// No colour, no control characters (they become '?'), no trailing spaces. Width counts code
  /// points.
  [[nodiscard]] std::string to_text() const;
  /// RFC 4180 with "\n": fields with a comma, a quote or a line break are quoted. Numbers in the
  /// shortest form that reads back to the same double; no figure = empty field.
  [[nodiscard]] std::string to_csv() const;

 private:
  std::vector<std::string> headings_;
  std::vector<std::vector<Cell>> rows_;
};

/// One CSV field, quoted if it must be.
[[nodiscard]] std::string csv_field(const std::string& text);
/// Shortest form that reads back; empty if not finite.
[[nodiscard]] std::string csv_number(double value);

/// A time for people: four significant digits and a unit that fits, "-1.234 us".
[[nodiscard]] std::string format_time(double ns);

}  // namespace ftcs
