#include "sim_server/surface/indentation/contact_places.h"

#include <algorithm>

#include "common/math/intersect.h"

namespace sectio {
namespace {

using Kind = PathPoint::Kind;

constexpr int kMaxSlides = 64;                          // most triangles that a pressing point crosses in a step
constexpr int kMaxCrossed = 12;                         // most edges under one line of an instrument
constexpr double kOntoEdge = 0.06, kOffEdge = 0.12;     // barycentric: a point gets onto an edge, and off it
constexpr double kShortestLine_m = 2e-4;                // seen along the normal; a shorter line is a point
constexpr double kTouches_m = 1e-4, kLeaves_m = -3e-4;  // surface above line: becomes active, stays active
constexpr double kFacing = 0.2;                         // least cosine between the normals of a face and of the line
constexpr double kFacesAlike = 0.5;                     // a smaller cosine: an edge of the body is between

using Where = Vec3 VertexState::*;
constexpr Where kNow = &VertexState::position_world_m, kAtRest = &VertexState::rest_body_m;

Corners corners_of(const MeshDraft& surface, TriangleId t, Where where) {
  const Triangle triangle = surface.triangle(t);
  return {surface.state(triangle.v[0]).*where, surface.state(triangle.v[1]).*where,
          surface.state(triangle.v[2]).*where};
}

bool was_on_edge(std::span<const ContactPoint> before, VertexId a, VertexId b) {
  return std::ranges::any_of(before, [&](const ContactPoint& p) {
    return p.place.kind == Kind::on_edge && std::minmax(p.place.from, p.place.to) == std::minmax(a, b);
  });
}

bool was_in_face(std::span<const ContactPoint> before, const std::array<VertexId, 3>& v) {
  return std::ranges::any_of(before, [&](const ContactPoint& p) {
    return p.place.kind == Kind::in_face &&
           std::ranges::all_of(v, [&](VertexId x) { return std::ranges::count(p.place.face, x) == 1; });
  });
}

PathPoint on_edge(VertexId from, VertexId to, double t) {
  PathPoint p;
  p.kind = Kind::on_edge;
  p.from = from;
  p.to = to;
  p.t = t;
  return p;
}

PathPoint in_face(const std::array<VertexId, 3>& face, const Vec3& bary) {
  PathPoint p;
  p.kind = Kind::in_face;
  p.face = face;
  p.bary = bary;
  return p;
}

// A walk over the surface in the plane of the line and the normal.
class LineWalk {
 public:
  explicit LineWalk(const ContactLine& line) : line_(line) {
    const Vec3 along = line.corner_body_m - line.from_body_m;
    const Vec3 over = along - along.dot(line.normal_body) * line.normal_body;
    length_m = over.norm();
    ahead_ = over / std::max(length_m, 1e-12);
    left_ = line.normal_body.cross(ahead_);
  }

  double side(const Vec3& x) const { return left_.dot(x - line_.from_body_m); }
  double progress_m(const Vec3& x) const { return ahead_.dot(x - line_.from_body_m); }
  Vec3 on_line(double progress_m) const {
    return line_.from_body_m + progress_m / length_m * (line_.corner_body_m - line_.from_body_m);
  }
  double over_line_m(const Vec3& x) const { return (x - on_line(progress_m(x))).dot(line_.normal_body); }

  struct Exit {
    int edge = -1;
    double t = 0;
    Vec3 at = Vec3::Zero();
  };
  // The foremost crossing of a triangle's rim.
  Exit exit_of(const Corners& c) const {
    Exit exit;
    double most = -1e300;
    for (int i = 0; i < 3; ++i) {
      const Vec3 &a = c[static_cast<std::size_t>(i)], &b = c[static_cast<std::size_t>((i + 1) % 3)];
      const double sa = side(a), sb = side(b);
      if ((sa >= 0) == (sb >= 0)) continue;
      const double t = sa / (sa - sb);
      const Vec3 at = a + t * (b - a);
      if (progress_m(at) <= most) continue;
      most = progress_m(at);
      exit = {i, t, at};
    }
    return exit;
  }

  double length_m = 0;

