#include "sim_server/deformation/tetra/volume_deformation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/error.h"
#include "common/mesh/slot_table.h"

namespace sectio {
namespace {

// The edge of the regular tetrahedron whose volume is the mean.
double edge_of_mean_m(const TetMesh& mesh) {
  double volume_m3 = 0;
  std::size_t count = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    if (t[0] != kNone) volume_m3 += tet_volume_m3(mesh, t), ++count;
  return count == 0 ? 0 : std::cbrt(6 * std::sqrt(2.0) * volume_m3 / static_cast<double>(count));
}

constexpr double kLayer = 1.0 / 12;     // of the size of the elements: balls on blocks of all sizes need it
constexpr double kFloorReach_m = 1e-4;  // vertices higher up are stopped after the step in which they fall through

}  // namespace

VolumeDeformation::VolumeDeformation(std::unique_ptr<VolumeModel> model, std::vector<VertexId> vertex_of,
                                     const Pose& body, std::optional<VolumeFloor> floor)
    : model_(std::move(model)), floor_(floor), frame_(body), first_frame_(body) {
  const std::vector<Vec3>& rest = model_->mesh().vertices_body_m;
  position_.assign(rest.size(), Vec4f::Zero());
  velocity_.assign(rest.size(), Vec4f::Zero());
  slots_of_.assign(rest.size(), 0);
  for (VertexId slot = 0; slot < vertex_of.size(); ++slot) rebind({slot, vertex_of[slot]});
  for (VertexId v = 0; v < rest.size(); ++v) {
    position_[v].head<3>() = body.to_world(rest[v]).cast<float>();
    anchors_ += is_anchor(v);
  }
  layer_m_ = kLayer * (model_->cell_m() > 0 ? model_->cell_m() : edge_of_mean_m(model_->mesh()));
  give_room(position_, velocity_, slots_of_, vertex_of_);
}

void VolumeDeformation::set_state(std::vector<Vec4f> position_world_m, std::vector<Vec4f> velocity_m_per_s) {
  SECTIO_ASSERT(position_world_m.size() == position_.size(), "all vertices have a state");
  position_ = std::move(position_world_m);
  velocity_ = std::move(velocity_m_per_s);
}

void VolumeDeformation::change(const TetChange& change, std::span<const Vec4f> added_position_world_m,
                               std::span<const Vec4f> added_velocity_m_per_s, std::span<const Slot> slots) {
  const auto first_added = static_cast<std::ptrdiff_t>(change.first_added);
  touched_.begin(std::max(position_.size(), change.first_added + change.added_body_m.size()));
  for (const TetEdit& e : change.tetrahedra)
    for (const Tetrahedron& t : {e.before, e.after})
      for (const VertexId v : t)
        if (v != kNone) touched_.insert(v);
  for (const VertexId v : touched_.list()) anchors_ -= v < position_.size() && is_anchor(v);
  model_->change(change);
  for (auto [table, added] : {std::pair{&position_, added_position_world_m}, {&velocity_, added_velocity_m_per_s}}) {
    resize_slots<Vec4f>(*table, model_->mesh().vertices_body_m.size(), Vec4f::Zero());
    std::ranges::copy(added, table->begin() + first_added);
  }
  for (const VertexId v : touched_.list()) {
    anchors_ += is_anchor(v);
    if (!is_there(v)) velocity_[v].setZero();
  }
  resize_slots<std::uint8_t>(slots_of_, position_.size(), 0);
  for (const Slot& slot : slots) rebind(slot);
}

void VolumeDeformation::rebind(const Slot& slot) {
  if (slot.slot >= vertex_of_.size()) resize_slots(vertex_of_, slot.slot + 1, kNone);
  VertexId& vertex = vertex_of_[slot.slot];
  if (vertex != kNone) --slots_of_[vertex];
  std::erase(shared_slots_, slot.slot);
  vertex = slot.vertex;
  if (vertex != kNone && slots_of_[vertex]++ > 0)
    shared_slots_.insert(std::ranges::lower_bound(shared_slots_, slot.slot), slot.slot);
}

// If two slots share a vertex, the one that has changed since the last step counts.
void VolumeDeformation::read_surface_state(const ParticleState& outside) {
  std::vector<VertexId> moved;
  for (const VertexId slot : shared_slots_) {
    const VertexId v = vertex_of_[slot];
    if (v != kNone && (outside.position_world_m[slot].head<3>() != position_[v].head<3>() ||
                       outside.velocity_world_m_per_s[slot].head<3>() != velocity_[v].head<3>()))
      moved.push_back(slot);
  }
  const auto take = [&](VertexId slot) {
    const VertexId v = vertex_of_[slot];
    if (v == kNone) return;
    position_[v].head<3>() = outside.position_world_m[slot].head<3>();
    velocity_[v].head<3>() = outside.velocity_world_m_per_s[slot].head<3>();
  };
  std::size_t shared = 0;
  for (VertexId slot = 0; slot < vertex_of_.size(); ++slot) {
    if (shared < shared_slots_.size() && shared_slots_[shared] == slot)
      ++shared;
    else
      take(slot);
  }
  for (const VertexId slot : moved) take(slot);
}

void VolumeDeformation::step(const SharedBody& body, std::span<const PointConstraint> constraints,
                             std::span<Reaction> reactions) {
  SECTIO_ASSERT(body.mesh.vertex_slots() == vertex_of_.size(), "the surface is that of the volume");
  ParticleState& outside = body.particles;
  read_surface_state(outside);
  constraints_.assign(constraints.begin(), constraints.end());
  for (PointConstraint& c : constraints_)
    for (VertexId& v : c.v)
      if (v != kNone) v = vertex_of_[v];
  if (floor_) stand_on_floor();
  reactions_.assign(constraints_.size(), {});
  model_->step(position_, velocity_, constraints_, reactions_);
  std::ranges::copy(std::span(reactions_).first(reactions.size()), reactions.begin());
  if (floor_) stop_at_floor(reactions.size());
  for (VertexId slot = 0; slot < vertex_of_.size(); ++slot) {
    if (vertex_of_[slot] == kNone) continue;
    outside.position_world_m[slot].head<3>() = position_[vertex_of_[slot]].head<3>();
    outside.velocity_world_m_per_s[slot].head<3>() = velocity_[vertex_of_[slot]].head<3>();
  }
  if (anchors_ > 0) return;
  matched_.clear();
  for (VertexId v = 0; v < position_.size(); ++v)
    matched_.push_back({model_->mesh().vertices_body_m[v], position_[v].head<3>().cast<double>(), model_->mass_kg(v)});
  frame_ = match_shape(matched_, frame_);
}

// The inside is that of all vertices, then that of the model.
void VolumeDeformation::save(DeformationState& state) const {
  model_->save(state.inside_world_m);
  state.inside_world_m.insert(state.inside_world_m.begin(), position_.begin(), position_.end());
  state.frames_world.assign(1, frame_);
}

void VolumeDeformation::restore(const SharedBody&, const DeformationState* state) {
  std::span<const Vec4f> nodes;
  if (state) {
    SECTIO_ASSERT(state->inside_world_m.size() >= position_.size(), "the state is of this topology");
    const std::span<const Vec4f> all = state->inside_world_m;
    std::ranges::copy(all.first(position_.size()), position_.begin());
    nodes = all.subspan(position_.size());
    frame_ = state->frames_world.front();
  } else {
    if (!is_finite(frame_)) frame_ = first_frame_;
    for (VertexId v = 0; v < position_.size(); ++v)
      position_[v].head<3>() = frame_.to_world(model_->mesh().vertices_body_m[v]).cast<float>();
  }
  std::ranges::fill(velocity_, Vec4f::Zero());
  model_->restore(nodes, frame_, position_, velocity_);
}

double VolumeDeformation::energy_j(const SharedBody& body) const {
  std::vector<Vec4f> x = position_, v = velocity_;
  for (VertexId slot = 0; slot < vertex_of_.size(); ++slot) {
    if (vertex_of_[slot] == kNone) continue;
    x[vertex_of_[slot]] = body.particles.position_world_m[slot];
    v[vertex_of_[slot]] = body.particles.velocity_world_m_per_s[slot];
  }
  return model_->energy_j(x, v);
}

Pose VolumeDeformation::rest_frame_world(VertexId) const {
  return frame_;
}

// Makes the floor a constraint within the step. If vertices were only put back after the step, the floor would carry
// their own weight, but not the pressure of the tissue above.
void VolumeDeformation::stand_on_floor() {
  for (VertexId v = 0; v < position_.size(); ++v) {
    const double above_m = double{position_[v].z()} - floor_->z_m;
    if (above_m > kFloorReach_m || model_->inverse_mass_per_kg(v) == 0) continue;
    PointConstraint stand = hold(v, {position_[v].x(), position_[v].y(), floor_->z_m});
    stand.unilateral = true;
    stand.normal = -Vec3::UnitZ();
    constraints_.push_back(stand);
  }
}

void VolumeDeformation::stop_at_floor(std::size_t first) {
  const auto z = static_cast<float>(floor_->z_m), kept = static_cast<float>(floor_->kept_velocity);
  for (std::size_t n = first; n < constraints_.size(); ++n)
    if (reactions_[n].active) velocity_[constraints_[n].v[0]].head<2>() *= kept;
  for (VertexId v = 0; v < position_.size(); ++v) {
    if (position_[v].z() >= z || model_->inverse_mass_per_kg(v) == 0) continue;
    position_[v].z() = z;
    velocity_[v].head<2>() *= kept;
    velocity_[v].z() = 0;
  }
}

}  // namespace sectio
