#include "sim_server/simulation_volume_cut.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_set>
#include <utility>

namespace sectio {
namespace {

constexpr double kAgain = 0.1;     // mean edges that a blade goes after a cut that could not be made
constexpr int kRounds = 3;         // edges are opened that opening others has pinched
constexpr double kCrumb = 0.06;    // of the cube of a mean edge: half of an element
constexpr double kPatience = 1.5;  // mean edges that a blade goes on in the hope of a cut that leaves no crumbs

double mean_edge_m(const TetMesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const auto& [i, j] : kTetEdges) sum += (mesh.vertices_body_m[t[i]] - mesh.vertices_body_m[t[j]]).norm();
  return sum / (6.0 * static_cast<double>(mesh.tetrahedra.size()));
}

// The blade goes through the surface where it did, moved on with it: the nearest of the triangles that it has swept.
void move_on(const MeshDraft& now, const BladeMotion& motion, Stroke& stroke) {
  if (motion.path.empty()) return;
  const Blade& blade = motion.path.back();
  const Vec3 before = position_of(now, stroke);
  const Vec3 at = blade.tip_world_m + (before - blade.tip_world_m).dot(blade.up_world) * blade.up_world;
  stroke.blade = blade;
  stroke.depth_m = (at - blade.tip_world_m).dot(blade.up_world);
  std::vector<TriangleId> skin;
  for (const TriangleId t : motion.active)
    if (now.triangle(t).alive() && now.triangle(t).surface == Surface::skin) skin.push_back(t);
  const SurfacePoint nearest = nearest_on(now, skin, at);
  if (nearest.triangle == kNone) return;
  stroke.touched = now.triangle(nearest.triangle).v;
  stroke.bary = nearest.bary;
}

// The tetrahedra at v that faces connect with each other, without those of the first.
std::vector<std::vector<std::uint32_t>> further_components(const TetTopology& volume, VertexId v) {
  std::vector<std::uint32_t> left(volume.star(v).begin(), volume.star(v).end());
  const auto share_face = [&](std::uint32_t t, std::uint32_t u) {
    return 3 == std::ranges::count_if(volume.tetrahedra()[t], [&](VertexId x) {
             return std::ranges::find(volume.tetrahedra()[u], x) != volume.tetrahedra()[u].end();
           });
  };
  std::vector<std::vector<std::uint32_t>> components;
  while (!left.empty()) {
    std::vector<std::uint32_t> component{left.front()};
    left.erase(left.begin());
    for (std::size_t k = 0; k < component.size(); ++k)
      std::erase_if(left, [&](std::uint32_t t) {
        const bool connected = share_face(component[k], t);
        if (connected) component.push_back(t);
        return connected;
      });
    components.push_back(std::move(component));
  }
  components.erase(components.begin());
  return components;
}

}  // namespace

VolumeCutting::VolumeCutting(const TetMesh& mesh, std::vector<VertexId> vertex_of, const TetCutSettings& settings,
                             VolumeEngine& volume, IsFixed is_fixed, bool has_been_cut)
    : cut_settings_(settings),
      engine_(volume),
      is_fixed_(std::move(is_fixed)),
      volume_(mesh),
      surface_(std::move(vertex_of), mesh.vertices_body_m.size()),
      element_m_(mean_edge_m(mesh)),
      tidied_(has_been_cut ? 0 : kNone) {
  seen_.resize(volume_.vertex_count(), 0);
  give_room(seen_);
  settings_.style = CutStyle::templates;  // all of the edge that is in the body cuts
}

TetVertexState VolumeCutting::state_of(const SharedBody& body, VertexId v) const {
  const auto slots = surface_.slots_of(v);
  const Vec4f& x = slots.empty() ? engine_.position_world_m()[v] : body.particles.position_world_m[slots[0]];
  const Vec4f& u = slots.empty() ? engine_.velocity_m_per_s()[v] : body.particles.velocity_world_m_per_s[slots[0]];
  return {volume_.vertex(v).rest_body_m, x.head<3>().cast<double>(), u.head<3>().cast<double>()};
}

