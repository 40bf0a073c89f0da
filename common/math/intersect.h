// Intersections of segments, rays and triangles. Double precision, exact decisions, pure functions.
//
// Watertight: the instrument's side of a test counts as shifted by (e, e^2, e^3) with an infinitely small e > 0
// (simulation of simplicity, Edelsbrunner & Muecke 1990). So a segment through a shared edge or vertex of a closed
// surface crosses exactly one of the triangles there, a path p0 p1 p2 crosses a surface at p1 exactly once, a grazing
// segment crosses nothing or an even number of times, and crossings alternate between entering and leaving.
#pragma once

#include <array>
#include <optional>

#include "common/math/types.h"

namespace sectio {

using Corners = std::array<Vec3, 3>;
using Box3 = Eigen::AlignedBox3d;

// Says which of the two belongs to the instrument and is shifted.
enum class Instrument { segment, triangle };

struct Crossing {
  double parameter = 0;  // 0 at p, 1 at q
  Vec3 bary = Vec3::Zero();
  Vec3 point = Vec3::Zero();  // bary applied to the corners
  bool entering = false;      // against the normal (b - a) x (c - a)
};

std::optional<Crossing> cross_segment(const Vec3& p, const Vec3& q, const Corners& triangle,
                                      Instrument instrument = Instrument::segment);

// The ray begins at origin and has no end; the unit of Crossing::parameter is the length of direction.
std::optional<Crossing> cross_ray(const Vec3& origin, const Vec3& direction, const Corners& triangle);

// The surface swept by a segment that moves from a0 b0 to a1 b1: the triangles a0 b0 b1 and a0 b1 a1.
struct SweptSegment {
  Vec3 a0, b0, a1, b1;
};

struct SweptCrossing {
  double edge_parameter = 0;  // on the fixed segment, 0 at p
  double time = 0;            // 0 at a0 b0, 1 at a1 b1
  double along = 0;           // on the moving segment, 0 at a
  Vec3 point = Vec3::Zero();  // on the fixed segment
};

// Crossings of a fixed segment by the swept surface, in order of time: none, one, or two as that surface is bent.
struct SweptCrossings {
  int count = 0;
  std::array<SweptCrossing, 2> at;
};
SweptCrossings cross_swept(const Vec3& p, const Vec3& q, const SweptSegment& sweep);

struct ClosestPoint {
  Vec3 point = Vec3::Zero();
  Vec3 bary = Vec3::Zero();
  double squared_distance = 0;
};
ClosestPoint closest_on_triangle(const Vec3& p, const Corners& triangle);
double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b);

// Conservative under rounding: may be true for a segment some 1e-15 outside the box. False if anything is not a number.
bool overlaps(const Vec3& p, const Vec3& q, const Box3& box);

// The box with a margin on all sides.
inline Box3 grown(const Box3& box, double by) {
  return {box.min().array() - by, box.max().array() + by};
}

}  // namespace sectio
