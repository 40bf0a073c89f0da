// A message as a line of text, for people: "epoch: 7, step: 100, bodies: [{revision: 5, topology_hash: 99}]".
#pragma once

#include <string>

#include "common/core/formatted.h"
#include "common/messages/visit.h"

namespace sectio {

// Writes at most kMostElements of each sequence, then how many there are.
class TextWriter {
 public:
  static constexpr std::size_t kMostElements = 8;

  template <class T, class... Limits>
  void operator()(const char* name, const T& value, Limits...) {
    if (!text_.empty()) text_ += ", ";
    text_ += name;
    text_ += ": ";
    text_ += text_of(value);
  }
  const std::string& text() const { return text_; }

 private:
  static std::string text_of(bool value) { return value ? "true" : "false"; }
  static std::string text_of(double value) { return formatted("%.6g", value); }
  static std::string text_of(float value) { return text_of(static_cast<double>(value)); }
  template <class T>
  requires std::is_integral_v<T>
  static std::string text_of(T value) { return std::to_string(value); }
  template <visit::Enumerator T>
  static std::string text_of(T value) {
    return std::to_string(static_cast<int>(value));
  }
  template <visit::Struct T>
  static std::string text_of(const T& value) {
    TextWriter inner;
    fields(inner, value);
    return "{" + inner.text() + "}";
  }
  template <class Iterator>
  static std::string list(Iterator begin, std::size_t size) {
    std::string text = "[";
    for (std::size_t i = 0; i < size && i < kMostElements; ++i, ++begin) text += (i > 0 ? ", " : "") + text_of(*begin);
    if (size > kMostElements) text += ", ... of " + std::to_string(size);
    return text + "]";
  }
  template <visit::Array T>
  static std::string text_of(const T& values) {
    return list(values.begin(), values.size());
  }
  template <class T>
  static std::string text_of(const std::vector<T>& values) {
    return list(values.begin(), values.size());
  }
  template <class T>
  static std::string text_of(const std::optional<T>& value) {
    return value ? text_of(*value) : "none";
  }
  static std::string text_of(const std::string& text) { return "'" + text + "'"; }
  static std::string text_of(const Vec3& v) { return list(v.data(), 3); }
  static std::string text_of(const Eigen::Quaterniond& q) {
    const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
    return list(wxyz, 4);
  }

  std::string text_;
};

template <class Message>
std::string to_text(const Message& message) {
  TextWriter writer;
  fields(writer, message);
  return writer.text();
}

}  // namespace sectio
