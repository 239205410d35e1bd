// SPDX-License-Identifier: MIT
#include "ftcs/estimation/lanes.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace ftcs::estimation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double, 7> kNumbers = {
    0.0, -0.0, 1.0, -1.0, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()};

std::uint64_t bits(double v) { return std::bit_cast<std::uint64_t>(v); }
std::uint32_t bits(float v) { return std::bit_cast<std::uint32_t>(v); }

/// Whether a vector instruction is used or not: zeros of either sign and what cannot be compared
/// too.
TEST(Lanes, have_the_bits_that_a_number_alone_has) {
  for (const double a : kNumbers) {
    for (const double b : kNumbers) {
      const Pair left{a, 2.0};
      const Pair right{b, 3.0};
      EXPECT_EQ(bits(larger<Pair>(left, right)[0]), bits(a < b ? b : a)) << a << ' ' << b;
      EXPECT_EQ(bits(lesser<Pair>(left, right)[0]), bits(b < a ? b : a)) << a << ' ' << b;
      const auto x = static_cast<float>(a);
      const auto y = static_cast<float>(b);
      const Quad one{1.0F, x, 2.0F, 3.0F};
      const Quad other{0.0F, y, 3.0F, 2.0F};
      EXPECT_EQ(bits(larger<Quad>(one, other)[1]), bits(x < y ? y : x)) << a << ' ' << b;
    }
  }
}

TEST(Lanes, any_sees_each_of_them) {
  EXPECT_FALSE(any(Quad{} > Quad{}));
  for (std::size_t lane = 0; lane < 4; ++lane) {
    Quad above{};
    above[lane] = 1.0F;
    EXPECT_TRUE(any(above > Quad{})) << lane;
  }
}

}  // namespace
}  // namespace ftcs::estimation
