// A message is written out once. Its fields() names every field in the order of the wire, with the limits of its value;
// the encoding (codec.h), the validation (validate.h) and the text (text.h) come from it:
//
//   template <class Visitor, FieldsOf<KeyframeRequest> M>
//   void fields(Visitor& visit, M& message) {
//     auto& [epoch, body_id, known_revision, client] = message;  // doesn't compile without a new field
//     visit("epoch", epoch);
//     visit("body_id", body_id, below(kMaxBodies));
//     ...
//
// A field is a number, an enumerator, a text, a Vec3, a quaternion, an array, a sequence, an optional value, or another
// struct that has fields(). A message whose fields depend on each other declares is_consistent(message) beside them.
//
// fields() of the messages of session.h stand in session_fields.h, and so on: a source that only uses a message doesn't
// see them. These headers are for browsers, too: of C++20's library they need no more than <span>.
#pragma once

#include <cstddef>
#include <limits>
#include <type_traits>

namespace sectio {

template <class M, class Message>
concept FieldsOf = std::is_same_v<std::remove_const_t<M>, Message>;

// The least and the largest value of a number, of each component of a vector; the least and the largest size of a text
// (in bytes) or a sequence. Without limits a number must still be finite.
struct Limits {
  double least = std::numeric_limits<double>::lowest();
  double most = std::numeric_limits<double>::max();

  constexpr bool contain(double x) const { return x >= least && x <= most; }  // false for a NaN
};

constexpr Limits from_to(double least, double most) {
  return {least, most};
}
constexpr Limits at_most(double most) {
  return {0, most};
}
constexpr Limits below(double end) {
  return {0, end - 1};
}

constexpr double kMaxCoordinate_m = 1e4;

constexpr Limits kNotNegative{0, std::numeric_limits<double>::max()};
constexpr Limits kPosition_m{-kMaxCoordinate_m, kMaxCoordinate_m};
constexpr Limits kColour{0, 1};
constexpr double kUnitTolerance = 1e-3;  // the length of normals and quaternions may be this far from 1

}  // namespace sectio
