#include "sim_server/volume/volume_cutting.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_set>
#include <utility>

namespace sectio {
namespace {

constexpr int kRounds = 3;           // edges are opened that opening others has pinched
constexpr double kStaysOpen = 0.75;  // of a front's area, when it is made anew
constexpr double kSameM = 1e-9;
constexpr double kStuck = 0.5;  // mean edges that a blade goes on in the hope that it can be

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

// The triangle that the blade touches may have been divided, or opened: it is on the nearest of those in its place.
void find_again(const MeshDraft& after, const TopologyDelta& delta, const Vec3& at_m, Stroke& stroke) {
  const auto& [a, b, c] = stroke.touched;
  if (after.find_triangle(a, b, c) != kNone && (position_of(after, stroke) - at_m).norm() < kSameM) return;
  std::vector<TriangleId> skin;
  for (const TriangleEdit& e : delta.triangles)
    if (e.triangle.alive() && e.triangle.surface == Surface::skin) skin.push_back(e.id);
  const SurfacePoint nearest = nearest_on(after, skin, at_m);
  if (nearest.triangle == kNone) return;
  stroke.touched = after.triangle(nearest.triangle).v;
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
                             VolumeDeformation& volume, IsFixed is_fixed, bool has_been_cut)
    : cut_settings_(settings),
      engine_(volume),
      is_fixed_(std::move(is_fixed)),
      volume_(mesh),
      surface_(std::move(vertex_of), mesh.vertices_body_m.size()),
      element_m_(mean_edge_m(mesh)),
      tidied_(has_been_cut ? 0 : kNone) {
  met_.begin(volume_.vertex_count());
  settings_.style = CutStyle::templates;  // all of the edge that is in the body cuts
  settings_.cuts_inside = true;
}

TetVertexState VolumeCutting::state_of(const SharedBody& body, VertexId v) const {
  const auto slots = surface_.slots_of(v);
  const Vec4f& x = slots.empty() ? engine_.position_world_m()[v] : body.particles.position_world_m[slots[0]];
  const Vec4f& u = slots.empty() ? engine_.velocity_m_per_s()[v] : body.particles.velocity_world_m_per_s[slots[0]];
  return {volume_.vertex(v).rest_body_m, x.head<3>().cast<double>(), u.head<3>().cast<double>()};
}

CutPlan VolumeCutting::plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
                            std::span<const BladeMotion> motions) {
  pending_.reset();
  CutPlan plan(cuts);
  const MeshDraft now(body.mesh, body.particles.view());
  std::vector<Stroke> strokes = cuts.strokes;
  for (const auto& [tool, way] : ways_)
    if (std::ranges::find(strokes, tool, &Stroke::tool_id) == strokes.end() && way.has_front) settle();
  for (const Entry& e : entries) {
    Stroke s;
    s.tool_id = e.tool_id;
    s.touched = body.mesh.triangle(e.triangle).v;
    s.bary = e.bary;
    strokes.push_back(s);
    ways_[e.tool_id] = begin_way(body, now, s, motions);
  }
  std::vector<std::uint32_t> lifted;
  bool may_cut = false;
  for (Stroke& s : strokes) {
    const auto motion = std::ranges::find(motions, s.tool_id, &BladeMotion::tool_id);
    if (motion != motions.end()) may_cut |= move(body, now, *motion, s);
    if (motion != motions.end() && motion->lift) {
      lifted.push_back(s.tool_id);
      plan.outcomes.push_back({s.tool_id, StrokeEnd::lifted});
    } else {
      plan.strokes.push_back(s);
    }
  }
  if (!may_cut) return plan;

  Pending pending;
  pending.ways = ways_;
  volume_.fetch_states_from([&](VertexId v) { return state_of(body, v); });
  const double open_m2 = opened_m2();
  const TakenBack before(volume_);
  const bool planned = cut_all(strokes, lifted, pending) && opened_m2() >= kStaysOpen * open_m2 &&
                       plan_change(body, plan, before, pending);
  before.restore(volume_);
  volume_.fetch_states_from({});
  if (!planned) return plan;
  for (const auto& [tool, way] : pending.ways)
    if (way.is_through && std::erase_if(plan.strokes, [id = tool](const Stroke& s) { return s.tool_id == id; }) > 0)
      plan.outcomes.push_back({tool, StrokeEnd::lifted});
  pending_ = std::move(pending);
  return plan;
}

// Whether it may cut now. One that is taken out may have come through; one whose front could not be made anew for long
// leaves it as it is.
bool VolumeCutting::move(const SharedBody& body, const MeshDraft& now, const BladeMotion& motion, Stroke& stroke) {
  Way& way = ways_[stroke.tool_id];
  move_on(now, motion, stroke);
  go(body, way, motion);
  if (motion.lift) {
    way.next_m = 0;
    if (!way.has_front || way.since_cut_m > 0) way.since_cut_m += element_m_;
    settle();
  } else if (way.since_cut_m > kStuck * element_m_) {
    settle();
  }
  return is_due(way);
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
  if (const auto of = kinds_.find({origins[0], origins[1], origins[2]}); of != kinds_.end()) return of->second;
  for (const Corners3& key : {Corners3{origins[0], origins[1], origins[2]}, {origins[0], origins[2], origins[1]}})
    if (const TriangleId t = surface_.triangle_of(mesh, key); t != kNone) return mesh.triangle(t).surface;
  return Surface::wall;
}

// Where the two halves of a cut would meet in an edge, both ends at the tip of a cut that is open on either side of it,
// the surface is no manifold: the edge is opened through its middle. Nothing when that does not help.
std::optional<BoundaryChange> VolumeCutting::open_pinched(const TriangleMesh& mesh, const TakenBack& before,
                                                          Pending& pending) {
  std::vector<VertexId> made;
  BoundaryChange boundary;
  for (int round = 0;; ++round) {
    pending.change = before.change(volume_);
    boundary = boundary_change(pending.change.tetrahedra);
    const auto pinched = surface_.pinched_edges(mesh, boundary);
    if (pinched.empty()) break;
    if (round == kRounds) return {};
    for (const auto& [a, b] : pinched) {
      const VertexId n = volume_.split(a, b, 0.5);
      made.push_back(n);
      for (const auto& component : further_components(volume_, n)) made.push_back(volume_.part(n, component));
    }
  }
  const bool has_front = std::ranges::any_of(pending.ways, [](const auto& way) { return way.second.has_front; });
  if (!has_front) pending.final_steps = volume_.mark();
  for (auto& [tool, way] : pending.ways) {
    auto& list = has_front ? way.of_front : way.cut;
    if (way.since_cut_m == 0) list.insert(list.end(), made.begin(), made.end());
  }
  return boundary;
}

bool VolumeCutting::plan_change(const SharedBody& body, CutPlan& plan, const TakenBack& before, Pending& pending) {
  const auto boundary = open_pinched(body.mesh, before, pending);
  if (!boundary) return false;
  before.find_origins(volume_, pending.change);
  const VertexId first_made = pending.change.first_added;
  for (const VertexId v : before.give_states(volume_))
    if (v < first_made) pending.placed.emplace_back(v, volume_.vertex(v));
  const auto& rest_body_m = engine_.model().mesh().vertices_body_m;
  for (VertexId v = first_made; v < volume_.vertex_count(); ++v) {
    pending.added.push_back(volume_.vertex(v));
    pending.change.fixed.push_back(is_fixed_ && is_fixed_(volume_.vertex(v).rest_body_m));
    if (v < rest_body_m.size() && rest_body_m[v] != volume_.vertex(v).rest_body_m) pending.moved.push_back(v);
  }
  for (Corners3 corners : boundary_change(volume_.change(pending.final_steps).tetrahedra).removed) {
    const Surface kind = kind_of_made(body.mesh, corners);
    std::ranges::sort(corners);
    pending.kinds[corners] = kind;
  }
  MeshDraft draft(body.mesh, body.particles.view());
  const auto state = [&](VertexId v) {
    const TetVertexState& s = volume_.vertex(v);
    return VertexState{s.rest_body_m, s.position_world_m, s.velocity_m_per_s};
  };
  const auto kind = [&](const Corners3& corners) { return kind_of_made(body.mesh, corners); };
  std::vector<Vec3> touched_m;
  for (const Stroke& s : plan.strokes) touched_m.push_back(position_of(draft, s));
  if (!surface_.plan(body.mesh, *boundary, pending.moved, state, kind, draft, pending.slots)) return false;
  if (!before.empty()) {  // what is undone moves masses, which go by volume
    std::vector<VertexId> around;
    for (const TetEdit& e : pending.change.tetrahedra) {
      around.insert(around.end(), e.before.begin(), e.before.end());
      around.insert(around.end(), e.after.begin(), e.after.end());
    }
    pending.before = momentum(body, std::move(around));
  }
  plan.delta = draft.delta();
  for (std::size_t i = 0; i < plan.strokes.size(); ++i) find_again(draft, plan.delta, touched_m[i], plan.strokes[i]);
  plan.seeds = draft.seeds();
  pending.hash = plan.delta.hash_after;
  pending.steps = volume_.take_back();
  return true;
}

}  // namespace sectio
