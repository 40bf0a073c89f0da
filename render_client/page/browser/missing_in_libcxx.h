// Parts of C++20 that libc++ 14, which Debian 12's emscripten brings, lacks and our sources use. Included before
// every source of the page, so that the sources themselves need not know.
#pragma once

#include <version>

#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 15000

#include <algorithm>
#include <functional>
#include <iterator>
#include <type_traits>

namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  return __builtin_bit_cast(To, from);
}

namespace ranges {

template <class Range, class Predicate>
bool any_of(const Range& range, Predicate predicate) {
  return std::any_of(std::begin(range), std::end(range), predicate);
}
template <class Range, class Predicate>
bool all_of(const Range& range, Predicate predicate) {
  return std::all_of(std::begin(range), std::end(range), predicate);
}
template <class Range, class Predicate>
auto find_if(Range& range, Predicate predicate) {
  return std::find_if(std::begin(range), std::end(range), predicate);
}
template <class Range, class Value>
auto find(Range& range, const Value& value) {
  return std::find(std::begin(range), std::end(range), value);
}
template <class Range, class Value, class Projection>
auto find(Range& range, const Value& value, Projection projection) {
  return std::find_if(std::begin(range), std::end(range),
                      [&](const auto& each) { return std::invoke(projection, each) == value; });
}
template <class Range, class Out>
void copy(const Range& range, Out out) {
  std::copy(std::begin(range), std::end(range), out);
}
template <class Range>
void sort(Range& range) {
  std::sort(std::begin(range), std::end(range));
}

}  // namespace ranges
}  // namespace std

#endif
