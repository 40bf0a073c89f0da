// Positions as triples, seen where they are stored: as entries of three or of four floats, in their order or by a table
// of numbers. A view, valid as long as the tables that it looks at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>

#include "common/math/types.h"

namespace sectio {

class PositionsView {
 public:
  PositionsView() = default;
  // A vector or span of Vec3f or Vec4f.
  template <class Table>
  requires requires(const Table& table) { table.data()->data(); }
  PositionsView(const Table& table)
      : first_(table.empty() ? nullptr : table.data()->data()),
        size_(table.size()),
        stride_(sizeof *table.data() / sizeof(float)) {}
  // Entry i is number[i] of the table; without numbers, entry i of it.
  template <class Table>
  PositionsView(const Table& table, std::span<const std::uint32_t> number) : PositionsView(table) {
    if (number.empty()) return;
    number_ = number.data();
    size_ = number.size();
  }

  std::size_t size() const { return size_; }
  Vec3f operator[](std::size_t i) const {
    return Eigen::Map<const Vec3f>(first_ + (number_ ? number_[i] : i) * stride_);
  }

  class Iterator;
  Iterator begin() const;
  Iterator end() const;

 private:
  const float* first_ = nullptr;
  const std::uint32_t* number_ = nullptr;
  std::size_t size_ = 0, stride_ = 3;
};

class PositionsView::Iterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = Vec3f;
  using difference_type = std::ptrdiff_t;
  using pointer = void;
  using reference = Vec3f;

  Iterator() = default;
  Iterator(const PositionsView& view, std::size_t at) : view_(view), at_(at) {}
  Vec3f operator*() const { return view_[at_]; }
  Iterator& operator++() { return ++at_, *this; }
  Iterator operator++(int) {
    const Iterator before = *this;
    ++at_;
    return before;
  }
  bool operator==(const Iterator& other) const { return at_ == other.at_; }

 private:
  PositionsView view_;
  std::size_t at_ = 0;
};

inline PositionsView::Iterator PositionsView::begin() const {
  return {*this, 0};
}
inline PositionsView::Iterator PositionsView::end() const {
  return {*this, size_};
}

}  // namespace sectio
