// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <utility>
#include <variant>

namespace ftcs {

/// Calls the visitor with what the variant holds, as std::visit; which throws for a variant without
/// a value, so that without exceptions abort() and what hangs on it is linked. Here such a variant
/// is undefined: one of trivially copyable types never loses its value. The visitor must return the
/// same type for each alternative; that is chosen by a chain of comparisons, one per alternative.
template <std::size_t first = 0, class Visitor, class Variant>
constexpr decltype(auto) visit(Visitor&& visitor, Variant& variant) {
  using Content = std::remove_const_t<Variant>;
  if constexpr (first + 1 == std::variant_size_v<Content>) {
    return std::forward<Visitor>(visitor)(*std::get_if<first>(&variant));
  } else {
    if (variant.index() == first) {
      return std::forward<Visitor>(visitor)(*std::get_if<first>(&variant));
    }
    return ftcs::visit<first + 1>(std::forward<Visitor>(visitor), variant);
  }
}

}  // namespace ftcs
