// SPDX-License-Identifier: MIT
// World: one small table on its three ways out.
#include "ftcs/report/table.h"

#include <gtest/gtest.h>

#include "ftcs/analysis/statistics.h"

namespace ftcs {
namespace {

Table servos() {
  Table table({"servo", "RMS / ns", "cycles"});
  table.add_row({"FTCS", Cell::fixed(126.04, 1), Cell::count(1)});
  table.add_row({"linuxptp, PI", Cell::fixed(9.5, 1), Cell::fixed(kNoFigure, 0)});
  return table;
}

TEST(Table, aligns_words_to_the_left_and_numbers_to_the_right) {
  EXPECT_EQ(servos().to_text(),
            "servo         RMS / ns  cycles\n"
            "------------  --------  ------\n"
            "FTCS             126.0       1\n"
            "linuxptp, PI       9.5       -\n");
}

TEST(Table, counts_code_points_not_bytes) {
  Table table({"a", "b"});
  table.add_row({"\xC2\xB5s", "x"});  // micro sign: two bytes, one column
  EXPECT_EQ(table.to_text(), "a   b\n--  -\n\xC2\xB5s  x\n");
}

TEST(Table, does_not_pass_on_control_characters) {
  Table table({"name"});
  table.add_row({"a\x1b[31m\nb"});
  EXPECT_EQ(table.to_text().find('\x1b'), std::string::npos);
  EXPECT_NE(table.to_text().find("a?[31m?b"), std::string::npos);
}

TEST(Table, writes_csv_that_reads_back_exactly) {
  Table table({"name", "value, exact"});
  table.add_row({"a \"quoted\"", Cell::fixed(0.1, 0)});
  table.add_row({"two\nlines", Cell::significant(kNoFigure)});
  EXPECT_EQ(table.to_csv(), "name,\"value, exact\"\n\"a \"\"quoted\"\"\",0.1\n\"two\nlines\",\n");
}

TEST(Table, fills_short_rows_and_cuts_long_ones) {
  Table table({"a", "b"});
  table.add_row({"1"});
  table.add_row({"1", "2", "3"});
  EXPECT_EQ(table.to_csv(), "a,b\n1,\n1,2\n");
}

}  // namespace
}  // namespace ftcs
