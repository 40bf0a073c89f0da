// Tables with one entry a vertex or triangle slot grow with every cut. Capacity is reserved beforehand, since a table
// that is reallocated costs O(mesh) in the middle of a cut.
#pragma once

#include <cstddef>
#include <vector>

namespace sectio {

constexpr std::size_t with_room(std::size_t slots) {
  return slots + slots / 4 + 1024;
}

// Reserves capacity for tables before the first cut.
template <class... Tables>
void give_room(Tables&... tables) {
  (tables.reserve(with_room(tables.size())), ...);
}

// Called between cuts: reserves again for tables that have used up most of their room.
template <class... Tables>
void renew_room(Tables&... tables) {
  const auto renew = [](auto& table) {
    if (table.capacity() - table.size() < table.size() / 12) table.reserve(with_room(table.size()));
  };
  (renew(tables), ...);
}

template <class T>
void resize_slots(std::vector<T>& table, std::size_t slots, const T& value) {
  if (table.capacity() < slots) table.reserve(with_room(slots));
  table.resize(slots, value);
}

}  // namespace sectio
