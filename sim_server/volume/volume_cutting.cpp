#include "sim_server/volume/volume_cutting.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim_server/surface/cutting/surface_point.h"

namespace sectio {
namespace {

constexpr double kSame_m = 1e-9;

// The blade goes through the surface where it did, moved on with it: the nearest of the triangles that it has swept.
void move_on(const MeshDraft& now, const BladeMotion& motion, BladeInTissue& in_tissue) {
  if (motion.path.empty()) return;
  const Blade& blade = motion.path.back();
  const Vec3 before = in_tissue.position_world_m(now);
  const Vec3 at = blade.tip_world_m + (before - blade.tip_world_m).dot(blade.up_world) * blade.up_world;
  in_tissue.blade = blade;
  std::vector<TriangleId> skin;
  for (const TriangleId t : motion.active)
    if (now.triangle(t).alive() && now.triangle(t).surface == Surface::skin) skin.push_back(t);
  const SurfacePoint nearest = nearest_on(now, skin, at);
  if (nearest.triangle == kNone) return;
  in_tissue.v = now.triangle(nearest.triangle).v;
  in_tissue.bary = nearest.bary;
}

// The triangle that the blade touches may have been divided or opened: the point moves to the nearest one in its place.
void find_again(const MeshDraft& after, const TopologyDelta& delta, const Vec3& at_m, BladeInTissue& in_tissue) {
  const auto& [a, b, c] = in_tissue.v;
  if (after.find_triangle(a, b, c) != kNone && (in_tissue.position_world_m(after) - at_m).norm() < kSame_m) return;
  std::vector<TriangleId> skin;
  for (const TriangleEdit& e : delta.triangles)
    if (e.triangle.alive() && e.triangle.surface == Surface::skin) skin.push_back(e.id);
  const SurfacePoint nearest = nearest_on(after, skin, at_m);
  if (nearest.triangle == kNone) return;
  in_tissue.v = after.triangle(nearest.triangle).v;
  in_tissue.bary = nearest.bary;
}

// A blade that is taken out may have come through. A front that could not be made anew for long stays as it is, and the
// way goes on from its end: a sheet from further back would cut off a corner, and leave a crumb there.
void extend(BladeTracks& tracks, const Tissue& tissue, const BladeMotion& motion) {
  tracks.extend(tissue, motion);
  BladeTrack& track = tracks.by_edge[motion.edge_id];
  if (motion.lift) {
    track.next_cut_m = 0;
    track.since_cut_m += tissue.volume.mean_edge_m;
    tracks.finalise_fronts();
  } else if (track.has_front && track.since_cut_m > tissue.metres(tissue.settings.give_up_after_edges)) {
    tracks.finalise_fronts();
    track.restart_from(track.open_to);
  }
}

// The blades of this step, those that leave in it included; all tracks are extended.
std::vector<BladeInTissue> move_blades(const Tissue& tissue, std::vector<BladeInTissue> blades,
                                       std::span<const Entry> entries, std::span<const BladeMotion> motions,
                                       BladeTracks& tracks) {
  const MeshDraft now(tissue.body.mesh, tissue.body.particles.view());
  for (const auto& [edge_id, track] : tracks.by_edge)
    if (std::ranges::find(blades, edge_id, &BladeInTissue::edge_id) == blades.end() && track.has_front)
      tracks.finalise_fronts();
  for (const Entry& e : entries) {
    blades.push_back({e.edge_id, tissue.body.mesh.triangle(e.triangle).v, e.bary, {}});
    tracks.begin(tissue, now, blades.back(), motion_of(motions, e.edge_id));
  }
  for (BladeInTissue& b : blades)
    if (const BladeMotion* motion = motion_of(motions, b.edge_id)) {
      move_on(now, *motion, b);
      extend(tracks, tissue, *motion);
    }
  return blades;
}

}  // namespace

// The state after the plan, and how the volume gets there.
struct VolumeCutting::Ticket final : CutTicket {
  explicit Ticket(State before) : state(std::move(before)) {}

