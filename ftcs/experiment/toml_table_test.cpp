// SPDX-License-Identifier: MIT
// World: short files with one mistake each.
#include "ftcs/experiment/toml_table.h"

#include <string>

#include <gtest/gtest.h>

namespace ftcs::experiment {
namespace {

/// What reading `text` complains of.
template <class Read>
std::string complaint(const std::string& text, Read read) {
  try {
    TomlTable table(parse_toml_text(text, "a.toml"), "a.toml");
    read(table);
    table.finish();
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "";
}

void read_interval(TomlTable& table) { (void)table.duration("interval", {1.0, 1e9}); }

TEST(TomlTable, accepts_what_it_should) {
  EXPECT_EQ(complaint("interval = \"100 us\"", read_interval), "");
}

TEST(TomlTable, names_the_place_of_an_unknown_key_and_the_nearest_known_one) {
  EXPECT_EQ(complaint("\nintreval = \"1 s\"", read_interval),
            "a.toml:2:1: unknown key intreval (did you mean interval?)");
}

TEST(TomlTable, complains_of_a_wrong_unit) {
  EXPECT_EQ(complaint("interval = \"100 ppm\"", read_interval),
            "a.toml:1:12: interval = \"100 ppm\" is not a time such as \"100 us\" (ns, us, ms, s, "
            "min, h, d)");
}

TEST(TomlTable, complains_of_a_missing_unit) {
  EXPECT_NE(complaint("interval = 100", read_interval).find("needs a text with a unit"),
            std::string::npos);
}

TEST(TomlTable, complains_of_an_impossible_value) {
  const std::string text = complaint("interval = \"-1 us\"", read_interval);
  EXPECT_NE(text.find("a.toml:1:12: interval = -1000 is out of range (permitted: 1 to "),
            std::string::npos)
      << text;
}

TEST(TomlTable, complains_of_a_wrong_type_and_a_wrong_word) {
  EXPECT_NE(complaint("a = 1.5",
                      [](TomlTable& t) {
                        (void)t.integer("a", {0, 9});
                      })
                .find("whole number"),
            std::string::npos);
  EXPECT_NE(complaint("a = \"x\"",
                      [](TomlTable& t) {
                        (void)t.word("a", {"y", "z"});
                      })
                .find("one of: y, z"),
            std::string::npos);
  EXPECT_NE(complaint("a = 1", [](TomlTable& t) { (void)t.table("a"); }).find("write [a]"),
            std::string::npos);
}

TEST(TomlTable, gives_line_and_column_of_broken_syntax) {
  const std::string text = complaint("a = 1\nb = = 2\n", [](TomlTable&) {});
  EXPECT_EQ(text.rfind("a.toml:2:", 0), 0U) << text;
}

TEST(TomlTable, an_unreadable_file_is_one_clear_error) {
  EXPECT_THROW((void)parse_toml_file("no/such/file.toml"), ScenarioError);
}

}  // namespace
}  // namespace ftcs::experiment
