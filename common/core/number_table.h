// A hash table from numbers to values, for many look-ups and no iteration: open addressing, a power of two of places,
// at most half of them taken. A number is any of 64 bits but the largest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace sectio {

template <class T>
class NumberTable {
 public:
  // The value of a number, T{} when it is new. Valid until the next number is new.
  T& at(std::uint64_t number) { return insert(number).first; }
  // The value of a number as from at(), and whether the number is new.
  std::pair<T&, bool> insert(std::uint64_t number) {
    if (2 * (count_ + 1) > places_.size()) grow();
    Place& place = place_of(number);
    const bool is_new = place.number == kFree;
    place.number = number;
    count_ += is_new;
    return {place.value, is_new};
  }
  // Null when the number has no value.
  const T* find(std::uint64_t number) const { return const_cast<NumberTable*>(this)->find(number); }
  T* find(std::uint64_t number) {
    if (places_.empty()) return nullptr;
    Place& place = place_of(number);
    return place.number == number ? &place.value : nullptr;
  }
  bool contains(std::uint64_t number) const { return find(number) != nullptr; }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  struct Place {
    std::uint64_t number = kFree;
    T value{};
  };

  Place& place_of(std::uint64_t number) {
    std::uint64_t hash = number * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
    std::size_t k = hash & (places_.size() - 1);
    while (places_[k].number != number && places_[k].number != kFree) k = (k + 1) & (places_.size() - 1);
    return places_[k];
  }
  void grow() {
    std::vector<Place> before(places_.empty() ? 64 : 2 * places_.size());
    before.swap(places_);
    for (Place& place : before)
      if (place.number != kFree) place_of(place.number) = std::move(place);
  }

  std::vector<Place> places_;
  std::size_t count_ = 0;
};

struct Nothing {};

// A set of numbers, stored in the same way.
class NumberSet {
 public:
  bool insert(std::uint64_t number) { return table_.insert(number).second; }  // false when it has the number
  bool contains(std::uint64_t number) const { return table_.contains(number); }

 private:
  NumberTable<Nothing> table_;
};

}  // namespace sectio
