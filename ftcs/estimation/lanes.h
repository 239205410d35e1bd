// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ftcs::estimation {

/// Two numbers computed at once: the vector register that every 64-bit machine
/// has (SSE2, NEON), by the vector types of gcc and clang. Each lane gets the
/// bits that it would get alone, so that results do not depend on the machine.
/// Compilers leave the loops of the bank scalar at -O2.
using Pair = double __attribute__((vector_size(16)));
using PairBits = std::uint64_t __attribute__((vector_size(16)));
using Quad = float __attribute__((vector_size(16)));

/// What `count` models are computed with: pairs, or one by one if their number
/// is odd.
template <std::size_t count>
struct LanesOf {
  using Type = double;
};
template <std::size_t count>
requires(count % 2 == 0) struct LanesOf<count> {
  using Type = Pair;
};

template <class V>
inline constexpr std::size_t kLanes = sizeof(V) / sizeof(double);

/// V is double, a vector or a struct of them; `from` and `to` need no alignment.
template <class V, class Element>
[[nodiscard]] inline V load(const Element* from) noexcept {
  V v;
  std::memcpy(static_cast<void*>(&v), from, sizeof v);
  return v;
}
template <class V, class Element>
inline void store(Element* to, const V& v) noexcept {
  std::memcpy(static_cast<void*>(to), &v, sizeof v);
}

/// As std::min and std::max: the first if they are equal or not comparable. (So SSE2 has it in one
/// instruction, with the second operand for the first; compilers do not find that.)
template <class V>
[[nodiscard]] inline V lesser(const V& a, const V& b) noexcept {
#if defined(__SSE2__)
  if constexpr (std::is_same_v<V, Pair>) return _mm_min_pd(b, a);
#endif
  return b < a ? b : a;
}
template <class V>
[[nodiscard]] inline V larger(const V& a, const V& b) noexcept {
#if defined(__SSE2__)
  if constexpr (std::is_same_v<V, Pair>) return _mm_max_pd(b, a);
  if constexpr (std::is_same_v<V, Quad>) return _mm_max_ps(b, a);
#endif
  return a < b ? b : a;
}
template <class V>
[[nodiscard]] inline V magnitude(const V& a) noexcept {
  return a < V{} ? -a : a;
}

/// Whether any lane of a comparison's result is set.
template <class Mask>
[[nodiscard]] inline bool any(const Mask& mask) noexcept {
#if defined(__SSE2__)
  return _mm_movemask_epi8(std::bit_cast<__m128i>(mask)) != 0;
#else
  const auto halves = std::bit_cast<PairBits>(mask);
  return (halves[0] | halves[1]) != 0;
#endif
}

[[nodiscard]] inline double root(double v) noexcept { return std::sqrt(v); }
[[nodiscard]] inline Pair root(const Pair& v) noexcept {
  return Pair{std::sqrt(v[0]), std::sqrt(v[1])};
}

/// One lane of several; of a number alone there is one.
[[nodiscard]] inline double lane_of(double v, std::size_t) noexcept { return v; }
[[nodiscard]] inline double lane_of(const Pair& v, std::size_t i) noexcept { return v[i]; }
inline void set_lane_of(double& v, std::size_t, double value) noexcept { v = value; }
inline void set_lane_of(Pair& v, std::size_t i, double value) noexcept { v[i] = value; }

/// One number of all lanes.
[[nodiscard]] inline double total(double v) noexcept { return v; }
[[nodiscard]] inline double total(const Pair& v) noexcept { return v[0] + v[1]; }
[[nodiscard]] inline double largest(double v) noexcept { return v; }
[[nodiscard]] inline double largest(const Pair& v) noexcept { return larger(v[0], v[1]); }
[[nodiscard]] inline double least(double v) noexcept { return v; }
[[nodiscard]] inline double least(const Pair& v) noexcept { return lesser(v[0], v[1]); }

}  // namespace ftcs::estimation