 private:
  const ContactLine& line_;
  Vec3 ahead_, left_;
};

Vec3 normal_of(const Corners& c) {
  return (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized();
}

// `may_be`: on this triangle.
template <class MayBe>
SurfacePoint nearest(const MeshDraft& surface, TriangleId start, const Vec3& point_m, Where where,
                     const MayBe& may_be) {
  SurfacePoint at{start, Vec3::Constant(1.0 / 3)};
  double best = 1e300;
  for (int i = 0; i < kMaxSlides; ++i) {
    TriangleId next = kNone;
    for (const VertexId v : surface.triangle(at.triangle).v)
      for (const TriangleId t : surface.fan(v)) {
        if (!may_be(t)) continue;
        const ClosestPoint c = closest_on_triangle(point_m, corners_of(surface, t, where));
        const double distance_m = (c.point - point_m).norm();
        if (distance_m >= best) continue;
        best = distance_m;
        at.bary = c.bary;
        next = t;
      }
    if (next == kNone || next == at.triangle) break;
    at.triangle = next;
  }
  return at;
}

}  // namespace

SurfacePoint nearest_from(const MeshDraft& surface, TriangleId start, const Vec3& point_world_m) {
  return nearest(surface, start, point_world_m, kNow, [](TriangleId) { return true; });
}

SurfacePoint pressed_from(const MeshDraft& surface, TriangleId start, const Vec3& point_world_m,
                          const Vec3& point_body_m) {
  const SurfacePoint at = nearest_from(surface, start, point_world_m);
  const Vec3 faces = normal_of(corners_of(surface, start, kAtRest));
  const auto faces_alike = [&](TriangleId t) {
    return normal_of(corners_of(surface, t, kAtRest)).dot(faces) > kFacesAlike;
  };
  const Corners there = corners_of(surface, at.triangle, kAtRest);
  if (faces_alike(at.triangle) || (point_body_m - there[0]).dot(normal_of(there)) > 0) return at;
  return nearest(surface, start, point_world_m, kNow, faces_alike);
}

SurfacePoint seen_along(const MeshDraft& surface, TriangleId start, const Vec3& point_body_m, const Vec3& normal_body) {
  SurfacePoint at{start, Vec3::Zero()};
  for (int i = 0; i < kMaxSlides; ++i) {
    const Corners c = corners_of(surface, at.triangle, kAtRest);
    const double area = (c[1] - c[0]).cross(c[2] - c[0]).dot(normal_body);
    if (!(area > 0)) break;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = c[static_cast<std::size_t>((k + 1) % 3)], &b = c[static_cast<std::size_t>((k + 2) % 3)];
      at.bary[k] = (a - point_body_m).cross(b - point_body_m).dot(normal_body) / area;
    }
    int least = 0;
    if (at.bary.minCoeff(&least) >= 0) return at;
    at.triangle = surface.neighbour(at.triangle, (least + 1) % 3);
  }
  return nearest(surface, start, point_body_m, kAtRest, [](TriangleId) { return true; });
}

PathPoint contact_place(const MeshDraft& surface, const SurfacePoint& at, std::span<const ContactPoint> before) {
  const Triangle triangle = surface.triangle(at.triangle);
  // Among the edges close by, an edge that was active before is taken, otherwise the closest.
  int edge = -1;
  double least = was_in_face(before, triangle.v) ? kOntoEdge : 0.5 * (kOntoEdge + kOffEdge);
  for (int i = 0; i < 3; ++i) {
    const VertexId a = triangle.v[static_cast<std::size_t>((i + 1) % 3)];
    const VertexId b = triangle.v[static_cast<std::size_t>((i + 2) % 3)];
    if (was_on_edge(before, a, b) && at.bary[i] < kOffEdge) {
      edge = i;
      break;
    }
    if (at.bary[i] >= least) continue;
    least = at.bary[i];
    edge = i;
  }
  if (edge < 0) return in_face(triangle.v, at.bary);
  const double a = at.bary[(edge + 1) % 3], b = at.bary[(edge + 2) % 3];
  return on_edge(triangle.v[static_cast<std::size_t>((edge + 1) % 3)],
                 triangle.v[static_cast<std::size_t>((edge + 2) % 3)], b / std::max(a + b, 1e-12));
}

std::vector<PlaceOnLine> contact_places_along(const MeshDraft& surface, const ContactLine& line,
                                              std::span<const ContactPoint> before) {
  std::vector<PlaceOnLine> places;
  const LineWalk walk(line);
  if (!(walk.length_m > kShortestLine_m)) return places;
  TriangleId t = line.triangle;
  double reached_m = -1e300;
  for (int i = 0; i < kMaxCrossed; ++i) {
    const Corners c = corners_of(surface, t, kAtRest);
    const std::array<VertexId, 3> v = surface.triangle(t).v;
    const Vec3 normal = normal_of(c);
    const LineWalk::Exit exit = walk.exit_of(c);
    const double exit_m = walk.progress_m(exit.at);
    if (exit.edge < 0 || exit_m <= reached_m || normal.dot(line.normal_body) < kFacing) break;
    reached_m = exit_m;
    if (exit_m >= walk.length_m) {
      const ClosestPoint end = closest_on_triangle(line.corner_body_m, c);
      const double over_m = (end.point - line.corner_body_m).dot(line.normal_body);
      if (over_m > (was_in_face(before, v) ? kLeaves_m : kTouches_m))
        places.push_back({in_face(v, end.bary), line.corner_body_m});
      break;
    }
    const VertexId a = v[static_cast<std::size_t>(exit.edge)], b = v[static_cast<std::size_t>((exit.edge + 1) % 3)];
    if (exit_m > 0) {
      if (walk.over_line_m(exit.at) <= (was_on_edge(before, a, b) ? kLeaves_m : kTouches_m)) break;
      places.push_back({on_edge(a, b, exit.t), walk.on_line(exit_m)});
    }
    t = surface.neighbour(t, exit.edge);
  }
  return places;
}

}  // namespace sectio
