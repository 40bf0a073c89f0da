// Where the plane region that a blade sweeps between two poses crosses a surface: paths over its active faces, each
// with the points at which it passes from face to face (paper A, 2.3). Pure functions; reads active faces and, to begin
// at a vertex, the triangles around it.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "sim_server/cutting/mesh_draft.h"
#include "sim_server/cutting/stroke.h"

namespace sectio {

using Vec2 = Eigen::Vector2d;

// The rim of the region inside a body, clockwise from the upper end of the last pose: down the blade there, along the
// trail of the tip to the first pose, up the blade there.
enum class SweepRim : std::uint8_t { none, first_pose, trail, last_pose };

// The plane of a motion, and the region of it between two poses, above the trail of the tip and without end upwards.
class BladeSweep {
 public:
  // The plane contains `origin` and the tip of `last`. The first pose is the line from tip_first upwards to
  // `above_first`.
  BladeSweep(const Vec3& origin, const Vec3& tip_first, const Vec3& above_first, const Blade& last);

  double length_m() const { return tip_last_.x() - tip_first_.x(); }  // along the motion
  double side(const Vec3& x) const { return left.dot(x - origin); }   // > 0: to the left; >= 0 counts as left
  Vec2 in_plane(const Vec3& x) const { return {ahead.dot(x - origin), up.dot(x - origin)}; }
  const Vec2& tip_first() const { return tip_first_; }
  const Vec2& tip_last() const { return tip_last_; }
  double trail_height(double s) const;  // of the trail of the tip, at s metres ahead of the origin

  // The part of the segment a - b in the region, as parameters with the rims on which it is cut off; nothing if empty.
  struct Clip {
    double from = 0, to = 1;
    SweepRim rim_from = SweepRim::none, rim_to = SweepRim::none;
  };
  std::optional<Clip> clip(const Vec2& a, const Vec2& b) const;

  // A position on the rim as one number that falls when one walks it clockwise: above 2 on the blade of the last pose,
  // 2 ... 1 on the trail, below 1 on the blade of the first pose.
  double rim_position(const Vec2& x, SweepRim rim) const;

  Vec3 origin, ahead, left, up;  // right-handed, unit: ahead x left = up

 private:
  Vec2 tip_first_, above_first_, tip_last_;
};

// A point of a path.
struct PathPoint {
  enum class Kind : std::uint8_t {
    vertex,   // at vertex `from`
    on_edge,  // between `from` (right of the plane) and `to` (left of it), at ratio t
    in_face,  // at `bary` in the face
    between,  // in the middle of the points before and after: makes the pair of a slit
  };
  Kind kind = Kind::on_edge;
  VertexId from = kNone, to = kNone;
  double t = 0;
  std::array<VertexId, 3> face{kNone, kNone, kNone};
  Vec3 bary = Vec3::Zero();
  Vec2 at = Vec2::Zero();  // in the plane of the sweep

  SweepRim rim = SweepRim::none;  // of the ends of a path: where it enters or leaves the region
  double rim_position = 0;

  bool same_place(const PathPoint& o) const { return kind == o.kind && from == o.from && to == o.to; }
};

// Crossed face: corners, and how much of its crossing is in the region.
struct PathFace {
  std::array<VertexId, 3> corners{kNone, kNone, kNone};
  int active_edges = 0;
  int begin = 0, end = 0;  // points between which it is crossed; the same one when the crossing is snapped to it
};

// The body is below the path (to its right in the plane, seen with `ahead` to the right and `up` upwards).
struct SurfacePath {
  std::vector<PathPoint> points;
  std::vector<PathFace> faces;
  bool closed = false;  // comes round; the last point leads to the first
};

// Vertices at which the cut is to be continued: the last pose of the step before.
struct CutFront {
  VertexId top = kNone, bottom = kNone;
  bool bottom_on_surface = false;  // the blade came out on the other side
  // Before the bottom along the trail: a pair, or one vertex twice.
  VertexId before_left = kNone, before_right = kNone;
  std::optional<VertexState> bottom_at_tip;  // where the bottom is going in the next step; nothing: it is there
};

// Between two poses; with a front, from where the blade stands there.
BladeSweep sweep_between(const MeshDraft& draft, const Blade& first, const Blade& last,
                         const std::optional<CutFront>& front);

// How a triangle has turned: takes directions back to the rest shape.
Mat3 rest_from_world(const MeshDraft& draft, const std::array<VertexId, 3>& corners);

// All paths through the faces given and those that they lead to. With a front, the first one begins at its top.
// Nothing if the surface does not lead on from the front. Crossings closer to a corner of their edge than snap_ratio of
// its length go through it; ends of a path are as far inside their faces as `inset`.
std::optional<std::vector<SurfacePath>> sweep_paths(const MeshDraft& draft, const BladeSweep& sweep,
                                                    const std::optional<CutFront>& front,
                                                    std::span<const TriangleId> active, double snap_ratio,
                                                    double inset);

}  // namespace sectio
