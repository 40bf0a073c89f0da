// Positions as triples, seen where they are stored: as entries of three or of four floats. A view, valid as long as the
// table that it looks at.
#pragma once

#include <cstddef>
#include <iterator>

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

  std::size_t size() const { return size_; }
  Vec3f operator[](std::size_t i) const { return Eigen::Map<const Vec3f>(first_ + i * stride_); }

  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Vec3f;
    using difference_type = std::ptrdiff_t;
    using pointer = void;
    using reference = Vec3f;

    Iterator() = default;
    Iterator(const PositionsView& view, std::size_t at) : first_(view.first_), stride_(view.stride_), at_(at) {}
    Vec3f operator*() const { return Eigen::Map<const Vec3f>(first_ + at_ * stride_); }
    Iterator& operator++() { return ++at_, *this; }
    Iterator operator++(int) {
      const Iterator before = *this;
      ++at_;
      return before;
    }
    bool operator==(const Iterator& other) const { return at_ == other.at_; }

   private:
    const float* first_ = nullptr;
    std::size_t stride_ = 3, at_ = 0;
  };
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size_}; }

 private:
  const float* first_ = nullptr;
  std::size_t size_ = 0, stride_ = 3;
};

}  // namespace sectio
