#include "common/math/intersect.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/orientation.h"

namespace sectio {
namespace {

// The side of the triangle's plane on which p lies, shifted by shift * (e, e^2, e^3); the first order of the shift is
// shift * n . (e, e^2, e^3).
Orientation side_of_plane(const Corners& t, const Vec3& p, int shift) {
  Orientation o = orientation(t[0], t[1], t[2], p);
  if (o.sign == 0) o.sign = shift * leading_sign_of_cross(t[0], t[1], t[0], t[2]);
  return o;
}

// det[q - p, a - p, b - p] of the shifted line; its first order is shift * (d x (b - a)) . (e, e^2, e^3).
Orientation side_of_edge(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, int shift) {
  Orientation o = orientation(p, q, a, b);
  if (o.sign == 0) o.sign = shift * leading_sign_of_cross(p, q, a, b);
  return o;
}

// Whether the line p q passes through the triangle: -1 against the normal, 1 along it, 0 if not. `weights` are the
// corners' barycentric weights, not normalised. An edge parallel to the line has sign 0: such a line is parallel
// to the plane.
int line_inside(const Vec3& p, const Vec3& q, const Corners& t, int shift, Vec3& weights) {
  int sign = 0;
  for (int i = 0; i < 3; ++i) {
    const auto j = static_cast<std::size_t>((i + 1) % 3), k = static_cast<std::size_t>((i + 2) % 3);
    const Orientation o = side_of_edge(p, q, t[j], t[k], shift);
    if (o.sign == 0 || (i > 0 && o.sign != sign)) return 0;
    sign = o.sign;
    weights[i] = std::max(0.0, o.value * sign);
  }
  return sign;
}

Crossing crossing(double parameter, const Vec3& weights, const Corners& t, bool entering) {
  const double sum = weights.sum();
  const Vec3 bary = sum > 0 ? Vec3(weights / sum) : Vec3::Constant(1.0 / 3.0);
  return {parameter, bary, bary[0] * t[0] + bary[1] * t[1] + bary[2] * t[2], entering};
}

}  // namespace

std::optional<Crossing> cross_segment(const Vec3& p, const Vec3& q, const Corners& triangle, Instrument instrument) {
  const int shift = instrument == Instrument::segment ? 1 : -1;
  const Orientation at_p = side_of_plane(triangle, p, shift), at_q = side_of_plane(triangle, q, shift);
  if (at_p.sign * at_q.sign != -1) return std::nullopt;
  Vec3 weights;
  if (line_inside(p, q, triangle, shift, weights) != at_q.sign) return std::nullopt;
  const double height_p = std::abs(at_p.value), height = height_p + std::abs(at_q.value);
  return crossing(height > 0 ? height_p / height : 0.5, weights, triangle, at_p.sign > 0);
}

std::optional<Crossing> cross_ray(const Vec3& origin, const Vec3& direction, const Corners& triangle) {
  const Orientation at_p = side_of_plane(triangle, origin, 1);
  Vec3 weights;
  const Vec3 q = origin + direction;
  if (at_p.sign == 0 || line_inside(origin, q, triangle, 1, weights) != -at_p.sign) return std::nullopt;
  Crossing result = crossing(0, weights, triangle, at_p.sign > 0);
  result.parameter = std::max(0.0, (result.point - origin).dot(direction) / direction.squaredNorm());
  return result;
}

SweptCrossings cross_swept(const Vec3& p, const Vec3& q, const SweptSegment& sweep) {
  SweptCrossings result;
  const auto add = [&](const Crossing& c, double time, double along) {
    const Vec3 point = p + c.parameter * (q - p);
    result.at[static_cast<std::size_t>(result.count++)] = {c.parameter, time, along, point};
  };
  if (const auto c = cross_segment(p, q, {sweep.a0, sweep.b0, sweep.b1}, Instrument::triangle))
    add(*c, c->bary[2], c->bary[1] + c->bary[2]);
  if (const auto c = cross_segment(p, q, {sweep.a0, sweep.b1, sweep.a1}, Instrument::triangle))
    add(*c, c->bary[1] + c->bary[2], c->bary[1]);
  if (result.count == 2 && result.at[1].time < result.at[0].time) std::swap(result.at[0], result.at[1]);
  return result;
}

// Tests the Voronoi regions of corners, edges and the face (Ericson 2005, Real-Time Collision Detection, 5.1.5).
ClosestPoint closest_on_triangle(const Vec3& p, const Corners& t) {
  const auto at = [&](double u, double v, double w) {
    const Vec3 point = u * t[0] + v * t[1] + w * t[2];
    return ClosestPoint{point, Vec3(u, v, w), (p - point).squaredNorm()};
  };
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0], bp = p - t[1], cp = p - t[2];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return at(1, 0, 0);
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return at(0, 1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return at(0, 0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(0, 1 - w, w);
  }
  const double sum = va + vb + vc;
  return at(va / sum, vb / sum, vc / sum);
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((p - a).dot(b - a) / std::max((b - a).squaredNorm(), 1e-300), 0.0, 1.0);
  return (a + along * (b - a) - p).norm();
}

// Separating axis test with the three axes of the box and their cross products with the segment.
bool overlaps(const Vec3& p, const Vec3& q, const Box3& box) {
  if (box.isEmpty()) return false;
  const Vec3 half = 0.5 * (box.max() - box.min());
  const Vec3 half_segment = 0.5 * (q - p);
  const Vec3 middle = 0.5 * (p + q) - 0.5 * (box.max() + box.min());
  const Vec3 extent = half_segment.cwiseAbs();
  const double slack = 1e-15 * (p.cwiseAbs() + q.cwiseAbs() + box.max().cwiseAbs() + box.min().cwiseAbs()).maxCoeff();
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(middle[i]) <= half[i] + extent[i] + slack)) return false;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double distance = std::abs(middle[j] * half_segment[k] - middle[k] * half_segment[j]);
    if (!(distance <= half[j] * extent[k] + half[k] * extent[j] + slack * (extent[j] + extent[k]))) return false;
  }
  return true;
}

}  // namespace sectio
