#include "sim_server/volume/blade_track.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"

namespace sectio {
namespace {

// From a vertex to the one that is closest to the blade, from neighbour to neighbour.
VertexId closest_to(const Tissue& tissue, const Blade& blade, VertexId from) {
  const TetTopology& topology = tissue.volume.topology;
  const Vec3 heel_m = blade.tip_world_m + blade.length_m * blade.up_world;
  const auto distance_m = [&](VertexId v) {
    return distance_to_segment(tissue.state_of(v).position_world_m, blade.tip_world_m, heel_m);
  };
  double least_m = distance_m(from);
  for (VertexId before = kNone; before != from;) {
    before = from;
    for (const std::uint32_t t : topology.star(before))
      for (const VertexId v : topology.tetrahedra()[t])
        if (const double m = distance_m(v); m < least_m) {
          least_m = m;
          from = v;
        }
  }
  return from;
}

}  // namespace

void BladeTrack::add_edge(const Blade& blade) {
  edges.push_back({frame_world.to_local(blade.tip_world_m),
                   frame_world.to_local(blade.tip_world_m + blade.length_m * blade.up_world)});
}

double BladeTrack::ahead_m(const FrontSettings& settings) const {
  const BladeEdge& now = edges.back();
  const Vec3 up = (now.heel_m - now.tip_m).normalized();
  const auto gone_m = [&](const Vec3& from, const Vec3& to) {
    const double m = (to - from).cross(up).norm();
    return settings.follows_blade() && (to - from).dot(forward) < 0 ? -m : m;
  };
  return std::max(gone_m(open_to.tip_m, now.tip_m), gone_m(open_to.heel_m, now.heel_m));
}

BladeEdge BladeTrack::furthest(const FrontSettings& settings) const {
  BladeEdge edge = edges.back();
  if (!settings.follows_blade()) return edge;
  if ((edge.tip_m - open_to.tip_m).dot(forward) < 0) edge.tip_m = open_to.tip_m;
  if ((edge.heel_m - open_to.heel_m).dot(forward) < 0) edge.heel_m = open_to.heel_m;
  return edge;
}

bool BladeTrack::has_left_front(const Tissue& tissue) const {
  if (ahead_m(tissue.settings) >= 0) return false;
  const BladeEdge& now = edges.back();
  const Vec3 up = (open_to.heel_m - open_to.tip_m).normalized();
  const Vec3 normal = forward.cross(up).stableNormalized();
  const Vec3 tip = now.tip_m - open_to.tip_m, heel = now.heel_m - open_to.heel_m;
  return std::max(std::abs(normal.dot(tip)), std::abs(normal.dot(heel))) >
             tissue.metres(tissue.settings.left_beside_edges) ||
         -0.5 * forward.dot(tip + heel) > tissue.metres(tissue.settings.left_behind_edges);
}

// The frame of the tissue around a blade: its motion takes the track along. `near`: where the search begins; afterwards
// the vertices around the blade.
Pose BladeTracks::frame_around(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world,
                               std::vector<VertexId>& near) const {
  const TetTopology& topology = tissue.volume.topology;
  const double around_m = tissue.metres(tissue.settings.around_edges);
  const Vec3 heel_m = blade.tip_world_m + blade.length_m * blade.up_world;
  const std::vector<VertexId> begin = std::exchange(near, {});
  tissue.volume.visited.begin(topology.vertex_count());
  std::vector<MatchedPoint> around;
  const auto visit = [&](VertexId v) {
    if (!tissue.volume.visited.insert(v)) return;
    const TetVertexState state = tissue.state_of(v);
    if (distance_to_segment(state.position_world_m, blade.tip_world_m, heel_m) > around_m) return;
    around.push_back({state.rest_body_m, state.position_world_m, 1});
    near.push_back(v);
  };
  for (const VertexId v : begin) visit(v);
  if (near.empty() && !begin.empty()) visit(closest_to(tissue, blade, begin.front()));
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::uint32_t t : topology.star(near[k]))
      for (const VertexId v : topology.tetrahedra()[t]) visit(v);
  near = without_front(near.empty() ? begin : near);
  const bool is_enough = around.size() >= tissue.settings.fewest_vertices_around;
  return is_enough ? match_shape(around, otherwise_world) : otherwise_world;
}

void BladeTracks::begin(const Tissue& tissue, const MeshDraft& surface, const BladeInTissue& at,
                        const BladeMotion* motion) {
  BladeTrack track;
  track.next_cut_m = tissue.metres(tissue.settings.next_cut_edges());
  for (const VertexId slot : at.v) track.vertices_near.push_back(tissue.volume.surface.vertex_of(slot));
  track.vertices_near = without_front(track.vertices_near);
  if (motion && !motion->path.empty()) {
    Blade blade = motion->path.front();
    track.frame_world = frame_around(tissue, blade, motion->frame_world, track.vertices_near);
    Vec3 undeformed = Vec3::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      undeformed += at.bary[static_cast<int>(i)] * track.frame_world.to_world(tissue.body.mesh.rest_body_m(at.v[i]));
    const Vec3 pressed_in = at.position_world_m(surface) - undeformed;
    blade.tip_world_m -= pressed_in;
    track.add_edge(blade);
    track.open_to = track.edges.back();
  }
  by_edge[at.edge_id] = std::move(track);
}

void BladeTracks::extend(const Tissue& tissue, const BladeMotion& motion) {
  const FrontSettings& settings = tissue.settings;
  BladeTrack& track = by_edge[motion.edge_id];
  for (const Blade& blade : motion.path) {
    const Pose last = track.edges.empty() ? motion.frame_world : track.frame_world;
    track.frame_world = frame_around(tissue, blade, last, track.vertices_near);
    track.add_edge(blade);
    if (track.edges.size() == 1) track.open_to = track.edges.back();
    if (track.has_left_front(tissue)) {
      finalise_fronts();
      track.edges = {track.edges.back()};
      track.open_to = track.edges.back();
      track.forward = Vec3::Zero();
    }
    track.since_cut_m = track.ahead_m(settings);
  }
  const auto is_far = [&](const BladeEdge& e, double m) {
    return (e.tip_m - track.edges.back().tip_m).norm() > m && (e.heel_m - track.edges.back().heel_m).norm() > m;
  };
  const double longest_m = tissue.metres(settings.longest_sheet_edges);
  const double behind_m = tissue.metres(settings.follows_blade() ? settings.front_behind_edges : settings.behind_edges);
  const double reach_m = std::min(longest_m, std::max(0.0, track.since_cut_m) + behind_m);
  while (track.edges.size() > 2 && is_far(track.edges[1], reach_m)) track.edges.erase(track.edges.begin());
  std::erase_if(track.cut, [&](VertexId v) {
    const BladeEdge& now = track.edges.back();
    return distance_to_segment(tissue.volume.topology.vertex(v).rest_body_m, now.tip_m, now.heel_m) > 2 * longest_m;
  });
}

void BladeTracks::finalise_fronts() {
  if (!front) return;
  front.reset();
  for (auto& [edge_id, track] : by_edge) {
    track.has_front = false;
    track.cut.insert(track.cut.end(), track.front_vertices.begin(), track.front_vertices.end());
    track.front_vertices.clear();
    sort_unique(track.cut);
  }
}

}  // namespace sectio
