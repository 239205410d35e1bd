// SPDX-License-Identifier: MIT
#include "ftcs/report/table.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "ftcs/report/number_format.h"

namespace ftcs {
namespace {

/// Code points: bytes that do not continue a UTF-8 sequence.
std::size_t display_width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
  }));
}

std::string printable(std::string text) {
  for (char& byte : text) {
    const auto code = static_cast<unsigned char>(byte);
    if (code < 0x20U || code == 0x7FU) byte = '?';
  }
  return text;
}

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string space(width - std::min(width, display_width(text)), ' ');
  return right ? space + text : text + space;
}

void end_line(std::string& text) {
  while (!text.empty() && text.back() == ' ') text.pop_back();
  text += '\n';
}

}  // namespace

Cell Cell::significant(double value, int digits) {
  Cell cell(ftcs::significant(value, digits));
  cell.number = value;
  cell.numeric = true;
  return cell;
}

Cell Cell::fixed(double value, int decimals) {
  Cell cell(ftcs::fixed(value, decimals));
  cell.number = value;
  cell.numeric = true;
  return cell;
}

Cell Cell::count(unsigned long long value) {
  Cell cell(fmt::format("{}", value));
  cell.number = static_cast<double>(value);
  cell.numeric = true;
  return cell;
}

void Table::add_row(std::vector<Cell> cells) {
  cells.resize(headings_.size(), Cell(""));
  rows_.push_back(std::move(cells));
}

bool Table::right_justified(std::size_t column) const noexcept {
  bool any_number = false;
  for (const auto& row : rows_) {
    const Cell& cell = row[column];
    any_number = any_number || cell.numeric;
    if (!cell.numeric && !cell.text.empty() && cell.text != kNoFigureText) return false;
  }
  return any_number;
}

std::string Table::to_text() const {
  std::vector<std::size_t> widths;
  std::vector<bool> right;
  for (std::size_t column = 0; column < headings_.size(); ++column) {
    std::size_t width = display_width(headings_[column]);
    for (const auto& row : rows_) width = std::max(width, display_width(row[column].text));
    widths.push_back(width);
    right.push_back(right_justified(column));
  }
  constexpr const char* kBetween = "  ";
  std::string text;
  for (std::size_t column = 0; column < widths.size(); ++column) {
    if (column > 0) text += kBetween;
    text += padded(printable(headings_[column]), widths[column], right[column]);
  }
  end_line(text);
  for (std::size_t column = 0; column < widths.size(); ++column) {
    if (column > 0) text += kBetween;
    text += std::string(widths[column], '-');
  }
  end_line(text);
  for (const auto& row : rows_) {
    for (std::size_t column = 0; column < widths.size(); ++column) {
      if (column > 0) text += kBetween;
      text += padded(printable(row[column].text), widths[column], right[column]);
    }
    end_line(text);
  }
  return text;
}

std::string Table::to_csv() const {
  std::string text;
  for (std::size_t column = 0; column < headings_.size(); ++column) {
    if (column > 0) text += ',';
    text += csv_field(headings_[column]);
  }
  text += '\n';
  for (const auto& row : rows_) {
    for (std::size_t column = 0; column < row.size(); ++column) {
      if (column > 0) text += ',';
      text += row[column].numeric ? csv_number(row[column].number) : csv_field(row[column].text);
    }
    text += '\n';
  }
  return text;
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char byte : text) {
    if (byte == '"') quoted += '"';
    quoted += byte;
  }
  return quoted + '"';
}

std::string csv_number(double value) {
  if (!std::isfinite(value)) return {};
  // fmt writes the shortest digits that read back; whole numbers without a point.
  return fmt::format("{}", value);
}

std::string format_time(double ns) {
  const double magnitude = std::abs(ns);
  if (!(magnitude < 1e9)) return fmt::format("{:.3f} s", ns * 1e-9);
  if (magnitude >= 1e6) return fmt::format("{:.3f} ms", ns * 1e-6);
  if (magnitude >= 1e3) return fmt::format("{:.3f} us", ns * 1e-3);
  return fmt::format("{:.0f} ns", ns);
}

}  // namespace ftcs
