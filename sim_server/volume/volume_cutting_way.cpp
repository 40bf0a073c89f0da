// The way of a blade through a volume, as it is in the shape at rest.
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/intersect.h"
#include "sim_server/volume/volume_cutting.h"

namespace sectio {
namespace {

constexpr double kEvery = 0.5;       // mean edges that a blade goes between two cuts
constexpr double kFollow = 0.05;     // where the cut follows it into the element
constexpr double kBehind = 2.0;      // mean edges that a sheet reaches behind the blade: into what was cut in part
constexpr double kJustBehind = 0.5;  // where its front is open so far
constexpr double kBeside = 0.3;      // mean edges beside a front that a blade has turned round in
constexpr double kBack = 1.0;        // mean edges back from it
constexpr double kAround = 2;        // mean edges: tissue this close to a blade
constexpr std::size_t kFewest = 8;   // vertices whose motion is one
constexpr double kLongest = 8;       // mean edges: a sheet is flat, a way isn't

}  // namespace

// From there to the vertex that is closest to the blade, from neighbour to neighbour.
VertexId VolumeCutting::closest_to(const SharedBody& body, const Blade& blade, VertexId from) const {
  const Vec3 heel_m = blade.tip_world_m + blade.length_m * blade.up_world;
  const auto distance_m = [&](VertexId v) {
    return distance_to_segment(state_of(body, v).position_world_m, blade.tip_world_m, heel_m);
  };
  double least_m = distance_m(from);
  for (VertexId before = kNone; before != from;) {
    before = from;
    for (const std::uint32_t t : volume_.star(before))
      for (const VertexId v : volume_.tetrahedra()[t])
        if (const double m = distance_m(v); m < least_m) {
          least_m = m;
          from = v;
        }
  }
  return from;
}

// The tissue around a blade has a motion of its own, and takes with it where the blade has been. `near`: where to begin
// to look; afterwards what is around the blade.
Pose VolumeCutting::frame_around(const SharedBody& body, const Blade& blade, const Pose& frame_world,
                                 std::vector<VertexId>& near) const {
  const Vec3 heel_m = blade.tip_world_m + blade.length_m * blade.up_world;
  const std::vector<VertexId> begin = std::exchange(near, {});
  met_.begin(volume_.vertex_count());
  std::vector<MatchedPoint> around;
  const auto meet = [&](VertexId v) {
    if (!met_.insert(v)) return;
    const TetVertexState state = state_of(body, v);
    if (distance_to_segment(state.position_world_m, blade.tip_world_m, heel_m) > kAround * element_m_) return;
    around.push_back({state.rest_body_m, state.position_world_m, 1});
    near.push_back(v);
  };
  for (const VertexId v : begin) meet(v);
  if (near.empty() && !begin.empty()) meet(closest_to(body, blade, begin.front()));
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::uint32_t t : volume_.star(near[k]))
      for (const VertexId v : volume_.tetrahedra()[t]) meet(v);
  near = settled(near.empty() ? begin : near);
  return around.size() < kFewest ? frame_world : match_shape(around, frame_world);
}

// The tissue that a blade had pressed in springs back over it: the way begins where the blade would be without that.
VolumeCutting::Way VolumeCutting::begin_way(const SharedBody& body, const MeshDraft& now, const Stroke& stroke,
                                            std::span<const BladeMotion> motions) const {
  Way way;
  way.next_m = next_cut_m();
  for (const VertexId slot : stroke.touched) way.near.push_back(surface_.vertex_of(slot));
  way.near = settled(way.near);
  const auto motion = std::ranges::find(motions, stroke.tool_id, &BladeMotion::tool_id);
  if (motion == motions.end() || motion->path.empty()) return way;
  Blade blade = motion->path.front();
  way.frame_world = frame_around(body, blade, motion->frame_world, way.near);
  Vec3 home = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    home += stroke.bary[static_cast<int>(i)] * way.frame_world.to_world(body.mesh.rest_body_m(stroke.touched[i]));
  const Vec3 pressed_in = position_of(now, stroke) - home;
  blade.tip_world_m -= pressed_in;
  add_edge(way, blade);
  way.open_to = way.edges.back();
  return way;
}

