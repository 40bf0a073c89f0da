// Tables with an entry a vertex or triangle slot grow with every cut. They are given room beforehand: a table that has
// to move costs O(mesh) in the middle of a cut.
#pragma once

#include <cstddef>
#include <vector>

namespace sectio {

constexpr std::size_t with_room(std::size_t slots) {
  return slots + slots / 4 + 1024;
}

// Of tables as they are before the first cut.
template <class... Tables>
void give_room(Tables&... tables) {
  (tables.reserve(with_room(tables.size())), ...);
}

template <class T>
void resize_slots(std::vector<T>& table, std::size_t slots, const T& value) {
  if (table.capacity() < slots) table.reserve(with_room(slots));
  table.resize(slots, value);
}

}  // namespace sectio
