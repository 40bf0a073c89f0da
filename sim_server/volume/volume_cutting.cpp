#include "sim_server/volume/volume_cutting.h"

#include <algorithm>
#include <utility>

namespace sectio {
namespace {

constexpr double kSameM = 1e-9;

// The blade goes through the surface where it did, moved on with it: the nearest of the triangles that it has swept.
void move_on(const MeshDraft& now, const BladeMotion& motion, Stroke& stroke) {
  if (motion.path.empty()) return;
  const Blade& blade = motion.path.back();
  const Vec3 before = position_of(now, stroke);
  const Vec3 at = blade.tip_world_m + (before - blade.tip_world_m).dot(blade.up_world) * blade.up_world;
  stroke.blade = blade;
  stroke.seen.depth_m = (at - blade.tip_world_m).dot(blade.up_world);
  std::vector<TriangleId> skin;
  for (const TriangleId t : motion.active)
    if (now.triangle(t).alive() && now.triangle(t).surface == Surface::skin) skin.push_back(t);
  const SurfacePoint nearest = nearest_on(now, skin, at);
  if (nearest.triangle == kNone) return;
  stroke.touched = now.triangle(nearest.triangle).v;
  stroke.bary = nearest.bary;
}

// The triangle that the blade touches may have been divided or opened: the point moves to the nearest one in its place.
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

// A blade that is taken out may have come through. A front that could not be made anew for long stays as it is.
void extend(BladeTracks& tracks, const Tissue& tissue, const BladeMotion& motion) {
  tracks.extend(tissue, motion);
  BladeTrack& track = tracks.by_edge[motion.edge_id];
  if (motion.lift) {
    track.next_cut_m = 0;
    if (!track.has_front || track.since_cut_m > 0) track.since_cut_m += tissue.volume.mean_edge_m;
    tracks.finalise_fronts();
  } else if (track.since_cut_m > tissue.metres(tissue.settings.give_up_after_edges)) {
    tracks.finalise_fronts();
  }
}

// The strokes of this step, those that end in it included; all tracks are extended.
std::vector<Stroke> move_blades(const Tissue& tissue, std::vector<Stroke> strokes, std::span<const Entry> entries,
                                std::span<const BladeMotion> motions, BladeTracks& tracks) {
  const MeshDraft now(tissue.body.mesh, tissue.body.particles.view());
  for (const auto& [edge_id, track] : tracks.by_edge)
    if (std::ranges::find(strokes, edge_id, &Stroke::edge_id) == strokes.end() && track.has_front)
      tracks.finalise_fronts();
  for (const Entry& e : entries) {
    Stroke s;
    s.edge_id = e.edge_id;
    s.touched = tissue.body.mesh.triangle(e.triangle).v;
    s.bary = e.bary;
    strokes.push_back(s);
    tracks.begin(tissue, now, s, motion_of(motions, e.edge_id));
  }
  for (Stroke& s : strokes)
    if (const BladeMotion* motion = motion_of(motions, s.edge_id)) {
      move_on(now, *motion, s);
      extend(tracks, tissue, *motion);
    }
  return strokes;
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
    : volume_(std::move(volume)), settings_(settings) {
  if (has_been_cut) state_.search.next = 0;
}

CutPlan VolumeCutting::plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
                            std::span<const BladeMotion> motions) const {
  CutPlan plan(cuts);
  const Tissue tissue{*volume_, body, settings_};
  const auto ticket = std::make_shared<Ticket>(state_);
  BladeTracks& tracks = ticket->state.tracks;
  std::vector<BladeAtWork> at_work;
  bool is_due = false;
  for (const Stroke& s : move_blades(tissue, cuts.strokes, entries, motions, tracks)) {
    const BladeMotion* motion = motion_of(motions, s.edge_id);
    is_due |= motion && tracks.by_edge[s.edge_id].is_due();
    at_work.push_back({s.edge_id, motion && motion->lift});
    if (at_work.back().is_lifted)
      plan.outcomes.push_back({s.edge_id, StrokeEnd::lifted});
    else
      plan.strokes.push_back(s);
  }
  if (is_due) plan_cut(tissue, at_work, *ticket, plan);
  plan.ticket = ticket;
  return plan;
}

void VolumeCutting::plan_cut(const Tissue& tissue, std::span<const BladeAtWork> at_work, Ticket& ticket,
                             CutPlan& plan) const {
  BladeTracks& tracks = ticket.state.tracks;
  MeshDraft surface(tissue.body.mesh, tissue.body.particles.view());
  std::vector<Vec3> touched_m;
  for (const Stroke& s : plan.strokes) touched_m.push_back(position_of(surface, s));
  VolumeCutPlanner planner(*volume_, tissue, tracks);
  ticket.cut = planner.plan(at_work, surface);
  if (!ticket.cut) {
    for (const std::uint32_t edge_id : planner.tried()) {
      BladeTrack& track = tracks.by_edge[edge_id];
      track.next_cut_m = track.since_cut_m + tissue.metres(settings_.retry_after_edges);
    }
    return;
  }
  tracks = planner.tracks();
  ticket.state.search.next = 0;
  plan.delta = surface.delta();
  plan.seeds = surface.seeds();
  for (std::size_t i = 0; i < plan.strokes.size(); ++i) find_again(surface, plan.delta, touched_m[i], plan.strokes[i]);
  for (const auto& [edge_id, track] : tracks.by_edge)
    if (track.is_through &&
        std::erase_if(plan.strokes, [id = edge_id](const Stroke& s) { return s.edge_id == id; }) > 0)
      plan.outcomes.push_back({edge_id, StrokeEnd::lifted});
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

void VolumeCutting::follow(const SharedBody&, const TopologyChange& change) {
  std::vector<VertexId> gone;
  for (const VertexEdit& e : change.delta.vertices)
    if (!e.alive) gone.push_back(e.id);
  if (!gone.empty()) remove_component(gone);
}

void VolumeCutting::remove_component(std::span<const VertexId> slots) {
  state_.tracks.finalise_fronts();
  const TetChange change = volume_->topology.remove(volume_->tetrahedra_of(slots));
  std::vector<VolumeDeformation::Slot> dead;
  for (const VertexId slot : slots) dead.push_back({slot, kNone});
  volume_->surface.accept({{}, {slots.begin(), slots.end()}});
  volume_->deformation.change(change, {}, {}, dead);
  state_.tracks.forget_vertices([&](VertexId v) { return !volume_->topology.alive(v); });
}

}  // namespace sectio
