// SPDX-License-Identifier: MIT
#pragma once

#include <type_traits>
#include <utility>
#include <variant>

namespace ftcs {

/// A value or the reason why there is none. No exceptions, no heap; as std::expected, which neither
/// gcc 12 nor clang 14 has in C++20. Asking for the part that is not there is a programming error
/// (undefined).
///
///     const Result<ClockReading, ClockError> applied = clock.apply(command);
///     if (!applied) return applied.error();
///     use(applied->free_running);
template <class T, class E>
class [[nodiscard]] Result {
  static_assert(!std::is_same_v<T, E>, "value and error must be different types");

 public:
  constexpr Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}  // NOLINT
  constexpr Result(E error) : content_(std::in_place_index<1>, std::move(error)) {}  // NOLINT

  [[nodiscard]] constexpr bool ok() const noexcept { return content_.index() == 0; }
  [[nodiscard]] constexpr explicit operator bool() const noexcept { return ok(); }
  [[nodiscard]] constexpr const T& value() const noexcept { return *std::get_if<0>(&content_); }
  [[nodiscard]] constexpr T& value() noexcept { return *std::get_if<0>(&content_); }
  [[nodiscard]] constexpr const E& error() const noexcept { return *std::get_if<1>(&content_); }
  [[nodiscard]] constexpr const T& operator*() const noexcept { return value(); }
  [[nodiscard]] constexpr T& operator*() noexcept { return value(); }
  [[nodiscard]] constexpr const T* operator->() const noexcept { return &value(); }
  [[nodiscard]] constexpr T* operator->() noexcept { return &value(); }

 private:
  std::variant<T, E> content_;
};

}  // namespace ftcs
