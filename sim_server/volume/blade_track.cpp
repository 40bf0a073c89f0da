#include "sim_server/volume/blade_track.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr double kCrosses = 0.35;    // sine of the angle at which a blade crosses a slit, and doesn't go along it
constexpr double kTurnsBack = -0.3;  // cosine between two pieces of a way, of a blade that saws
constexpr double kTurns = 0.75;      // cosine between the directions of a front and of the blade, at a corner
constexpr double kSlides = 4;  // a blade that goes so many times as far along its edge as across it slides in its cut

// How far tip and heel have gone across the edge, the one that has gone less and the one that has gone further.
std::pair<double, double> across_m(const BladeEdge& from, const BladeEdge& to) {
  const Vec3 up = to.up();
  return std::minmax({(to.tip_m - from.tip_m).cross(up).norm(), (to.heel_m - from.heel_m).cross(up).norm()});
}

bool slides(const BladeEdge& from, const BladeEdge& to) {
  return (to.tip_m - from.tip_m).norm() > kSlides * across_m(from, to).second;
}

// How far an edge is beside the plane through another one, the end of it that is further.
double beside_plane_m(const Vec3& normal, const BladeEdge& from, const BladeEdge& to) {
  return std::max(std::abs(normal.dot(to.tip_m - from.tip_m)), std::abs(normal.dot(to.heel_m - from.heel_m)));
}

// Adds the places after the first up to the last: bends where the way is furthest beside the straight one (Ramer 1972,
// Douglas and Peucker 1973).
void add_bends(std::span<const BladeEdge> edges, std::size_t first, std::size_t last, const Tissue& tissue,
               std::vector<BladeEdge>& way) {
  const BladeEdge &from = edges[first], &to = edges[last];
  const Vec3 normal = (from.heel_m + to.heel_m - from.tip_m - to.tip_m).cross(forward_m(from, to)).stableNormalized();
  const double least_m = tissue.metres(tissue.settings.least_piece_edges);
  std::size_t bend = first;
  double most_m = 0, jump_m = 0;
  for (std::size_t k = first + 1; k <= last; ++k) {
    const BladeEdge& at = edges[k];
    jump_m = std::max(jump_m, beside_plane_m(normal, edges[k - 1], at));
    const double aside_m = beside_plane_m(normal, from, at);
    if (aside_m <= most_m || std::min(forward_m(from, at).norm(), forward_m(at, to).norm()) < least_m) continue;
    most_m = aside_m, bend = k;
  }
  const FrontSettings& settings = tissue.settings;
  const double bend_m = std::clamp(settings.bend_jumps * jump_m, tissue.metres(settings.smooth_bend_edges),
                                   tissue.metres(settings.bend_edges));
  if (most_m <= bend_m) {
    way.push_back(to);
    return;
  }
  add_bends(edges, first, bend, tissue, way);
  add_bends(edges, bend, last, tissue, way);
}

bool crosses(const SlitPlane& plane, const Vec3& way_m) {
  return std::abs(way_m.stableNormalized().dot(plane.normal)) > kCrosses;
}

// A blade that is in a slit is in its plane: what it cuts next begins at the end of the slit, not beside it. A blade
// that crosses a slit is where its way crosses the plane: a cut from further aside would leave a crumb between both.
BladeEdge on_plane(const SlitPlane& plane, BladeEdge edge, const Vec3& way_m) {
  const Vec3 way = way_m.stableNormalized();
  const Vec3 back = crosses(plane, way_m) ? Vec3(way / way.dot(plane.normal)) : plane.normal;
  for (Vec3* end_m : {&edge.tip_m, &edge.heel_m}) *end_m -= plane.height_m(*end_m) * back;
  return edge;
}

// A blade that breaks in sideways comes from outside: its first place is one where it is clear of the body. When that
// is far behind, the blade has come through a slit, and opens nothing on its way.
std::span<const Blade> way_of(const Tissue& tissue, const BladeMotion& motion, const Slit& slit) {
  const std::span<const Blade> path = motion.path;
  const bool is_far = path.size() > 1 &&
                      (path[1].tip_world_m - path[0].tip_world_m).norm() > tissue.metres(tissue.settings.around_edges);
  return is_far && !slit.empty() ? path.subspan(1) : path;
}

}  // namespace