// In the world, where the blade and the tissue are what they are; only where it has been is carried along. The sheet
// goes on from all that the blade has cut: no lip is cut again because it has moved a little.
TetCutOutcome VolumeCutting::cut_along(Way& way) {
  const Edge from = sheet_begins(way), to = way.now_world;
  const CutSheet sheet{{from.tip_m, from.heel_m, to.heel_m, to.tip_m}, way.cut};
  const Vec3 normal = (to.heel_m - to.tip_m).cross(to.tip_m + to.heel_m - from.tip_m - from.heel_m).stableNormalized();
  std::vector<std::uint32_t> begin;
  for (const VertexId v : way.near) {
    if (std::abs(normal.dot(volume_.vertex(v).position_world_m - to.tip_m)) > element_m_) continue;
    begin.insert(begin.end(), volume_.star(v).begin(), volume_.star(v).end());
  }
  if (begin.empty()) return {};
  std::ranges::sort(begin);
  begin.erase(std::unique(begin.begin(), begin.end()), begin.end());
  return cut(volume_, sheet, cut_settings_, begin);
}

CutPlan VolumeCutting::plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
                            std::span<const BladeMotion> motions) {
  pending_.reset();
  CutPlan plan(cuts);
  const MeshDraft now(body.mesh, {body.particles.position_world_m.front().data(),
                                  body.particles.velocity_world_m_per_s.front().data()});
  std::vector<Stroke> strokes = cuts.strokes;
  for (const Entry& e : entries) {
    Stroke s;
    s.tool_id = e.tool_id;
    s.touched = body.mesh.triangle(e.triangle).v;
    s.bary = e.bary;
    strokes.push_back(s);
    ways_[e.tool_id] = begin_way(body, now, s, motions);
  }
  bool may_cut = false;
  for (Stroke& s : strokes) {
    const auto motion = std::ranges::find(motions, s.tool_id, &BladeMotion::tool_id);
    if (motion != motions.end()) {
      move_on(now, *motion, s);
      go(body, ways_[s.tool_id], *motion);
      if (motion->lift) go_through(ways_[s.tool_id]);
      may_cut |= is_due(ways_[s.tool_id]);
    }
    if (motion != motions.end() && motion->lift)
      plan.outcomes.push_back({s.tool_id, StrokeEnd::lifted});
    else
      plan.strokes.push_back(s);
  }
  if (!may_cut) return plan;

  std::map<std::uint32_t, Way> after = ways_;
  std::uint32_t twins = 0;
  volume_.fetch_states_from([&](VertexId v) { return state_of(body, v); });
  for (const Stroke& s : strokes) {
    if (!ways_.contains(s.tool_id)) continue;
    Way& way = after[s.tool_id];
    if (!is_due(way)) continue;
    ways_[s.tool_id].next_m = way.since_cut_m + kAgain * element_m_;
    const std::size_t mark = volume_.mark();
    const TetCutOutcome outcome = cut_along(way);
    const bool may_wait = way.next_m > 0 && way.since_cut_m < kPatience * element_m_;
    if (outcome.twins == 0 || (may_wait && leaves_crumbs())) {  // nothing opens yet; or later, further on
      volume_.undo_to(mark);
      continue;
    }
    twins += outcome.twins;
    way.since_cut_m = 0;
    way.cut_to = way.edges.back();
    way.next_m = next_cut_m();
    std::vector<VertexId> both;
    std::ranges::sort(way.cut);
    std::ranges::set_union(way.cut, outcome.on_sheet, std::back_inserter(both));
    way.cut = std::move(both);
  }
  if (twins > 0) plan_change(body, plan, std::move(after));
  volume_.undo_to(0);
  volume_.fetch_states_from({});
  return plan;
}

