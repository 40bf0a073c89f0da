// A vector whose copies share memory, page by page, until one of them is written: a draft of something large costs
// little more than what it changes. Reading takes two steps instead of one.
//
//   SharedPages<int, 64> base;
//   SharedPages<int, 64> draft = base;  // O(pages)
//   draft.edit(7) = 1;                  // copies one page; base stays as it is
//
// After a write, read an element again: an older reference may show its old value. A change of size, and the end of the
// vector, end all references. All copies of a vector belong to one thread.
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace sectio {

template <class T, std::size_t kPage>
class SharedPages {
  static_assert(kPage > 0 && (kPage & (kPage - 1)) == 0, "pages are found by shifts");
  using Page = std::vector<T>;

 public:
  // NOLINTNEXTLINE(readability-identifier-naming): the name that containers have
  class const_iterator {
   public:
    using iterator_category = std::random_access_iterator_tag;
    using value_type = T;
    using difference_type = std::ptrdiff_t;
    using pointer = const T*;
    using reference = const T&;

    const_iterator() = default;
    const_iterator(const SharedPages* of, std::size_t at) : of_(of), at_(at) {}
    reference operator*() const { return (*of_)[at_]; }
    pointer operator->() const { return &(*of_)[at_]; }
    reference operator[](difference_type n) const { return *(*this + n); }
    const_iterator& operator++() { return ++at_, *this; }
    const_iterator operator++(int) { return {of_, at_++}; }
    const_iterator& operator--() { return --at_, *this; }
    const_iterator operator--(int) { return {of_, at_--}; }
    const_iterator& operator+=(difference_type n) { return at_ += static_cast<std::size_t>(n), *this; }
    const_iterator& operator-=(difference_type n) { return at_ -= static_cast<std::size_t>(n), *this; }
    friend const_iterator operator+(const_iterator a, difference_type n) { return a += n; }
    friend const_iterator operator+(difference_type n, const_iterator a) { return a += n; }
    friend const_iterator operator-(const_iterator a, difference_type n) { return a -= n; }
    friend difference_type operator-(const const_iterator& a, const const_iterator& b) {
      return static_cast<difference_type>(a.at_) - static_cast<difference_type>(b.at_);
    }
    friend bool operator==(const const_iterator& a, const const_iterator& b) { return a.at_ == b.at_; }
    friend auto operator<=>(const const_iterator& a, const const_iterator& b) { return a.at_ <=> b.at_; }

   private:
    const SharedPages* of_ = nullptr;
    std::size_t at_ = 0;
  };

  SharedPages() = default;
  explicit SharedPages(std::span<const T> all) {
    for (const T& each : all) push_back(each);
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T& operator[](std::size_t i) const { return (*pages_[i / kPage])[i % kPage]; }
  const T& back() const { return (*this)[size_ - 1]; }
  const_iterator begin() const { return {this, 0}; }
  const_iterator end() const { return {this, size_}; }

  // The element, to be written: its page is this vector's own from now on.
  T& edit(std::size_t i) { return own(i / kPage)[i % kPage]; }
  void push_back(T value) {
    if (size_ % kPage == 0) {
      pages_.push_back(std::make_shared<Page>());
      pages_.back()->reserve(kPage);
    }
    own(size_ / kPage).push_back(std::move(value));
    ++size_;
  }
  void pop_back() {
    own(--size_ / kPage).pop_back();
    if (size_ % kPage == 0) pages_.pop_back();
  }
  void resize(std::size_t count, const T& value = {}) {
    while (size_ > count) pop_back();
    while (size_ < count) push_back(value);
  }

  template <class A>
  void archive(A& a) {
    std::vector<T> all(begin(), end());
    a(all);
    if (a.reads()) *this = SharedPages(std::span<const T>(all));
  }

 private:
  Page& own(std::size_t page) {
    std::shared_ptr<Page>& p = pages_[page];
    if (p.use_count() > 1) {
      auto copy = std::make_shared<Page>();
      copy->reserve(kPage);
      copy->assign(p->begin(), p->end());
      p = std::move(copy);
    }
    return *p;
  }

  std::vector<std::shared_ptr<Page>> pages_;
  std::size_t size_ = 0;
};

}  // namespace sectio