  State state;
  std::optional<VolumeCut> cut;
  std::optional<EdgeCollapse> collapse;
};

VolumeCutting::VolumeCutting(std::shared_ptr<Volume> volume, const FrontSettings& settings, bool has_been_cut)
    : volume_(std::move(volume)), settings_(settings), has_come_apart_(has_been_cut) {
  if (has_been_cut) state_.search.next = 0;
}

CutPlan VolumeCutting::plan(const SharedBody& body, std::span<const Entry> entries,
                            std::span<const BladeMotion> motions) const {
  CutPlan plan;
  const Tissue tissue{*volume_, body, settings_};
  const auto ticket = std::make_shared<Ticket>(state_);
  BladeTracks& tracks = ticket->state.tracks;
  std::vector<BladeAtWork> at_work;
  bool is_due = false;
  std::vector<BladeInTissue>& blades = ticket->state.blades;
  blades = move_blades(tissue, std::move(blades), entries, motions, tracks);
  for (const BladeInTissue& b : blades) {
    const BladeMotion* motion = motion_of(motions, b.edge_id);
    is_due |= motion && (motion->lift || tracks.by_edge[b.edge_id].is_due());
    at_work.push_back({b.edge_id, motion && motion->lift});
  }
  for (const BladeAtWork& a : at_work) {
    if (!a.is_lifted) continue;
    plan.outcomes.push_back({a.edge_id, StrokeEnd::lifted});
    std::erase_if(blades, [&](const BladeInTissue& b) { return b.edge_id == a.edge_id; });
  }
  if (is_due) plan_cut(tissue, at_work, *ticket, plan);
  for (const BladeInTissue& b : blades) plan.going_on.push_back(b.edge_id);
  plan.ticket = ticket;
  return plan;
}

void VolumeCutting::plan_cut(const Tissue& tissue, std::span<const BladeAtWork> at_work, Ticket& ticket,
                             CutPlan& plan) const {
  BladeTracks& tracks = ticket.state.tracks;
  MeshDraft surface(tissue.body.mesh, tissue.body.particles.view());
  std::vector<BladeInTissue>& blades = ticket.state.blades;
  std::vector<Vec3> enters_m;
  enters_m.reserve(blades.size());
  for (const BladeInTissue& b : blades) enters_m.push_back(b.position_world_m(surface));
  VolumeCutPlanner planner(tissue, tracks);
  ticket.cut = planner.plan(at_work, surface);
  if (!ticket.cut) {
    for (const std::uint32_t edge_id : planner.tried()) {
      BladeTrack& track = tracks.by_edge[edge_id];
      track.next_cut_m = track.since_cut_m + tissue.metres(settings_.retry_after_edges);
      if (planner.would_close()) track.go_on_from_front(tissue);
    }
    if (planner.would_close()) tracks.finalise_fronts();
    return;
  }
  tracks = planner.tracks();
  ticket.state.search.next = 0;
  plan.delta = surface.delta();
  plan.seeds = surface.seeds();
  for (std::size_t i = 0; i < blades.size(); ++i) find_again(surface, plan.delta, enters_m[i], blades[i]);
  for (const auto& [edge_id, track] : tracks.by_edge)
    if (track.is_through &&
        std::erase_if(blades, [id = edge_id](const BladeInTissue& b) { return b.edge_id == id; }) > 0)
      plan.outcomes.push_back({edge_id, StrokeEnd::through});
}

std::optional<CutPoint> VolumeCutting::cut_point(const SharedBody& body, std::uint32_t edge_id) const {
  const auto blade = std::ranges::find(state_.blades, edge_id, &BladeInTissue::edge_id);
  if (blade == state_.blades.end()) return std::nullopt;
  CutPoint point;
  point.point_world_m = blade->position_world_m(MeshDraft(body.mesh, body.particles.view()));
  point.near = blade->v[0];
  point.blade = blade->blade;
  return point;
}

double VolumeCutting::uncut_m(const SharedBody& body, const Blade& part, VertexId near) const {
  const BladeTracks& tracks = state_.tracks;
  if (tracks.slit.empty()) return part.length_m;
  const Tissue tissue{*volume_, body, settings_};
  const TissueAround around(tissue, part, Pose{}, {volume_->surface.vertex_of(near)});
  const auto is_tissue = [](const Vec3&) { return true; };
  const BladeEdge edge = around.at_rest(part);
  const auto at = [&](double share) { return edge.at(share); };
  const Slit::Parts parts = tracks.slit.parts(at, tissue.metres(settings_.slit_closed_edges), is_tissue);
  return parts.uncut * (edge.heel_m - edge.tip_m).norm();
}

TidyPlan VolumeCutting::tidy(const SharedBody& body) const {
  const bool may_collapse = settings_.tets.collapse_ratio > 0 && !body.mesh.has_temporary_elements();
  if (!has_front() && (state_.search.is_done() || !may_collapse)) return {};
  TidyPlan plan;
  const auto ticket = std::make_shared<Ticket>(state_);
  ticket->state.tracks.finalise_fronts();
  CollapseSearch& search = ticket->state.search;
  if (may_collapse && !search.is_done())
    ticket->collapse = plan_collapse(*volume_, body, settings_.tets.collapse_ratio, search, plan.delta);
  plan.edges_collapsed = ticket->collapse.has_value();
  if (ticket->collapse) {
    search.has_collapsed = true;
    ticket->state.tracks.forget_vertices([v = ticket->collapse->v](VertexId u) { return u == v; });
  }
  plan.ticket = ticket;
  return plan;
}

void VolumeCutting::accept(const SharedBody& body, const CutTicket& planned) {
  const auto& ticket = static_cast<const Ticket&>(planned);  // only its own come back
  state_ = ticket.state;
  if (ticket.cut) apply_cut(*volume_, body, *ticket.cut, state_.tracks.front.get());
  if (ticket.collapse) collapse(*volume_, body, *ticket.collapse);
}

void VolumeCutting::follow(const SharedBody& body, const TopologyChange& change) {
  std::vector<VertexId> gone;
  for (const VertexEdit& e : change.delta.vertices)
    if (!e.alive) gone.push_back(e.id);
  if (gone.empty()) return;
  remove_component(body, gone);
  std::erase_if(state_.blades, [&](const BladeInTissue& b) {
    return std::ranges::any_of(b.v, [&](VertexId v) { return !body.mesh.vertex_alive(v); });
  });
}

void VolumeCutting::remove_component(const SharedBody& body, std::span<const VertexId> slots) {
  state_.tracks.finalise_fronts();
  const std::vector<std::uint32_t> tetrahedra = volume_->tetrahedra_of(slots);
  double volume_m3 = 0;
  for (const std::uint32_t t : tetrahedra) volume_m3 += volume_->topology.volume_m3(t);
  has_come_apart_ |= volume_m3 > settings_.least_half_cubic_edges * std::pow(volume_->mean_edge_m, 3);
  const TetChange change = volume_->topology.remove(tetrahedra);
  std::vector<VolumeDeformation::Slot> dead;
  for (const VertexId slot : slots) dead.push_back({slot, kNone});
  volume_->surface.accept({{}, {slots.begin(), slots.end()}});
  volume_->deformation.change(body, change, dead);
  state_.tracks.forget_vertices([&](VertexId v) { return !volume_->topology.alive(v); });
}

}  // namespace sectio
