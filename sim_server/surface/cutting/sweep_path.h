// The crossing of a surface with the plane region that a blade sweeps between two poses: paths over active faces, each
// with the points at which it passes from face to face (paper A, 2.3). Pure functions; they read active faces and, to
// begin at a vertex, the triangles around that vertex.
//
// Paths lie in the body's shape at rest, where no wall of a groove hangs into another and nothing moves while a cut
// rests. plan_template_cut.cpp takes the blade there.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"
#include "sim_server/surface/cutting/stroke.h"

namespace sectio {

using Vec2 = Eigen::Vector2d;

// The line of a blade, in the frame of the body at rest.
struct RestBlade {
  Vec3 tip_body_m = Vec3::Zero();
  Vec3 up_body = Vec3::UnitZ();  // unit, from the tip upwards

  template <class A>
  void archive(A& a) {
    a(tip_body_m, up_body);
  }
};

// The rim of the swept region, clockwise from the upper end of the last pose: down the blade, along the trail of the
// tip to the first pose, and up the blade there.
enum class SweepRim : std::uint8_t { none, first_pose, trail, last_pose };

// The plane of a motion, and its region between two poses, above the trail of the tip and without end upwards. Tissue
// and blade turn, so the first pose need not be a line in the plane; the region bends towards it.
class BladeSweep {
 public:
  // Sweeps from a pose.
  BladeSweep(const RestBlade& first, const RestBlade& last);
  // Sweeps from the end of a cut, given by the upper and lower ends of its parts, from above; `tip_first` is at the
  // last of these ends or beyond.
  BladeSweep(std::span<const std::array<Vec3, 2>> parts, const Vec3& tip_first, const RestBlade& last);

  double length_m() const { return tip_last_.x() - tip_first_.x(); }  // along the motion
  double side(const Vec3& x) const;                                   // > 0: to the left; >= 0 counts as left
  Vec2 in_plane(const Vec3& x) const { return {ahead.dot(x - origin), up.dot(x - origin)}; }
  const Vec2& tip_first() const { return tip_first_; }
  const Vec2& tip_last() const { return tip_last_; }
  double ahead_of_first(const Vec2& x) const { return x.x() - first_at(x.y()).ahead; }
  double trail_height(double s) const;  // height of the trail of the tip at s metres ahead of the origin

  // The part of the segment a - b in the region, as parameters with the rims on which it is cut off; nothing if empty.
  // The region reaches so far behind the first pose and beyond the last one.
  struct Clip {
    double from = 0, to = 1;
    SweepRim rim_from = SweepRim::none, rim_to = SweepRim::none;
  };
  std::optional<Clip> clip(const Vec2& a, const Vec2& b, double behind_m = 0, double beyond_m = 0) const;

  // A position on the rim as one number, which falls clockwise: above 2 on the blade of the last pose, 2 ... 1 on the
  // trail, below 1 on the blade of the first pose.
  double rim_position(const Vec2& x, SweepRim rim) const;

  Vec3 origin, ahead, left, up;  // right-handed, unit: ahead x left = up

 private:
  void set_plane(const Vec3& from, const RestBlade& last);
  struct Place {
    double height = 0, ahead = 0, left = 0;
  };
  Place place_of(const Vec3& x) const { return {up.dot(x - origin), ahead.dot(x - origin), left.dot(x - origin)}; }
  Place first_at(double height) const;

  Vec2 tip_first_, tip_last_;
  std::vector<Place> first_;                 // points of the first pose, from below, with straight lines between them
  bool straight_ = false;                    // straight beyond them, too; otherwise upright there
  std::vector<std::array<double, 2>> gaps_;  // between the parts: lower and upper height
};

// A point of a path.
struct PathPoint {
  enum class Kind : std::uint8_t {
    vertex,   // at vertex `from`
    on_edge,  // between `from` (right of the plane) and `to` (left of it), at ratio t
    in_face,  // at `bary` in the face
    between,  // in the middle of the points before and after, for the pair of a slit
  };
  Kind kind = Kind::on_edge;
  VertexId from = kNone, to = kNone;
  double t = 0;
  std::array<VertexId, 3> face{kNone, kNone, kNone};
  Vec3 bary = Vec3::Zero();
  Vec2 at = Vec2::Zero();  // in the plane of the sweep

  SweepRim rim = SweepRim::none;  // for the ends of a path: where it enters or leaves the region
  double rim_position = 0;
  VertexId ridge = kNone;  // for an end at a front: the other end of the front's edge

  bool same_place(const PathPoint& o) const { return kind == o.kind && from == o.from && to == o.to; }

  template <class A>
  void archive(A& a) {
    a(kind, from, to, t, face, bary, at, rim, rim_position, ridge);
  }
};

// A crossed face: its corners, and the part of its crossing that is in the region.
struct PathFace {
  std::array<VertexId, 3> corners{kNone, kNone, kNone};
  int active_edges = 0;
  int begin = 0, end = 0;  // points between which it is crossed; the same one if the crossing is snapped to it
};

// The body is below the path (to its right in the plane, seen with `ahead` to the right and `up` upwards).
struct SurfacePath {
  std::vector<PathPoint> points;
  std::vector<PathFace> faces;
  bool closed = false;  // the last point leads to the first
};

// The fronts that a sweep goes on from, and the groove at which it is to end.
struct SweepEnds {
  std::vector<CutFront> fronts;             // one for each part of the edge in the body, from above; may be empty
  bool may_part = true;                     // a piece may come off
  std::optional<CutFront> target = {};      // the front of another groove, along which the last pose lies
  Mat3 world_from_rest = Mat3::Identity();  // the rotation by which the blade was taken to rest
};

// Is the front as it was, although other cuts may have changed the mesh?
bool still_there(const MeshDraft& draft, const CutFront& front);

// The sweep between two poses; with fronts, it begins at the blade's place there.
BladeSweep sweep_between(const MeshDraft& draft, const RestBlade& first, const RestBlade& last,
                         std::span<const CutFront> fronts);

// The rotation of a triangle: takes directions at rest to the world.
Mat3 world_from_rest(const MeshDraft& draft, const std::array<VertexId, 3>& corners);

// Crossings of edges that go through vertices.
struct PathSnap {
  double ratio = 0;     // closer to a corner of the edge than this ratio of its length
  double within_m = 0;  // a vertex closer to the plane than this
  double fold_m = 0;    // faces beside a front may be folded over it, at rest, by so much
};

// All paths through the given faces and the faces that these lead to. Paths from the fronts come first; each begins or
// ends at a front. Nothing if the surface does not lead on from the uppermost front, or to the target. Ends of a path
// are at least `inset` inside their faces.
std::optional<std::vector<SurfacePath>> sweep_paths(const MeshDraft& draft, const BladeSweep& sweep,
                                                    const SweepEnds& ends, std::span<const TriangleId> active,
                                                    const PathSnap& snap, double inset);

// Does a closed path go round a hole of the body?
bool goes_round_a_hole(const SurfacePath& path);

}  // namespace sectio
