// Whether a message keeps the limits that its fields() name.
#pragma once

#include <cmath>
#include <string>

#include "common/messages/fields.h"
#include "common/messages/visit.h"

namespace sectio {

// Finds the first field whose value is beyond its limits.
class Validator {
 public:
  template <class T>
  void operator()(const char* name, const T& value, Limits own = {}, Limits element = {}) {
    if (!flaw_.empty()) return;
    flaw_ = flaw_in(value, own, element);
    if (!flaw_.empty()) flaw_ = name + flaw_;
  }
  // The path of the field and what is wrong; empty when all is well.
  const std::string& flaw() const { return flaw_; }

 private:
  static std::string unless(bool fine, const char* text) { return fine ? "" : text; }
  static std::string flaw_of(double number, Limits own);                    // ": expected 0 to 1, got -1"
  static std::string at_index(std::size_t index, const std::string& flaw);  // "[3].name: too long or too short"

  template <visit::Number T>
  static std::string flaw_in(const T& value, Limits own, Limits) {
    return flaw_of(static_cast<double>(value), own);
  }
  template <visit::Enumerator T>
  static std::string flaw_in(const T& value, Limits own, Limits) {
    return unless(own.contain(static_cast<double>(value)), ": no such value");
  }
  template <visit::Struct T>
  static std::string flaw_in(const T& value, Limits, Limits) {
    Validator inner;
    fields(inner, value);
    if (!inner.flaw().empty()) return "." + inner.flaw();
    if constexpr (visit::Checked<T>) return unless(is_consistent(value), ": its fields contradict each other");
    return "";
  }
  template <visit::Array T>
  static std::string flaw_in(const T& values, Limits own, Limits) {
    for (const auto& value : values)
      if (std::string flaw = flaw_in(value, own, {}); !flaw.empty()) return flaw;
    return "";
  }
  template <class T>
  static std::string flaw_in(const std::vector<T>& values, Limits own, Limits element) {
    if (!own.contain(static_cast<double>(values.size()))) return ": too many or too few";
    if constexpr (!visit::Number<T>)  // any number may stand in a sequence of numbers
      for (std::size_t i = 0; i < values.size(); ++i)
        if (const std::string flaw = flaw_in(values[i], element, {}); !flaw.empty()) return at_index(i, flaw);
    return "";
  }
  template <class T>
  static std::string flaw_in(const std::optional<T>& value, Limits own, Limits element) {
    return value ? flaw_in(*value, own, element) : "";
  }
  static std::string flaw_in(const std::string& text, Limits own, Limits) {
    if (!own.contain(static_cast<double>(text.size()))) return ": too long or too short";
    for (const char c : text)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return ": a character that can't be printed";
    return "";
  }
  static std::string flaw_in(const Vec3& v, Limits own, Limits) {
    for (const double x : {v.x(), v.y(), v.z()})
      if (!own.contain(x)) return flaw_of(x, own);
    return "";
  }
  static std::string flaw_in(const Eigen::Quaterniond& q, Limits, Limits) {
    return unless(std::abs(q.norm() - 1) < kUnitTolerance, ": not of length 1");
  }

  std::string flaw_;
};

// "bodies[1].name: too long or too short"; empty for a valid message.
template <class Message>
std::string first_flaw(const Message& message) {
  Validator validator;
  fields(validator, message);
  if (!validator.flaw().empty()) return validator.flaw();
  if constexpr (visit::Checked<Message>)
    if (!is_consistent(message)) return "its fields contradict each other";
  return "";
}

}  // namespace sectio
