// The state of objects as bytes, and back: each class names its members once, for both directions.
//
//   void archive(Archive& a) { a(position_m, velocity_m_per_s, strokes_); }      beside the members, in a fixed order
//
// A member is a number, an enumerator, a vector or matrix of Eigen, a text, a container or an optional value of these,
// or an object with archive(). Members that follow from others are left out only where making them anew gives the same
// bits. Bytes are as they lie in memory: the same program reads them (common/core/program_id.h).
//
// Reading throws InputError when the bytes end too early; what has been read by then is of no use.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/core/error.h"
#include "common/math/types.h"

namespace sectio {

class Archive;

namespace archived {

template <class T>
concept Object = requires(T& value, Archive& a) {
  value.archive(a);
};

template <class T>
struct IsBytes : std::bool_constant<std::is_arithmetic_v<T> || std::is_enum_v<T>> {};
template <class T, int... Sizes>
struct IsBytes<Eigen::Matrix<T, Sizes...>> : IsBytes<T> {
  static_assert(Eigen::Matrix<T, Sizes...>::SizeAtCompileTime != Eigen::Dynamic);
};
template <class T, int... Sizes>
struct IsBytes<Eigen::Array<T, Sizes...>> : IsBytes<T> {};
template <class T, int Options>
struct IsBytes<Eigen::Quaternion<T, Options>> : IsBytes<T> {};
template <class T, std::size_t N>
struct IsBytes<std::array<T, N>> : IsBytes<T> {};

// A value that is nothing but its bytes, without padding between its parts.
template <class T>
concept Bytes = IsBytes<T>::value;

// The one copy of a text, for views of texts that are constants of the program.
std::string_view constant(const std::string& text);

}  // namespace archived

class Archive {
 public:
  explicit Archive(std::vector<std::uint8_t>& to) : to_(&to) {}
  explicit Archive(std::span<const std::uint8_t> from) : from_(from) {}

  bool reads() const { return to_ == nullptr; }
  std::size_t remaining() const { return from_.size(); }

  // Called by an object that can't save its state: the archive is then of no use.
  void refuse() { refused_ = true; }
  bool refused() const { return refused_; }

  template <class... T>
  void operator()(T&... members) {
    (member(members), ...);
  }

 private:
  void bytes(void* at, std::size_t size) {
    if (to_) {
      const auto* const from = static_cast<const std::uint8_t*>(at);
      to_->insert(to_->end(), from, from + size);
      return;
    }
    if (size > from_.size()) throw InputError("the state ends too early");
    if (size > 0) std::memcpy(at, from_.data(), size);
    from_ = from_.subspan(size);
  }
  // The number of entries; none is smaller than a byte.
  std::size_t count(std::size_t now) {
    auto n = static_cast<std::uint64_t>(now);
    member(n);
    if (reads() && n > from_.size()) throw InputError("the state ends too early");
    return n;
  }
  bool is_there(bool now) {
    member(now);
    return now;
  }

  template <archived::Bytes T>
  void member(T& value) {
    bytes(&value, sizeof value);
  }
  template <archived::Object T>
  void member(T& value) {
    value.archive(*this);
  }
  void member(Pose& pose) { (*this)(pose.position_m, pose.orientation); }
  void member(JointPose& pose) { (*this)(pose.position_m, pose.orientation, pose.opening_rad); }
  void member(bool& value) {
    std::uint8_t byte = value ? 1 : 0;
    bytes(&byte, 1);
    value = byte != 0;
  }
  void member(std::string& text) {
    text.resize(count(text.size()));
    bytes(text.data(), text.size());
  }
  void member(std::string_view& text) {
    std::string copy(text);
    member(copy);
    if (reads()) text = archived::constant(copy);
  }
  void member(std::vector<bool>& values) {
    values.resize(count(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = is_there(values[i]);
  }
  template <class T>
  void member(std::vector<T>& values) {
    const std::size_t n = count(values.size());
    if (reads()) {
      values.clear();
      values.reserve(n + n / 4);  // it may grow with every cut
      resize(values, n);
    }
    if constexpr (archived::Bytes<T>)
      bytes(values.data(), n * sizeof(T));
    else
      for (T& value : values) member(value);
  }
  template <class T>
  void member(std::deque<T>& values) {
    resize(values, count(values.size()));
    for (T& value : values) member(value);
  }
  template <class T, std::size_t N>
  requires(!archived::Bytes<std::array<T, N>>) void member(std::array<T, N>& values) {
    for (T& value : values) member(value);
  }
  template <class A, class B>
  void member(std::pair<A, B>& pair) {
    member(pair.first), member(pair.second);
  }
  template <class Key, class T>
  void member(std::map<Key, T>& map) {
    const std::size_t n = count(map.size());
    if (reads()) map.clear();
    for (auto at = map.begin(), end = map.end(); !reads() && at != end; ++at) {
      Key key = at->first;
      member(key), member(at->second);
    }
    for (std::size_t i = 0; reads() && i < n; ++i) {
      Key key{};
      member(key);
      member(map[key]);
    }
  }
  template <class T>
  void member(std::set<T>& values) {
    std::vector<T> list(values.begin(), values.end());
    member(list);
    if (reads()) values = {list.begin(), list.end()};
  }
  template <class T>
  void member(std::optional<T>& value) {
    if (!is_there(value.has_value())) return value.reset();
    if (reads()) value.emplace();
    member(*value);
  }
  template <class T>
  void member(std::unique_ptr<T>& value) {
    if (!is_there(value != nullptr)) return value.reset();
    if (reads()) value = std::make_unique<T>();
    member(*value);
  }
  // A value that nothing changes, which is shared no more once it is read.
  template <class T>
  void member(std::shared_ptr<const T>& value) {
    if (!is_there(value != nullptr)) return value.reset();
    auto copy = reads() ? std::make_shared<T>() : std::const_pointer_cast<T>(value);
    member(*copy);
    if (reads()) value = std::move(copy);
  }
  template <class Container>
  static void resize(Container& values, std::size_t n) {
    if constexpr (std::is_default_constructible_v<typename Container::value_type>)
      values.resize(n);
    else
      while (values.size() < n) values.push_back(Container::value_type::blank());
  }

  std::vector<std::uint8_t>* to_ = nullptr;  // null: the archive reads
  std::span<const std::uint8_t> from_;       // bytes that are left
  bool refused_ = false;
};

}  // namespace sectio