void VolumeCutting::add_edge(Way& way, const Blade& blade) {
  way.edges.push_back({way.frame_world.to_local(blade.tip_world_m),
                       way.frame_world.to_local(blade.tip_world_m + blade.length_m * blade.up_world)});
}

void VolumeCutting::go(const SharedBody& body, Way& way, const BladeMotion& motion) {
  for (const Blade& blade : motion.path) {
    const Pose last = way.edges.empty() ? motion.frame_world : way.frame_world;
    way.frame_world = frame_around(body, blade, last, way.near);
    add_edge(way, blade);
    if (way.edges.size() == 1) way.open_to = way.edges.back();
    if (has_left(way)) {
      settle();
      way.edges = {way.edges.back()};
      way.open_to = way.edges.back();
      way.forward = Vec3::Zero();
    }
    way.since_cut_m = ahead_m(way);
  }
  const auto far = [&](const Edge& e, double m) {
    return (e.tip_m - way.edges.back().tip_m).norm() > m && (e.heel_m - way.edges.back().heel_m).norm() > m;
  };
  const double behind_m = (follows() ? kJustBehind : kBehind) * element_m_;
  const double reach_m = std::min(kLongest * element_m_, std::max(0.0, way.since_cut_m) + behind_m);
  while (way.edges.size() > 2 && far(way.edges[1], reach_m)) way.edges.erase(way.edges.begin());
  std::erase_if(way.cut, [&](VertexId v) {
    const Edge& now = way.edges.back();
    return distance_to_segment(volume_.vertex(v).rest_body_m, now.tip_m, now.heel_m) > 2 * kLongest * element_m_;
  });
}

double VolumeCutting::next_cut_m() const {
  return (follows() ? kFollow : kEvery) * element_m_;
}

// Across the edge, of the end that has gone further; less than nothing: back.
double VolumeCutting::ahead_m(const Way& way) const {
  const Edge& now = way.edges.back();
  const Vec3 up = (now.heel_m - now.tip_m).normalized();
  const auto gone_m = [&](const Vec3& from, const Vec3& to) {
    const double m = (to - from).cross(up).norm();
    return follows() && (to - from).dot(way.forward) < 0 ? -m : m;
  };
  return std::max(gone_m(way.open_to.tip_m, now.tip_m), gone_m(way.open_to.heel_m, now.heel_m));
}

// Each end where it is, or where the tissue is open when it has gone back.
VolumeCutting::Edge VolumeCutting::furthest(const Way& way) const {
  Edge edge = way.edges.back();
  if (!follows()) return edge;
  if ((edge.tip_m - way.open_to.tip_m).dot(way.forward) < 0) edge.tip_m = way.open_to.tip_m;
  if ((edge.heel_m - way.open_to.heel_m).dot(way.forward) < 0) edge.heel_m = way.open_to.heel_m;
  return edge;
}

// It has turned round, and is where its front has nothing to do with it.
bool VolumeCutting::has_left(const Way& way) const {
  if (ahead_m(way) >= 0) return false;
  const Edge& now = way.edges.back();
  const Vec3 up = (way.open_to.heel_m - way.open_to.tip_m).normalized();
  const Vec3 normal = way.forward.cross(up).stableNormalized();
  const Vec3 tip = now.tip_m - way.open_to.tip_m, heel = now.heel_m - way.open_to.heel_m;
  return std::max(std::abs(normal.dot(tip)), std::abs(normal.dot(heel))) > kBeside * element_m_ ||
         -0.5 * way.forward.dot(tip + heel) > kBack * element_m_;
}

}  // namespace sectio
