#include "sim_server/volume/blade_track.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"

namespace sectio {
void BladeTrack::restart() {
  edges = {edges.back()};
  open_to = edges.back();
  forward = Vec3::Zero();
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

TissueAround BladeTracks::around(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world,
                                 BladeTrack& track) const {
  TissueAround found(tissue, blade, otherwise_world, track.vertices_near);
  track.vertices_near = without_front(found.vertices());
  track.frame_world = found.frame_world();
  return found;
}

void BladeTracks::begin(const Tissue& tissue, const MeshDraft& surface, const BladeInTissue& at,
                        const BladeMotion* motion) {
  BladeTrack track;
  track.next_cut_m = tissue.metres(tissue.settings.next_cut_edges());
  for (const VertexId slot : at.v) track.vertices_near.push_back(tissue.volume.surface.vertex_of(slot));
  track.vertices_near = without_front(track.vertices_near);
  if (motion && !motion->path.empty()) {
    Blade blade = motion->path.front();
    const TissueAround around_blade = around(tissue, blade, motion->frame_world, track);
    Vec3 undeformed = Vec3::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      undeformed += at.bary[static_cast<int>(i)] * track.frame_world.to_world(tissue.body.mesh.rest_body_m(at.v[i]));
    const Vec3 pressed_in = at.position_world_m(surface) - undeformed;
    blade.tip_world_m -= pressed_in;
    track.edges.push_back(around_blade.at_rest(blade));
    track.open_to = track.edges.back();
  }
  by_edge[at.edge_id] = std::move(track);
}

void BladeTracks::extend(const Tissue& tissue, const BladeMotion& motion) {
  const FrontSettings& settings = tissue.settings;
  BladeTrack& track = by_edge[motion.edge_id];
  for (const Blade& blade : motion.path) {
    const Pose last = track.edges.empty() ? motion.frame_world : track.frame_world;
    const TissueAround around_blade = around(tissue, blade, last, track);
    track.edges.push_back(around_blade.at_rest(blade));
    if (!track.has_front && look_for_slit(tissue, around_blade, track)) track.restart();
    if (track.edges.size() == 1) track.open_to = track.edges.back();
    if (track.has_left_front(tissue)) {
      finalise_fronts();
      track.restart();
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
}

// To stay in a slit is easier than to come into it.
bool BladeTracks::look_for_slit(const Tissue& tissue, const TissueAround& around_blade, BladeTrack& track) const {
  const double beside_m =
      tissue.metres(track.is_in_slit ? tissue.settings.slit_left_edges : tissue.settings.slit_edges);
  const auto has_tissue = [&](const Vec3& at_m) { return around_blade.has_tissue(at_m); };
  if (slit.empty()) return false;
  const Slit::Parts parts = slit.parts(track.edges.back(), beside_m, has_tissue);
  track.is_in_slit = parts.open_m > 0 && parts.uncut_m == 0;
  return track.is_in_slit;
}

void BladeTracks::finalise_fronts() {
  if (!front) return;
  front.reset();
  for (auto& [edge_id, track] : by_edge) {
    track.has_front = false;
    slit.add_vertices(track.front_vertices);
    track.front_vertices.clear();
  }
}

}  // namespace sectio
