#include "sim_server/volume/volume_cut.h"

#include <algorithm>
#include <set>

namespace sectio {
namespace {

// The components, connected through faces, of the tetrahedra at v, without that of the first tetrahedron.
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

// The area that edits have opened, both sides together: dividing a surface leaves its area as it is.
double opened_m2(const TetTopology& volume, const BoundaryChange& boundary) {
  const auto area_m2 = [&](const std::vector<Corners3>& faces) {
    double sum = 0;
    for (const auto& [a, b, c] : faces) sum += volume.face_m2(a, b, c);
    return sum;
  };
  return area_m2(boundary.added) - area_m2(boundary.removed);
}

}  // namespace

std::optional<VolumeCut> VolumeCutPlanner::plan(std::span<const BladeAtWork> at_work, MeshDraft& surface) {
  draft_.fetch_states_from([this](VertexId v) { return tissue_.state_of(v); });
  VolumeCut cut;
  cut.undone = tracks_.front;
  const TetDelta* front = cut.undone ? &cut.undone->delta : nullptr;
  const double open_m2 = front ? cut.undone->open_m2 : 0;
  FrontRollback rollback(draft_, front);
  BladeCut blades(tissue_, draft_, tracks_);
  const bool opens = blades.run(at_work);
  tried_ = blades.tried();
  lasting_operations_ = blades.lasting_operations();
  if (!opens) return {};
  const double opened_now_m2 = opened_m2(draft_, boundary_change(draft_.change().tetrahedra));
  would_close_ = opened_now_m2 < tissue_.settings.least_kept_area_ratio * open_m2;
  if (would_close_) return {};
  BoundaryChange boundary;
  if (!open_pinched_edges(rollback, cut.change, boundary)) return {};
  std::vector<VertexId> renumbered;
  collect_states(rollback, cut, renumbered);
  auto after = std::make_shared<VolumeFront>();
  const BoundaryChange of_front = boundary_change(draft_.change(lasting_operations_).tetrahedra);
  after->labels = labels_beneath_front(of_front);
  after->open_m2 = opened_m2(draft_, of_front);
  if (!plan_surface(boundary, renumbered, cut, surface)) return {};
  if (front) cut.before = volume_.momentum(tissue_.body, std::span<const TetEdit>(cut.change.tetrahedra));
  after->delta = draft_.take_back(lasting_operations_);
  cut.lasting = draft_.take_back();
  tracks_.front = after->delta.empty() ? nullptr : std::move(after);
  return cut;
}

void apply_cut(Volume& volume, const SharedBody& body, const VolumeCut& cut, const VolumeFront* front) {
  if (cut.undone) apply(inverse(cut.undone->delta), volume.topology);
  apply(cut.lasting, volume.topology);
  if (front) apply(front->delta, volume.topology);
  volume.surface.accept(cut.slots);
  std::vector<VolumeDeformation::Slot> slots;
  for (const VertexId slot : cut.slots.freed) slots.push_back({slot, kNone});
  for (const auto& [slot, v] : cut.slots.taken) slots.push_back({slot, v});
  volume.deformation.change(body, cut.change, slots);
  VertexId v = cut.change.first_added;
  for (const TetVertexState& state : cut.added)
    body.particles.place_particle(v++, state.position_world_m, state.velocity_m_per_s);
  for (const auto& [placed, state] : cut.placed)
    body.particles.place_particle(placed, state.position_world_m, state.velocity_m_per_s);
  volume.conserve_momentum(body, cut.before);
}

// If the two halves of a cut would meet in an edge, both ends at the tip of a cut that is open on either side of it,
// the surface is no manifold: the edge is opened through its middle. False when that does not help.
bool VolumeCutPlanner::open_pinched_edges(const FrontRollback& rollback, TetChange& change, BoundaryChange& boundary) {
  std::vector<VertexId> made;
  for (int round = 0;; ++round) {
    change = rollback.change();
    boundary = boundary_change(change.tetrahedra);
    const auto pinched = volume_.surface.pinched_edges(tissue_.body.mesh, boundary);
    if (pinched.empty()) break;
    if (round == tissue_.settings.pinch_rounds) return false;
    for (const auto& [a, b] : pinched) {
      const VertexId n = draft_.split(a, b, 0.5);
      made.push_back(n);
      for (const auto& component : further_components(draft_, n)) made.push_back(draft_.part(n, component));
    }
  }
  const bool has_front = std::ranges::any_of(tracks_.by_edge, [](const auto& track) { return track.second.has_front; });
  if (!has_front) lasting_operations_ = draft_.mark();
  for (auto& [edge_id, track] : tracks_.by_edge) {
    if (track.since_cut_m == 0 && track.has_front)
      track.front_vertices.insert(track.front_vertices.end(), made.begin(), made.end());
  }
  if (!has_front) tracks_.slit.add_vertices(made);
  return true;
}

// `renumbered`: vertices of the old front whose numbers are used again, elsewhere at rest.
void VolumeCutPlanner::collect_states(FrontRollback& rollback, VolumeCut& cut, std::vector<VertexId>& renumbered) {
  if (volume_.deformation.model().asks_for_origins()) rollback.find_origins(cut.change);
  const VertexId first_made = cut.change.first_added;
  for (const VertexId v : rollback.give_states())
    if (v < first_made) cut.placed.emplace_back(v, draft_.vertex(v));
  const auto& rest_body_m = volume_.deformation.model().mesh().vertices_body_m;
  for (VertexId v = first_made; v < draft_.vertex_count(); ++v) {
    const TetVertexState& state = draft_.vertex(v);
    cut.added.push_back(state);
    cut.change.fixed.push_back(volume_.is_fixed_at(state.rest_body_m));
    if (v < rest_body_m.size() && rest_body_m[v] != state.rest_body_m) renumbered.push_back(v);
  }
}

SurfaceLabels VolumeCutPlanner::labels_beneath_front(const BoundaryChange& of_front) const {
  SurfaceLabels labels;
  for (Corners3 corners : of_front.removed) {
    const Surface label = label_of(corners);
    std::ranges::sort(corners);
    labels[corners] = label;
  }
  return labels;
}

bool VolumeCutPlanner::plan_surface(const BoundaryChange& boundary, std::span<const VertexId> renumbered,
                                    VolumeCut& cut, MeshDraft& surface) const {
  const auto state = [&](VertexId v) {
    const TetVertexState& s = draft_.vertex(v);
    return VertexState{s.rest_body_m, s.position_world_m, s.velocity_m_per_s};
  };
  const auto label = [&](const Corners3& corners) { return label_of(corners); };
  return volume_.surface.plan(tissue_.body.mesh, boundary, renumbered, state, label, surface, cut.slots);
}

// A triangle that lies in one of the surface before has its label; the others are walls of the cut.
Surface VolumeCutPlanner::label_of(const Corners3& corners) const {
  const TriangleMesh& mesh = tissue_.body.mesh;
  std::set<VertexId> from(corners.begin(), corners.end());
  while (const auto edge = draft_.made_from(*from.rbegin())) {  // the ends of an edge are older
    from.erase(std::prev(from.end()));
    from.insert(edge->begin(), edge->end());
  }
  const std::vector<VertexId> origins(from.begin(), from.end());
  if (origins.size() != 3) return Surface::wall;
  if (front_labels_)
    if (const auto of = front_labels_->find({origins[0], origins[1], origins[2]}); of != front_labels_->end())
      return of->second;
  for (const Corners3& key : {Corners3{origins[0], origins[1], origins[2]}, {origins[0], origins[2], origins[1]}})
    if (const TriangleId t = volume_.surface.triangle_of(mesh, key); t != kNone) return mesh.triangle(t).surface;
  return Surface::wall;
}

}  // namespace sectio
