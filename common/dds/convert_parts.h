// What conversions of several messages share (convert.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>

#include "common/dds/convert.h"

namespace sectio::convert {

using Triple = std::array<double, 3>;

inline Triple triple(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

inline Vec3 vec3(const Triple& t) {
  return {t[0], t[1], t[2]};
}

inline std::array<double, 4> quadruple(const Eigen::Quaterniond& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

inline bool finite(std::initializer_list<double> values) {
  return std::ranges::all_of(values, [](double x) { return std::isfinite(x); });
}

inline bool not_negative(std::initializer_list<double> values) {
  return std::ranges::all_of(values, [](double x) { return std::isfinite(x) && x >= 0; });
}

inline bool is_position(const Triple& t) {
  return std::ranges::all_of(t, [](double x) { return std::abs(x) <= kMaxCoordinate_m; });
}

inline bool is_colour(const Triple& t) {
  return std::ranges::all_of(t, [](double x) { return x >= 0 && x <= 1; });
}

inline bool is_gravity(const Triple& t) {
  return std::ranges::all_of(t, [](double x) { return std::abs(x) <= kMostGravity_m_per_s2; });
}

inline bool is_unit(const Vec3& v) {
  return std::abs(v.norm() - 1) < 1e-3;
}

inline std::optional<Pose> pose_from(const Triple& position_m, const std::array<double, 4>& wxyz) {
  Pose pose{vec3(position_m), Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3])};
  if (!is_position(position_m) || !(std::abs(pose.orientation.norm() - 1) < 1e-3)) return std::nullopt;
  // Rounding must not grow from hop to hop: what is normalised already stays as it is, bit for bit.
  if (std::abs(pose.orientation.squaredNorm() - 1) > 1e-12) pose.orientation.normalize();
  return pose;
}

template <std::size_t N>
std::optional<std::string> text_from(const eprosima::fastrtps::fixed_string<N>& fixed, std::size_t min_bytes) {
  std::string text = fixed.c_str();
  const bool printable = std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
  if (text.size() < min_bytes || !printable) return std::nullopt;
  return text;
}

}  // namespace sectio::convert
