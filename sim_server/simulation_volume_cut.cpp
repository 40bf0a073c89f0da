#include "sim_server/simulation_volume_cut.h"

#include <algorithm>
#include <set>
#include <utility>

namespace sectio {
namespace {

using Corners3 = std::array<VertexId, 3>;

constexpr double kEvery = 0.5;      // mean edges that a blade goes between two cuts
constexpr double kBehind = 2.0;     // mean edges that a sheet reaches behind the last cut: into what was cut in part
constexpr double kAgain = 0.1;      // and after one that could not be made
constexpr double kAround = 2;       // mean edges: tissue this close to a blade
constexpr std::size_t kFewest = 8;  // vertices whose motion is one
constexpr double kThrough = 0.5;    // mean edges beyond where a blade comes out
constexpr int kRounds = 3;          // edges are opened that opening others has pinched
constexpr double kLongest = 8;      // mean edges: a sheet is flat, a way isn't

// The lowest corner first: the same triangle is the same key.
Corners3 turned(Corners3 v) {
  std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
  return v;
}

double mean_edge_m(const TetMesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const auto& [i, j] : kTetEdges) sum += (mesh.vertices_body_m[t[i]] - mesh.vertices_body_m[t[j]]).norm();
  return sum / (6.0 * static_cast<double>(mesh.tetrahedra.size()));
}

Vec4f padded(const Vec3& x) {
  Vec4f out = Vec4f::Zero();
  out.head<3>() = x.cast<float>();
  return out;
}

double distance_to_segment_m(const Vec3& x, const Vec3& a, const Vec3& b) {
  const double along = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + along * (b - a) - x).norm();
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

// Edges at which four triangles of the surface meet: both ends of each lie at the tip of a cut that is open on either
// side of it. Ascending.
std::vector<std::array<VertexId, 2>> pinched_edges(const TriangleSoup& surface) {
  std::vector<std::array<VertexId, 2>> edges;  // as directed, once a triangle
  for (const Corners3& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      if (t[i] < t[(i + 1) % 3]) edges.push_back({t[i], t[(i + 1) % 3]});
  std::sort(edges.begin(), edges.end());
  std::vector<std::array<VertexId, 2>> pinched;
  for (std::size_t k = 1; k < edges.size(); ++k)
    if (edges[k] == edges[k - 1] && (pinched.empty() || pinched.back() != edges[k])) pinched.push_back(edges[k]);
  return pinched;
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

Renumbered renumbered(const TetMesh& mesh, std::span<const VertexId> first) {
  Renumbered out;
  std::vector<VertexId> new_id(mesh.vertices_body_m.size(), kNone);
  const auto take = [&](VertexId v) {
    if (new_id[v] != kNone) return;
    new_id[v] = static_cast<VertexId>(out.from.size());
    out.from.push_back(v);
    out.mesh.vertices_body_m.push_back(mesh.vertices_body_m[v]);
  };
  for (const VertexId v : first) take(v);
  for (VertexId v = 0; v < new_id.size(); ++v) take(v);
  for (const Tetrahedron& t : mesh.tetrahedra)
    out.mesh.tetrahedra.push_back({new_id[t[0]], new_id[t[1]], new_id[t[2]], new_id[t[3]]});
  return out;
}

VolumeCutting::VolumeCutting(const TetMesh& mesh, const StrokeSettings& settings, VolumeEngine& volume,
                             MakeModel make_model)
    : settings_(settings),
      engine_(volume),
      make_model_(std::move(make_model)),
      volume_(mesh),
      element_m_(mean_edge_m(mesh)) {
  settings_.style = CutStyle::templates;  // all of the edge that is in the body cuts
}

TetVertexState VolumeCutting::state_of(const SharedBody& body, VertexId v) const {
  const bool outside = v < body.mesh.vertex_slots();
  const Vec4f& x = outside ? body.particles.position_world_m[v] : engine_.position_world_m()[v];
  const Vec4f& u = outside ? body.particles.velocity_world_m_per_s[v] : engine_.velocity_m_per_s()[v];
  return {volume_.vertex(v).rest_body_m, x.head<3>().cast<double>(), u.head<3>().cast<double>()};
}

// The tissue around a blade has a motion of its own: with it goes what the blade is in the shape at rest, in which lips
// that have opened lie together.
VolumeCutting::Edge VolumeCutting::at_rest(const SharedBody& body, const Blade& blade, const Pose& frame_world) const {
  const Vec3 heel_m = blade.tip_world_m + blade.length_m * blade.up_world;
  std::vector<MatchedPoint> around;
  for (VertexId v = 0; v < volume_.vertex_count(); ++v) {
    const TetVertexState state = state_of(body, v);
    if (distance_to_segment_m(state.position_world_m, blade.tip_world_m, heel_m) < kAround * element_m_)
      around.push_back({state.rest_body_m, state.position_world_m, 1});
  }
  const Pose frame = around.size() < kFewest ? frame_world : match_shape(around, frame_world);
  return {frame.to_local(blade.tip_world_m), frame.to_local(heel_m)};
}

// The tissue that a blade had pressed in springs back over it: the way begins where the blade would be without that.
VolumeCutting::Way VolumeCutting::begin_way(const SharedBody& body, const MeshDraft& now, const Stroke& stroke,
                                            std::span<const BladeMotion> motions) const {
  Way way;
  way.next_m = kEvery * element_m_;
  const auto motion = std::ranges::find(motions, stroke.tool_id, &BladeMotion::tool_id);
  if (motion == motions.end() || motion->path.empty()) return way;
  Vec3 home = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    home += stroke.bary[static_cast<int>(i)] * motion->frame_world.to_world(body.mesh.rest_body_m(stroke.touched[i]));
  const Vec3 pressed_in = motion->frame_world.orientation.conjugate() * (position_of(now, stroke) - home);
  Edge edge = at_rest(body, motion->path.front(), motion->frame_world);
  edge.tip_m -= pressed_in;
  edge.heel_m -= pressed_in;
  way.edges.push_back(edge);
  way.cut_to = edge;
  return way;
}

void VolumeCutting::go(const SharedBody& body, Way& way, const BladeMotion& motion) {
  for (const Blade& blade : motion.path) {
    const Edge edge = at_rest(body, blade, motion.frame_world);
    if (way.edges.empty()) way.cut_to = edge;
    const Vec3 up = (edge.heel_m - edge.tip_m).normalized();
    way.since_cut_m =
        std::max((edge.tip_m - way.cut_to.tip_m).cross(up).norm(), (edge.heel_m - way.cut_to.heel_m).cross(up).norm());
    way.edges.push_back(edge);
  }
  const auto far = [&](const Edge& e, double m) {
    return (e.tip_m - way.edges.back().tip_m).norm() > m && (e.heel_m - way.edges.back().heel_m).norm() > m;
  };
  const double reach_m = std::min(kLongest * element_m_, way.since_cut_m + kBehind * element_m_);
  while (way.edges.size() > 2 && far(way.edges[1], reach_m)) way.edges.erase(way.edges.begin());
}

// A blade that comes out has cut what it passed through in its last step; tissue that it bulged is still behind it.
void VolumeCutting::go_through(Way& way) {
  if (way.edges.size() < 2) return;
  const Edge &first = way.edges.front(), last = way.edges.back();
  const Vec3 ahead = kThrough * element_m_ * (last.tip_m + last.heel_m - first.tip_m - first.heel_m).stableNormalized();
  way.edges.push_back({last.tip_m + ahead, last.heel_m + ahead});
  way.next_m = 0;
  way.since_cut_m += ahead.norm();
}

TetCutOutcome VolumeCutting::cut_along(Way& way) {
  const Edge &from = way.edges.front(), &to = way.edges.back();
  // The sheet goes on from all that the blade has cut: no lip is cut again because it has moved a little.
  const CutSheet sheet{{from.tip_m, from.heel_m, to.heel_m, to.tip_m}, way.cut};
  TetCutSettings settings;
  settings.snap = settings_.snap_ratio;
  settings.semi_progressive = true;
  return cut(volume_, sheet, settings);
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
  for (const Stroke& s : strokes) {
    if (!ways_.contains(s.tool_id)) continue;
    Way& way = after[s.tool_id];
    if (!is_due(way)) continue;
    ways_[s.tool_id].next_m = way.since_cut_m + kAgain * element_m_;
    const std::size_t mark = volume_.mark();
    const TetCutOutcome outcome = cut_along(way);
    if (outcome.twins == 0) {  // nothing opens yet
      volume_.undo_to(mark);
      continue;
    }
    twins += outcome.twins;
    way.since_cut_m = 0;
    way.cut_to = way.edges.back();
    way.next_m = kEvery * element_m_;
    std::vector<VertexId> both;
    std::ranges::sort(way.cut);
    std::ranges::set_union(way.cut, outcome.on_sheet, std::back_inserter(both));
    way.cut = std::move(both);
  }
  if (twins > 0) plan_change(body, plan, std::move(after));
  volume_.undo_to(0);
  return plan;
}

// A triangle that lies in one of the surface before is of that one's kind; others are walls.
Surface VolumeCutting::surface_of_made(const TriangleMesh& mesh, const Corners3& corners,
                                       const std::map<Corners3, TriangleId>& before) const {
  std::set<VertexId> origins;
  std::vector<VertexId> left(corners.begin(), corners.end());
  while (!left.empty()) {
    const VertexId v = left.back();
    left.pop_back();
    if (const auto from = volume_.made_from(v))
      left.insert(left.end(), from->begin(), from->end());
    else
      origins.insert(v);
  }
  if (origins.size() != 3 || *origins.rbegin() >= mesh.vertex_slots()) return Surface::wall;
  const std::vector<VertexId> o(origins.begin(), origins.end());
  for (const Corners3& key : {Corners3{o[0], o[1], o[2]}, Corners3{o[0], o[2], o[1]}})
    if (const auto it = before.find(key); it != before.end()) return mesh.triangle(it->second).surface;
  return Surface::wall;
}

// A surface is a manifold: where the two halves of a cut would meet in an edge, it is opened through the edge's middle.
TetSurface VolumeCutting::open_pinched(std::vector<VertexId>& made) {
  TetSurface surface = sectio::surface_of(volume_.mesh());
  for (int round = 0; round < kRounds; ++round) {
    const auto pinched = pinched_edges(surface.soup);
    if (pinched.empty()) break;
    for (const auto& [a, b] : pinched) {
      const VertexId n = volume_.split(surface.of_volume[a], surface.of_volume[b], 0.5);
      made.push_back(n);
      for (const auto& component : further_components(volume_, n)) made.push_back(volume_.part(n, component));
    }
    surface = sectio::surface_of(volume_.mesh());
  }
  return surface;
}

// What was made on an edge moves as the edge does.
std::vector<TetVertexState> VolumeCutting::states_of_all(const SharedBody& body) const {
  std::vector<TetVertexState> states;
  for (VertexId v = 0; v < volume_.vertex_count(); ++v) {
    const auto from = volume_.made_from(v);
    if (!from) {
      states.push_back(state_of(body, v));
      continue;
    }
    const TetVertexState a = states[(*from)[0]], b = states[(*from)[1]];
    const Vec3& rest = volume_.vertex(v).rest_body_m;
    const Vec3 edge = b.rest_body_m - a.rest_body_m;
    const double t = edge.isZero(0) ? 0 : (rest - a.rest_body_m).dot(edge) / edge.squaredNorm();
    states.push_back({rest, a.position_world_m + t * (b.position_world_m - a.position_world_m),
                      a.velocity_m_per_s + t * (b.velocity_m_per_s - a.velocity_m_per_s)});
  }
  return states;
}

bool VolumeCutting::plan_change(const SharedBody& body, CutPlan& plan, std::map<std::uint32_t, Way> ways) {
  std::vector<VertexId> opened;
  const TetSurface surface = open_pinched(opened);
  for (auto& [tool, way] : ways)
    if (way.since_cut_m == 0) way.cut.insert(way.cut.end(), opened.begin(), opened.end());
  const TetMesh cut_mesh = volume_.mesh();
  std::map<Corners3, TriangleId> before;
  for (TriangleId t = 0; t < body.mesh.triangle_slots(); ++t)
    if (body.mesh.triangle(t).alive()) before[turned(body.mesh.triangle(t).v)] = t;

  // Vertices of the surface stay there, so the surface before has the first slots.
  std::vector<Triangle> added;
  std::set<TriangleId> gone;
  for (const auto& [key, t] : before) gone.insert(t);
  for (const Corners3& triangle : surface.soup.triangles) {
    const auto same = before.find(turned(triangle));
    if (same != before.end()) {
      gone.erase(same->second);
      continue;
    }
    Corners3 in_volume;
    for (std::size_t i = 0; i < 3; ++i) in_volume[i] = surface.of_volume[triangle[i]];
    added.push_back({triangle, surface_of_made(body.mesh, in_volume, before)});
  }
  Renumbered made = renumbered(cut_mesh, surface.of_volume);
  const std::vector<TetVertexState> states = states_of_all(body);
  MeshDraft draft(body.mesh, {body.particles.position_world_m.front().data(),
                              body.particles.velocity_world_m_per_s.front().data()});
  for (VertexId v = body.mesh.vertex_slots(); v < surface.of_volume.size(); ++v) {
    const TetVertexState& state = states[made.from[v]];
    draft.add_vertex({state.rest_body_m, state.position_world_m, state.velocity_m_per_s});
  }
  const std::vector<TriangleId> removed(gone.begin(), gone.end());
  if (!draft.replace(removed, added)) return false;
  TopologyDelta delta = draft.delta();
  TriangleMesh trial = body.mesh;
  if (apply(delta, trial) != ApplyStatus::applied) return false;  // it would touch itself: later, further on

  Pending pending;
  pending.surface_vertices = static_cast<std::uint32_t>(surface.of_volume.size());
  pending.hash = delta.hash_after;
  std::vector<VertexId> new_id(made.from.size());
  for (VertexId v = 0; v < made.from.size(); ++v) {
    new_id[made.from[v]] = v;
    pending.position_world_m.push_back(padded(states[made.from[v]].position_world_m));
    pending.velocity_m_per_s.push_back(padded(states[made.from[v]].velocity_m_per_s));
  }
  for (auto& [tool, way] : ways)
    for (VertexId& v : way.cut) v = new_id[v];
  pending.ways = std::move(ways);
  pending.mesh = std::move(made.mesh);
  pending_ = std::move(pending);
  plan.seeds = draft.seeds();
  plan.delta = std::move(delta);
  return true;
}

void VolumeCutting::follow(const SharedBody& body, const TopologyChange&) {
  if (!pending_ || body.mesh.hash() != pending_->hash) return;
  engine_.exchange(make_model_(pending_->mesh), pending_->mesh, pending_->surface_vertices,
                   std::move(pending_->position_world_m), std::move(pending_->velocity_m_per_s));
  volume_ = TetTopology(pending_->mesh);
  ways_ = std::move(pending_->ways);
  pending_.reset();
}

}  // namespace sectio