// A blade that slides along its edge, out of the tissue and in again, cuts on from the place that it came to last:
// a sheet from the place of a lifted blade to that of one put down would leave what lies beneath. So does one that
// goes down its slit, to where that is not open.
void BladeTrack::add(const BladeEdge& edge, double same_m) {
  const auto stays = [&] { return across_m(edges[edges.size() > 1 ? edges.size() - 2 : 0], edge).second < same_m; };
  while (edges.size() > (is_at_entry ? 1 : 0) && slides(edges.back(), edge) && stays()) edges.pop_back();
  edges.push_back(edge);
}

void BladeTrack::deepen_entry(double same_m) {
  BladeEdge& entry = edges.front();
  if (across_m(entry, edges.back()).second > same_m) return;
  const Vec3 up = entry.up();
  entry = entry.moved(std::min(0.0, up.dot(edges.back().tip_m - entry.tip_m)) * up);
}

void BladeTrack::begin_deeper() {
  if (edges.size() == 2 && slides(edges.front(), edges.back())) edges.erase(edges.begin());
}

void BladeTrack::restart_from(const BladeEdge& place) {
  open_to = place;
  edges = {open_to, edges.back()};
  if (edges.front() == edges.back()) edges.pop_back();
  is_at_entry = is_at_front = turns = false;
  forward = Vec3::Zero();
}

void BladeTrack::go_on_from_front(const Tissue& tissue) {
  restart_from(open_to.moved(-tissue.metres(tissue.settings.lag_edges) * forward));
  is_at_front = true;
}

bool BladeTrack::comes_across(const Tissue& tissue, const SlitPlane& plane, const BladeEdge& edge) const {
  if (!tissue.settings.follows_blade() || edges.empty()) return false;
  const double left_m = std::abs(plane.height_m(open_to.at(0.5)));
  return left_m > tissue.metres(tissue.settings.joined_crossing_edges) && crosses(plane, forward_m(open_to, edge));
}

bool BladeTrack::turns_at_end(const Tissue& tissue, const BladeEdge& edge) const {
  if (tissue.settings.follows_blade() || is_in_slit || edges.size() < 2) return false;
  const double share = share_in_tissue(tissue, edge);
  return across_m(open_to.up_to(share), edge.up_to(share)).second < tissue.metres(tissue.settings.turn_edges);
}

double BladeTrack::ahead_m(const Tissue& tissue) const {
  const BladeEdge& now = edges.back();
  const Vec3 up = now.up();
  const double back_m = tissue.metres(tissue.settings.follow_every_edges);
  const auto gone_m = [&](const Vec3& from, const Vec3& to) {
    const double m = (to - from).cross(up).norm();
    return tissue.settings.follows_blade() && (to - from).dot(forward) < -back_m ? -m : m;
  };
  return std::max(gone_m(open_to.tip_m, now.tip_m), gone_m(open_to.heel_m, now.heel_m));
}

BladeEdge BladeTrack::furthest(const Tissue& tissue) const {
  BladeEdge edge = edges.back();
  if (!tissue.settings.follows_blade()) return edge;
  const Vec3 up = edge.up();
  const double beside_m = tissue.metres(tissue.settings.left_beside_edges);
  for (const auto& [end_m, open_to_m] : {std::pair(&edge.tip_m, open_to.tip_m), {&edge.heel_m, open_to.heel_m}}) {
    const double back_m = -(*end_m - open_to_m).dot(forward);
    if (!(back_m > 0)) continue;
    const Vec3 aside_m = *end_m + back_m * forward - open_to_m;
    *end_m = open_to_m;
    if (aside_m.cross(up).norm() > beside_m) *end_m += aside_m;
  }
  return edge;
}

double BladeTrack::share_in_tissue(const Tissue& tissue, const BladeEdge& edge) const {
  const Vec3 up_m = edge.heel_m - edge.tip_m, up = up_m.stableNormalized();
  double depth_m = 0;
  for (const VertexId v : vertices_near)
    depth_m = std::max(depth_m, up.dot(tissue.volume.topology.vertex(v).rest_body_m - edge.tip_m));
  return std::min(1.0, (depth_m + tissue.metres(tissue.settings.above_edges)) / up_m.norm());
}

BladeEdge BladeTrack::part_of(const Tissue& tissue, const BladeEdge& edge) {
  if (!tissue.settings.follows_blade()) return edge;
  most_share = std::max(most_share, share_in_tissue(tissue, edge));
  return edge.up_to(most_share);
}

