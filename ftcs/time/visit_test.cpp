// SPDX-License-Identifier: MIT
#include "ftcs/time/visit.h"

#include <cstdint>
#include <variant>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

using Number = std::variant<std::uint8_t, std::int64_t, double>;

constexpr double twice(const Number& number) {
  return ftcs::visit([](const auto& value) { return 2.0 * static_cast<double>(value); }, number);
}

TEST(Visit, calls_the_visitor_with_what_the_variant_holds) {
  EXPECT_EQ(twice(std::uint8_t{3}), 6.0);
  EXPECT_EQ(twice(std::int64_t{-4}), -8.0);
  EXPECT_EQ(twice(0.25), 0.5);
}

TEST(Visit, lets_the_visitor_change_what_the_variant_holds) {
  Number number = std::int64_t{41};
  ftcs::visit(
      [](auto& value) { value = static_cast<std::remove_reference_t<decltype(value)>>(value + 1); },
      number);
  EXPECT_EQ(std::get<std::int64_t>(number), 42);
}

}  // namespace
}  // namespace ftcs
