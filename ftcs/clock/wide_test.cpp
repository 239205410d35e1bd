// SPDX-License-Identifier: MIT
#include "ftcs/clock/wide.h"

#include <array>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

namespace ftcs {
namespace {

// Oracle: the compiler's own 128-bit integers, which every machine that runs the tests has.
__extension__ using Native = __int128;
__extension__ using UnsignedNative = unsigned __int128;
using Soft = SoftInteger128<true>;
using UnsignedSoft = SoftInteger128<false>;

template <class T>
bool same(T soft, UnsignedNative native) {
  return soft.low() == static_cast<std::uint64_t>(native) &&
         soft.high() == static_cast<std::uint64_t>(native >> 64);
}

// Every operation of one type on one pair of operands, modulo 2^128.
template <class S, class N>
void compare(std::uint64_t high, std::uint64_t low, std::uint64_t other_high,
             std::uint64_t other_low) {
  const auto bits = [](std::uint64_t h, std::uint64_t l) {
    return (static_cast<UnsignedNative>(h) << 64) | l;
  };
  const UnsignedNative a = bits(high, low);
  const UnsignedNative b = bits(other_high, other_low);
  const S x = S::from_halves(high, low);
  const S y = S::from_halves(other_high, other_low);
  ASSERT_TRUE(same(x + y, a + b));
  ASSERT_TRUE(same(x - y, a - b));
  ASSERT_TRUE(same(-x, 0 - a));
  ASSERT_TRUE(same(x * y, a * b));
  ASSERT_EQ(x == y, a == b);
  ASSERT_EQ(x < y, static_cast<N>(a) < static_cast<N>(b));
  for (const int shift : {0, 1, 31, 53, 63, 64, 65, 85, 127}) {
    ASSERT_TRUE(same(x << shift, a << shift)) << shift;
    ASSERT_TRUE(same(x >> shift, static_cast<UnsignedNative>(static_cast<N>(a) >> shift))) << shift;
  }
  const bool overflows = a == bits(std::uint64_t{1} << 63, 0) && ~b == 0;
  if (b == 0 || overflows) return;
  const auto n = static_cast<N>(a);
  const auto m = static_cast<N>(b);
  ASSERT_TRUE(same(x / y, static_cast<UnsignedNative>(n / m)));
  ASSERT_TRUE(same(x % y, static_cast<UnsignedNative>(n % m)));
}

void compare_both(std::uint64_t high, std::uint64_t low, std::uint64_t other_high,
                  std::uint64_t other_low) {
  compare<Soft, Native>(high, low, other_high, other_low);
  compare<UnsignedSoft, UnsignedNative>(high, low, other_high, other_low);
}

TEST(SoftInteger128, does_what_the_compilers_own_does_at_the_edges) {
  constexpr std::array<std::uint64_t, 9> kEdges{0,
                                                1,
                                                2,
                                                0xFFFFFFFFU,
                                                0x100000000U,
                                                1'000'000'000,
                                                0x7FFFFFFFFFFFFFFFU,
                                                0x8000000000000000U,
                                                0xFFFFFFFFFFFFFFFFU};
  for (const auto a : kEdges) {
    for (const auto b : kEdges) {
      for (const auto c : kEdges) {
        for (const auto d : kEdges) compare_both(a, b, c, d);
      }
    }
  }
}

TEST(SoftInteger128, does_what_the_compilers_own_does_with_numbers_of_every_length) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20'000; ++i) {
    const auto any = [&random] { return random() >> (random() % 64U); };
    const auto half = [&] { return random() % 3 == 0 ? 0 : any(); };
    compare_both(half(), any(), half(), any());
  }
}

TEST(SoftInteger128, takes_built_in_integers_with_their_sign) {
  EXPECT_TRUE(same(Soft{-5}, static_cast<UnsignedNative>(Native{-5})));
  EXPECT_TRUE(same(Soft{~std::uint64_t{0}}, static_cast<UnsignedNative>(~std::uint64_t{0})));
  EXPECT_EQ(static_cast<std::int64_t>(Soft{-5}), -5);
  EXPECT_EQ(static_cast<std::uint32_t>(UnsignedSoft::from_halves(7, 0x123456789U)), 0x23456789U);
  EXPECT_TRUE(Soft{-1} < 0);
  EXPECT_EQ(Soft{7} * -3 + 1, Soft{-20});
}

}  // namespace
}  // namespace ftcs
