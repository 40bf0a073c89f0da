// The way of a blade through a volume, as it is in the shape at rest. Part of simulation_volume_cut.*.
#include <algorithm>
#include <unordered_set>
#include <utility>

#include "sim_server/simulation_volume_cut.h"

namespace sectio {
namespace {

constexpr double kEvery = 0.5;      // mean edges that a blade goes between two cuts
constexpr double kAgain = 0.1;      // where the cut follows the blade into the element
constexpr double kLap = 0.25;       // mean edges
constexpr double kBehind = 2.0;     // mean edges that a sheet reaches behind the last cut: into what was cut in part
constexpr double kAround = 2;       // mean edges: tissue this close to a blade
constexpr std::size_t kFewest = 8;  // vertices whose motion is one
constexpr double kThrough = 0.5;    // mean edges beyond where a blade comes out
constexpr double kLongest = 8;      // mean edges: a sheet is flat, a way isn't

double distance_to_segment_m(const Vec3& x, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + along * (b - a) - x).norm();
}

}  // namespace

// From there to the vertex that is closest to the blade, from neighbour to neighbour.
VertexId VolumeCutting::closest_to(const SharedBody& body, const Blade& blade, VertexId from) const {
  const Vec3 heel_m = blade.tip_world_m + blade.length_m * blade.up_world;
  const auto distance_m = [&](VertexId v) {
    return distance_to_segment_m(state_of(body, v).position_world_m, blade.tip_world_m, heel_m);
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
  std::unordered_set<VertexId> seen;  // asked, never walked
  std::vector<MatchedPoint> around;
  const auto meet = [&](VertexId v) {
    if (!seen.insert(v).second) return;
    const TetVertexState state = state_of(body, v);
    if (distance_to_segment_m(state.position_world_m, blade.tip_world_m, heel_m) > kAround * element_m_) return;
    around.push_back({state.rest_body_m, state.position_world_m, 1});
    near.push_back(v);
  };
  for (const VertexId v : begin) meet(v);
  if (near.empty() && !begin.empty()) meet(closest_to(body, blade, begin.front()));
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::uint32_t t : volume_.star(near[k]))
      for (const VertexId v : volume_.tetrahedra()[t]) meet(v);
  if (near.empty()) near = begin;
  return around.size() < kFewest ? frame_world : match_shape(around, frame_world);
}

// The tissue that a blade had pressed in springs back over it: the way begins where the blade would be without that.
VolumeCutting::Way VolumeCutting::begin_way(const SharedBody& body, const MeshDraft& now, const Stroke& stroke,
                                            std::span<const BladeMotion> motions) const {
  Way way;
  way.next_m = next_cut_m();
  for (const VertexId slot : stroke.touched) way.near.push_back(surface_.vertex_of(slot));
  const auto motion = std::ranges::find(motions, stroke.tool_id, &BladeMotion::tool_id);
  if (motion == motions.end() || motion->path.empty()) return way;
  way.frame_world = motion->frame_world;
  Vec3 home = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    home += stroke.bary[static_cast<int>(i)] * motion->frame_world.to_world(body.mesh.rest_body_m(stroke.touched[i]));
  const Vec3 pressed_in = position_of(now, stroke) - home;
  Blade blade = motion->path.front();
  way.frame_world = frame_around(body, blade, way.frame_world, way.near);
  blade.tip_world_m -= pressed_in;
  add_edge(way, blade);
  way.cut_to = way.edges.back();
  return way;
}

void VolumeCutting::add_edge(Way& way, const Blade& blade) {
  way.now_world = {blade.tip_world_m, blade.tip_world_m + blade.length_m * blade.up_world};
  way.edges.push_back({way.frame_world.to_local(way.now_world.tip_m), way.frame_world.to_local(way.now_world.heel_m)});
}

void VolumeCutting::go(const SharedBody& body, Way& way, const BladeMotion& motion) {
  for (const Blade& blade : motion.path) {
    const Pose last = way.edges.empty() ? motion.frame_world : way.frame_world;
    way.frame_world = frame_around(body, blade, last, way.near);
    add_edge(way, blade);
    const Edge& edge = way.edges.back();
    if (way.edges.size() == 1) way.cut_to = edge;
    const Vec3 up = (edge.heel_m - edge.tip_m).normalized();
    way.since_cut_m =
        std::max((edge.tip_m - way.cut_to.tip_m).cross(up).norm(), (edge.heel_m - way.cut_to.heel_m).cross(up).norm());
  }
  const auto far = [&](const Edge& e, double m) {
    return (e.tip_m - way.edges.back().tip_m).norm() > m && (e.heel_m - way.edges.back().heel_m).norm() > m;
  };
  const double reach_m = std::min(kLongest * element_m_, way.since_cut_m + kBehind * element_m_);
  while (way.edges.size() > 2 && far(way.edges[1], reach_m)) way.edges.erase(way.edges.begin());
  std::erase_if(way.cut, [&](VertexId v) {
    const Edge& now = way.edges.back();
    return distance_to_segment_m(volume_.vertex(v).rest_body_m, now.tip_m, now.heel_m) > 2 * kLongest * element_m_;
  });
}

double VolumeCutting::next_cut_m() const {
  return (cut_settings_.semi_progressive ? kEvery : kAgain) * element_m_;
}

// Tetrahedra that are cut through whole begin far behind the blade; else the sheet goes on from the last one, and laps
// over it a little.
VolumeCutting::Edge VolumeCutting::sheet_begins(const Way& way) const {
  const auto in_world = [&](const Edge& e) {
    return Edge{way.frame_world.to_world(e.tip_m), way.frame_world.to_world(e.heel_m)};
  };
  if (cut_settings_.semi_progressive) return in_world(way.edges.front());
  Edge from = in_world(way.cut_to);
  const Vec3 ahead = way.now_world.tip_m + way.now_world.heel_m - from.tip_m - from.heel_m;
  const Vec3 back = kLap * element_m_ * ahead.stableNormalized();
  return {from.tip_m - back, from.heel_m - back};
}

// A blade that comes out has cut what it passed through in its last step; tissue that it bulged is still behind it.
void VolumeCutting::go_through(Way& way) {
  if (way.edges.size() < 2) return;
  const Edge &first = way.edges.front(), last = way.edges.back();
  const Vec3 ahead = kThrough * element_m_ * (last.tip_m + last.heel_m - first.tip_m - first.heel_m).stableNormalized();
  way.edges.push_back({last.tip_m + ahead, last.heel_m + ahead});
  way.now_world = {way.frame_world.to_world(way.edges.back().tip_m), way.frame_world.to_world(way.edges.back().heel_m)};
  way.next_m = 0;
  way.since_cut_m += ahead.norm();
}

}  // namespace sectio