std::vector<BladeEdge> BladeTrack::in_tissue(const Tissue& tissue) const {
  const double share = share_in_tissue(tissue, edges.back());
  std::vector<BladeEdge> parts;
  for (const BladeEdge& edge : edges) parts.push_back(edge.up_to(share));
  return parts;
}

std::vector<BladeEdge> BladeTrack::way(const Tissue& tissue) const {
  if (tissue.settings.follows_blade()) return {edges.front(), furthest(tissue)};
  const std::vector<BladeEdge> parts = in_tissue(tissue);
  std::vector<BladeEdge> way{parts.front()};
  add_bends(parts, 0, parts.size() - 1, tissue, way);
  for (std::size_t k = way.size() - 1; k > 1; --k) {
    const Vec3 before = forward_m(way[k - 2], way[k - 1]).stableNormalized();
    if (before.dot(forward_m(way[k - 1], way[k]).stableNormalized()) > kTurnsBack) continue;
    way.erase(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(k - 1));
    break;
  }
  return way;
}

bool BladeTrack::turns_aside() const {
  const BladeEdge& now = edges.back();
  const Vec3 up = now.up(), gone_m = forward_m(open_to, now), across_m = gone_m - gone_m.dot(up) * up;
  return has_front && !forward.isZero() && forward.dot(across_m) < kTurns * across_m.norm();
}

BladeTrack::Beyond BladeTrack::beyond_front(const Tissue& tissue) const {
  const double corner_m = tissue.metres(tissue.settings.corner_after_edges);
  if (turns && across_m(open_to, edges.back()).second > corner_m) return Beyond::around_corner;
  if (ahead_m(tissue) >= 0) return Beyond::nowhere;
  const BladeEdge& now = edges.back();
  const Vec3 normal = forward.cross(open_to.up()).stableNormalized();
  if (-forward.dot(forward_m(open_to, now)) > tissue.metres(tissue.settings.left_behind_edges)) return Beyond::behind;
  const bool is_beside = beside_plane_m(normal, open_to, now) > tissue.metres(tissue.settings.left_beside_edges);
  return is_beside ? Beyond::beside : Beyond::nowhere;
}

TissueAround BladeTracks::around(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world,
                                 BladeTrack& track) const {
  std::vector<VertexId> begin = track.vertices_near;
  const double around_m = tissue.metres(tissue.settings.around_edges);
  std::ranges::copy_if(slit.vertices(), std::back_inserter(begin), [&](VertexId v) {
    return distance_to_segment(tissue.state_of(v).position_world_m, blade.tip_world_m, heel_world_m(blade)) < around_m;
  });
  TissueAround found(tissue, blade, otherwise_world, std::move(begin));
  track.vertices_near = without_front(found.vertices());
  track.frame_world = found.frame_world();
  return found;
}

void BladeTracks::begin(const Tissue& tissue, const MeshDraft& surface, const BladeInTissue& at,
                        const BladeMotion* motion) {
  const FrontSettings& settings = tissue.settings;
  BladeTrack track;
  track.next_cut_m = tissue.metres(tissue.settings.next_cut_edges());
  for (const VertexId slot : at.v) track.vertices_near.push_back(tissue.volume.surface.vertex_of(slot));
  track.vertices_near = without_front(track.vertices_near);
  if (motion && !motion->path.empty()) {
    Blade blade = way_of(tissue, *motion, slit).front();
    const TissueAround around_blade = around(tissue, blade, motion->frame_world, track);
    Vec3 undeformed = Vec3::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      undeformed += at.bary[static_cast<int>(i)] * track.frame_world.to_world(tissue.body.mesh.rest_body_m(at.v[i]));
    Vec3 pressed_in = at.position_world_m(surface) - undeformed;
    pressed_in *= std::min(1.0, tissue.metres(settings.deepest_dent_edges) / std::max(pressed_in.norm(), 1e-9));
    blade.tip_world_m -= pressed_in;
    track.edges.push_back(track.part_of(tissue, around_blade.at_rest(blade)));
    track.open_to = track.edges.back();
    track.is_at_entry = true;
  }
  by_edge[at.edge_id] = std::move(track);
}

