#include "sim_server/volume/blade_cut.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"
#include "sim_server/volume/tets/bridges.h"

namespace sectio {
namespace {

constexpr double kGoesOn = 0.7;  // cosine of the angle at which a sheet goes on from a slit; at others it crosses that

// The sides of a sheet, whose corners are tip and heel of the edge where it begins, heel and tip of that where it ends.
constexpr std::uint32_t kBegin = 1 << 0;           // the track began here
constexpr std::uint32_t kEnd = 1 << 2;             // the blade is here
constexpr std::uint32_t kAlong = 1 << 1 | 1 << 3;  // along which tip and heel went

Vec3 ahead(const BladeEdge& from, const BladeEdge& to) {
  return forward_m(from, to).stableNormalized();
}

// A direction without its part along an edge, which may slide along itself.
Vec3 across(const BladeEdge& edge, const Vec3& direction) {
  const Vec3 up = edge.up();
  return (direction - direction.dot(up) * up).stableNormalized();
}

}  // namespace

// A blade that comes in from the side has pressed that side in before it broke through: tissue behind the track, as
// thin as a thread and with nothing behind it, is cut together with the rest.
TetCutOutcome BladeCut::cut_along(const BladeTrack& track, double further_m, std::uint32_t exact_sides) {
  const bool leaves_halves = !settings_.follows_blade() && !tracks_.slit.empty();  // elements at the ends of slits
  const std::vector<BladeEdge> way = track.way(tissue_);
  const double open_m = forward_m(way.front(), track.open_to).norm();  // the track goes along so much of the slit
  const double overlap_m = std::max(tissue_.metres(settings_.overlap_edges),
                                    leaves_halves ? std::min(tissue_.metres(settings_.half_cut_edges),
                                                             tissue_.metres(settings_.behind_edges) - open_m)
                                                  : 0);
  if (track.is_at_entry) {
    const std::size_t mark = topology_.mark();
    const TetCutOutcome outcome =
        cut_sheet(track, way, overlap_m + tissue_.metres(settings_.thread_edges), further_m, exact_sides | kBegin);
    if (outcome.twins > 0 && (outcome.beyond & kBegin) == 0) return outcome;
    topology_.undo_to(mark);
  }
  return cut_sheet(track, way, overlap_m, further_m, exact_sides);
}

// At rest, so that tissue that sags, springs or is inverted is cut as if it were still. The sheet goes on from all that
// the blade has cut, so that no lip is cut again.
TetCutOutcome BladeCut::cut_sheet(const BladeTrack& track, std::vector<BladeEdge> way, double behind_m,
                                  double further_m, std::uint32_t exact_sides) {
  const double mean_edge_m = tissue_.volume.mean_edge_m;
  const std::size_t last = way.size() - 1;
  std::vector<Vec3> normals;  // a normal for each piece of the way
  for (std::size_t k = 0; k < last; ++k)
    normals.push_back((way[k + 1].heel_m - way[k + 1].tip_m).cross(ahead(way[k], way[k + 1])).stableNormalized());
  const Vec3 begins = ahead(way[0], way[1]), ends = ahead(way[last - 1], way[last]);
  double length_m = 0;
  for (std::size_t k = 0; k < last; ++k)
    length_m += std::max((way[k + 1].tip_m - way[k].tip_m).norm(), (way[k + 1].heel_m - way[k].heel_m).norm());

  way[0] = way[0].moved(-behind_m * begins);
  BladeEdge& to = way[last];
  to = to.moved(further_m * across(to, ends));
  CutSheet sheet{{way[0].tip_m, way[0].heel_m, to.heel_m, to.tip_m},
                 {},
                 exact_sides,
                 exact_sides & kAlong,
                 (kBegin | kEnd) & ~exact_sides};
  for (std::size_t k = 1; k < last; ++k) sheet.bends_rest_m.push_back({way[k].tip_m, way[k].heel_m});

  std::vector<std::uint32_t> begin;
  for (const VertexId v : track.vertices_near) {
    const Vec3& x = topology_.vertex(v).rest_body_m;
    if (std::abs(normals.back().dot(x - to.tip_m)) > mean_edge_m) continue;
    if (settings_.follows_blade() && distance_to_segment(x, to.tip_m, to.heel_m) > mean_edge_m) continue;
    begin.insert(begin.end(), topology_.star(v).begin(), topology_.star(v).end());
  }
  if (begin.empty()) return {};
  const SheetShape shape(sheet);
  const BladeEdge& now = track.edges.back();
  const double reach_m = tissue_.metres(settings_.joined_reach_edges()) + length_m;
  const BladeEdge& from = track.edges.front();
  const double joined_end_m = tissue_.metres(settings_.joined_end_edges);
  std::ranges::copy_if(tracks_.slit.vertices(), std::back_inserter(sheet.joined), [&](VertexId v) {
    const Vec3& x = topology_.vertex(v).rest_body_m;
    if (distance_to_segment(x, now.tip_m, now.heel_m) > reach_m) return false;
    if (track.is_at_front && distance_to_segment(x, from.tip_m, from.heel_m) < joined_end_m) return true;
    const std::size_t k = shape.nearest_piece(x);
    const double beside_m = std::abs(normals[k].dot(x - way[k + 1].tip_m));
    if (beside_m < tissue_.metres(settings_.joined_crossing_edges)) return true;
    if (beside_m > tissue_.metres(settings_.joined_beside_edges)) return false;
    const std::optional<SlitPlane> plane = tracks_.slit.plane_at(x, tissue_.metres(settings_.slit_edges));
    return !plane || std::abs(plane->normal.dot(normals[k])) > kGoesOn;
  });
  TetCutSettings tets = settings_.tets;
  tets.close_m = tissue_.metres(settings_.close_edges);
  tets.crumb_m3 = settings_.crumb_cubic_edges * std::pow(mean_edge_m, 3);
  return cut(topology_, sheet, tets, begin);
}

// A blade that comes out has cut the tissue of its last step, even if tissue that it bulged still lies behind it. A
// blade with a front cuts on only where the tissue ends; elsewhere it is drawn out of the middle of the tissue.
bool BladeCut::cut_for_good(BladeTrack& track, bool is_lifted) {
  const bool has_fronts = settings_.follows_blade();
  const std::size_t mark = topology_.mark();
  TetCutOutcome outcome;
  if (is_lifted || track.tissue_ends)
    outcome = cut_along(track, tissue_.metres(settings_.thread_edges), has_fronts ? kEnd | kAlong : 0);
  track.is_through = outcome.twins > 0 && (outcome.beyond & kEnd) == 0;
  if (!track.is_through) topology_.undo_to(mark);
  const double beyond_m = track.arrives ? tissue_.metres(settings_.overlap_edges) : 0;  // through the wall of the slit
  if (!track.is_through && !is_lifted) outcome = cut_along(track, beyond_m, has_fronts ? kAlong : 0);
  if (outcome.twins == 0 || (is_lifted && !track.is_through)) {
    topology_.undo_to(mark);  // nothing opens yet
    track.is_through = false;
    if (is_lifted) open_bridges_of(tracks_.slit, track);
    return false;
  }
  tracks_.slit.add_vertices(outcome.on_sheet);
  if (is_lifted || track.is_through) {
    Slit slit = tracks_.slit;
    open_to_blade(slit, track);
    open_bridges_of(slit, track);
  }
  return true;
}

// The slit goes on to where the blade is, and beyond that when nothing is left there.
void BladeCut::open_to_blade(Slit& slit, const BladeTrack& track) const {
  const BladeEdge to = track.furthest(tissue_);
  slit.open(track.open_to, to, tissue_.metres(settings_.strip_edges));
  if (!track.is_through) return;
  const Vec3 forward = across(to, forward_m(track.edges.front(), to));
  const Vec3 beyond_m = tissue_.metres(settings_.thread_edges + settings_.overlap_edges) * forward;
  slit.open(to, to.moved(beyond_m), 0);
}

// Paper C's style leaves tetrahedra closed that the blade has not gone through whole.
void BladeCut::open_bridges_of(const Slit& slit, const BladeTrack& track) {
  if (!settings_.follows_blade()) return;
  const BladeEdge to = track.furthest(tissue_);
  const Vec3 across_m = (to.heel_m - to.tip_m).cross(forward_m(track.edges.front(), to));
  const Vec3 normal = track.edges.size() > 1 ? across_m.stableNormalized() : slit.normal_at_end();
  const double beside_m = tissue_.metres(settings_.bridge_beside_edges);
  const std::vector<Vec3> facing = slit.facing(normal, beside_m);
  const auto height_m = [&](const Vec3& at_m) -> std::optional<double> {
    const std::optional<SlitPlane> plane = slit.plane_facing(at_m, beside_m, facing);
    return plane ? std::optional(plane->height_m(at_m)) : std::nullopt;
  };
  std::vector<std::uint32_t> around;
  for (const VertexId v : slit.vertices())
    around.insert(around.end(), topology_.star(v).begin(), topology_.star(v).end());
  sort_unique(around);
  const std::vector<VertexId> opened =
      open_bridges(topology_, height_m, tissue_.metres(settings_.bridge_side_edges), around);
  has_opened_bridges_ |= !opened.empty();
  tracks_.slit.add_vertices(opened);
}

bool BladeCut::cut_front(BladeTrack& track) {
  const std::size_t mark = topology_.mark();
  TetCutOutcome outcome = cut_along(track, -tissue_.metres(settings_.lag_edges), kEnd | kAlong);
  track.has_front = outcome.twins > 0;
  track.front_vertices.clear();
  track.tissue_ends = track.has_front && outcome.ahead_m < tissue_.metres(settings_.thread_edges);
  if (track.has_front)
    track.front_vertices = std::move(outcome.on_sheet);
  else
    topology_.undo_to(mark);
  return track.has_front;
}

bool BladeCut::run(std::span<const BladeAtWork> at_work) {
  std::vector<std::uint32_t> opened;  // by which edges
  for (const auto& [edge_id, is_lifted] : at_work) {
    const auto found = tracks_.by_edge.find(edge_id);
    if (found == tracks_.by_edge.end()) continue;
    if (found->second.is_due()) {
      tried_.push_back(edge_id);
      if (cut_for_good(found->second, is_lifted)) opened.push_back(edge_id);
    } else if (is_lifted && !tracks_.slit.empty()) {
      open_bridges_of(tracks_.slit, found->second);
    }
  }
  lasting_operations_ = topology_.mark();
  for (const auto& [edge_id, is_lifted] : at_work) {
    const auto found = tracks_.by_edge.find(edge_id);
    if (found == tracks_.by_edge.end() || is_lifted || !settings_.follows_blade()) continue;
    if ((found->second.is_due() || found->second.has_front) && cut_front(found->second)) opened.push_back(edge_id);
  }
  bool any = has_opened_bridges_;
  for (auto& [edge_id, track] : tracks_.by_edge) {
    if (!track.is_due() || std::ranges::find(opened, edge_id) == opened.end()) continue;
    open_to_blade(tracks_.slit, track);
    track.open_to = track.furthest(tissue_);
    track.forward = across(track.open_to, forward_m(track.edges.front(), track.open_to));
    track.since_cut_m = 0;
    track.next_cut_m = tissue_.metres(settings_.next_cut_edges());
    any = true;
  }
  return any;
}

}  // namespace sectio