// Has less than half of an element come off? O(operations).
bool VolumeCutting::leaves_crumbs() const {
  const double enough_m3 = kCrumb * std::pow(element_m_, 3);
  std::unordered_set<std::uint32_t> large;  // asked, never walked
  std::vector<std::uint32_t> found;
  for (const TetEdit& e : volume_.change().tetrahedra) {
    if (e.before == e.after || large.contains(e.id)) continue;
    found.assign(1, e.id);
    double volume_m3 = 0;
    bool is_large = false;
    for (std::size_t k = 0; k < found.size() && !is_large; ++k) {
      volume_m3 += volume_.volume_m3(found[k]);
      is_large = volume_m3 > enough_m3;
      for (std::size_t corner = 0; corner < 4 && !is_large; ++corner) {
        const std::uint32_t u = volume_.across(found[k], corner);
        if (u == kNone || std::ranges::find(found, u) != found.end()) continue;
        found.push_back(u);
        is_large = large.contains(u);
      }
    }
    if (!is_large) return true;
    large.insert(found.begin(), found.end());
  }
  return false;
}

// A triangle that lies in one of the surface before is of that one's kind; others are walls.
Surface VolumeCutting::kind_of_made(const TriangleMesh& mesh, const Corners3& corners) const {
  std::set<VertexId> from(corners.begin(), corners.end());
  while (const auto edge = volume_.made_from(*from.rbegin())) {  // the ends of an edge are older
    from.erase(std::prev(from.end()));
    from.insert(edge->begin(), edge->end());
  }
  const std::vector<VertexId> origins(from.begin(), from.end());
  if (origins.size() != 3) return Surface::wall;
  for (const Corners3& key : {Corners3{origins[0], origins[1], origins[2]}, {origins[0], origins[2], origins[1]}})
    if (const TriangleId t = surface_.triangle_of(mesh, key); t != kNone) return mesh.triangle(t).surface;
  return Surface::wall;
}

// Where the two halves of a cut would meet in an edge, both ends at the tip of a cut that is open on either side of it,
// the surface is no manifold: the edge is opened through its middle. Nothing when that does not help.
std::optional<BoundaryChange> VolumeCutting::open_pinched(const TriangleMesh& mesh, TetChange& change,
                                                          std::vector<VertexId>& made) {
  for (int round = 0;; ++round) {
    change = volume_.change();
    BoundaryChange boundary = boundary_change(change.tetrahedra);
    const auto pinched = surface_.pinched_edges(mesh, boundary);
    if (pinched.empty()) return boundary;
    if (round == kRounds) return {};
    for (const auto& [a, b] : pinched) {
      const VertexId n = volume_.split(a, b, 0.5);
      made.push_back(n);
      for (const auto& component : further_components(volume_, n)) made.push_back(volume_.part(n, component));
    }
  }
}

bool VolumeCutting::plan_change(const SharedBody& body, CutPlan& plan, std::map<std::uint32_t, Way> ways) {
  Pending pending;
  std::vector<VertexId> opened;
  const auto boundary = open_pinched(body.mesh, pending.change, opened);
  if (!boundary) return false;
  for (auto& [tool, way] : ways)
    if (way.since_cut_m == 0) way.cut.insert(way.cut.end(), opened.begin(), opened.end());
  const auto first_made = static_cast<VertexId>(engine_.position_world_m().size());
  for (VertexId v = first_made; v < volume_.vertex_count(); ++v) {
    pending.added.push_back(volume_.vertex(v));
    pending.change.fixed.push_back(is_fixed_ && is_fixed_(volume_.vertex(v).rest_body_m));
  }
  MeshDraft draft(body.mesh, {body.particles.position_world_m.front().data(),
                              body.particles.velocity_world_m_per_s.front().data()});
  const auto state = [&](VertexId v) {
    const TetVertexState& s = volume_.vertex(v);
    return VertexState{s.rest_body_m, s.position_world_m, s.velocity_m_per_s};
  };
  const auto kind = [&](const Corners3& corners) { return kind_of_made(body.mesh, corners); };
  if (!surface_.plan(body.mesh, *boundary, state, kind, draft, pending.slots)) return false;
  plan.delta = draft.delta();
  plan.seeds = draft.seeds();
  pending.hash = plan.delta.hash_after;
  pending.steps = volume_.take_back();
  pending.ways = std::move(ways);
  pending_ = std::move(pending);
  return true;
}

}  // namespace sectio