void BladeTracks::extend(const Tissue& tissue, const BladeMotion& motion) {
  const FrontSettings& settings = tissue.settings;
  BladeTrack& track = by_edge[motion.edge_id];
  const double same_m = tissue.metres(settings.follows_blade() ? 0 : settings.same_place_edges);
  if (std::exchange(track.arrives, false)) {
    track.restart_from(track.edges.back());
    track.next_cut_m = tissue.metres(settings.next_cut_edges());
  }
  for (const Blade& blade : way_of(tissue, motion, slit)) {
    const Pose last = track.edges.empty() ? motion.frame_world : track.frame_world;
    const TissueAround around_blade = around(tissue, blade, last, track);
    const EdgeNearSlit near = track.has_front || slit.empty()
                                  ? EdgeNearSlit{around_blade.at_rest(blade), {}, false}
                                  : edge_near_slit(tissue, around_blade, blade, track.is_in_slit);
    const BladeEdge edge = track.part_of(tissue, near.edge);
    if (near.is_in_slit && !track.turns_at_end(tissue, edge)) {
      const bool comes = !std::exchange(track.is_in_slit, true);
      if (comes) track.came_into_slit = edge;
      if (comes && near.plane && track.comes_across(tissue, *near.plane, edge)) {
        track.arrives = true;
        track.add(on_plane(*near.plane, edge, forward_m(track.open_to, edge)), same_m);
      } else if (!track.arrives) {
        track.add(near.plane ? on_plane(*near.plane, edge, forward_m(track.came_into_slit, edge)) : edge, same_m);
        track.restart_from(track.edges.back());
      }
    } else {
      track.add(edge, same_m);
      track.is_in_slit = false;
    }
    if (track.is_at_entry)
      settings.follows_blade() ? track.begin_deeper() : track.deepen_entry(tissue.metres(settings.least_piece_edges));
    if (track.edges.size() == 1) track.open_to = track.edges.back();
    track.turns = !motion.lift && track.turns_aside();
    if (const auto beyond = track.beyond_front(tissue); beyond != BladeTrack::Beyond::nowhere) {
      finalise_fronts();
      if (beyond == BladeTrack::Beyond::around_corner)
        track.go_on_from_front(tissue);
      else
        track.restart_from(beyond == BladeTrack::Beyond::beside ? track.open_to : track.edges.back());
    }
    track.since_cut_m = track.ahead_m(tissue);
  }
  if (track.arrives) track.next_cut_m = 0;
  const double longest_m = tissue.metres(settings.longest_sheet_edges);
  const double behind_m = tissue.metres(settings.follows_blade() ? settings.front_behind_edges : settings.behind_edges);
  const double reach_m = std::min(longest_m, std::max(0.0, track.since_cut_m) + behind_m);
  const auto gone_m = [&](const BladeEdge& from) {
    const BladeEdge& now = track.edges.back();
    if (!settings.follows_blade()) return across_m(from, now).first;
    return std::min((from.tip_m - now.tip_m).norm(), (from.heel_m - now.heel_m).norm());
  };
  while (track.edges.size() > 2 && gone_m(track.edges[1]) > reach_m) {
    track.edges.erase(track.edges.begin());
    track.is_at_entry = track.is_at_front = false;
  }
}

// To stay in a slit is easier than to come into it.
BladeTracks::EdgeNearSlit BladeTracks::edge_near_slit(const Tissue& tissue, const TissueAround& around_blade,
                                                      const Blade& blade, bool was_in_slit) const {
  const double lid_m = tissue.metres(tissue.settings.lid_edges);
  const auto plane_at = [&](const Vec3& at_m) { return slit.plane_at(at_m, lid_m); };
  const BladePlaces places = around_blade.places_at_rest(blade, plane_at);
  const double beside_m = tissue.metres(was_in_slit ? tissue.settings.slit_left_edges : tissue.settings.slit_edges);
  const Slit::Parts parts = slit.parts([&](double share) { return places.rest_at(share); }, beside_m,
                                       [&](const Vec3& at_m) { return around_blade.has_tissue(at_m); });
  if (parts.open == 0 || parts.uncut > 0) return {places.straight(), {}, false};
  const std::size_t middle = static_cast<std::size_t>(std::ranges::max_element(places.weight) - places.weight.begin());
  return {places.straight(), plane_at(places.rest_m(middle)), true};
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
