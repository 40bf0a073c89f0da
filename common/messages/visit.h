// The kinds of values that a field may have, which all visitors of fields() share.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "common/math/types.h"

namespace sectio::visit {

struct Nobody {
  template <class T, class... More>
  void operator()(const char*, T&, More...) {}
};

// A struct that names its fields.
template <class T>
concept Struct = requires(Nobody& visitor, T& value) {
  fields(visitor, value);
};

template <class T>
concept Number = std::is_arithmetic_v<T>;

template <class T>
concept Enumerator = std::is_enum_v<T>;

template <class T>
concept Checked = requires(const T& value) {
  is_consistent(value);
};

template <class T>
struct IsArray : std::false_type {};
template <class T, std::size_t N>
struct IsArray<std::array<T, N>> : std::true_type {};
template <class T>
concept Array = IsArray<std::remove_const_t<T>>::value;

}  // namespace sectio::visit
