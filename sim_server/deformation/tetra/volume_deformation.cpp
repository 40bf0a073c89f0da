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

constexpr double kLayer = 1.0 / 12;     // share of the elements' size: balls on blocks of all sizes need it
constexpr double kFloorReach_m = 1e-4;  // vertices higher up, and slow, are stopped after a step if need be

}  // namespace

VolumeDeformation::VolumeDeformation(std::unique_ptr<VolumeModel> model, std::vector<VertexId> vertex_of,
                                     const Pose& body, std::optional<VolumeFloor> floor, ParticleState& particles)
    : model_(std::move(model)), vertex_of_(std::move(vertex_of)), floor_(floor), frame_(body), first_frame_(body) {
  const std::vector<Vec3>& rest = model_->mesh().vertices_body_m;
  particles = particles_at_rest(rest, body);
  particles.particle_of_slot.assign(vertex_of_.size(), 0);
  for (VertexId slot = 0; slot < vertex_of_.size(); ++slot) particles.bind(slot, vertex_of_[slot]);
  for (VertexId v = 0; v < rest.size(); ++v) anchors_ += is_anchor(v);
  layer_m_ = kLayer * (model_->cell_m() > 0 ? model_->cell_m() : edge_of_mean_m(model_->mesh()));
  give_room(particles.position_world_m, particles.velocity_world_m_per_s, particles.particle_of_slot, vertex_of_);
}

void VolumeDeformation::change(const SharedBody& body, const TetChange& change, std::span<const Slot> slots) {
  ParticleState& particles = body.particles;
  touched_.begin(std::max(particles.size(), change.first_added + change.added_body_m.size()));
  for (const TetEdit& e : change.tetrahedra)
    for (const Tetrahedron& t : {e.before, e.after})
      for (const VertexId v : t)
        if (v != kNone) touched_.insert(v);
  for (const VertexId v : touched_.list()) anchors_ -= v < particles.size() && is_anchor(v);
  model_->change(change);
  particles.resize_particles(model_->mesh().vertices_body_m.size());
  for (const VertexId v : touched_.list()) {
    anchors_ += is_anchor(v);
    if (!is_there(v)) particles.velocity_world_m_per_s[v].setZero();
  }
  for (const Slot& slot : slots) {
    if (slot.slot >= vertex_of_.size()) resize_slots(vertex_of_, slot.slot + 1, kNone);
    vertex_of_[slot.slot] = slot.vertex;
    particles.bind(slot.slot, slot.vertex);
  }
}

void VolumeDeformation::step(const SharedBody& body, std::span<const PointConstraint> constraints,
                             std::span<Reaction> reactions) {
  SECTIO_ASSERT(body.mesh.vertex_slots() == vertex_of_.size(), "the surface is that of the volume");
  ParticleState& particles = body.particles;
  constraints_.assign(constraints.begin(), constraints.end());
  for (PointConstraint& c : constraints_)
    for (VertexId& v : c.v)
      if (v != kNone) v = vertex_of_[v];
  if (floor_) stand_on_floor(particles);
  reactions_.assign(constraints_.size(), {});
  model_->step(particles.position_world_m, particles.velocity_world_m_per_s, constraints_, reactions_);
  std::ranges::copy(std::span(reactions_).first(reactions.size()), reactions.begin());
  if (floor_) stop_at_floor(particles, reactions.size());
  if (anchors_ > 0) return;
  matched_.clear();
  for (VertexId v = 0; v < particles.size(); ++v)
    matched_.push_back({model_->mesh().vertices_body_m[v], particles.position_world_m[v].head<3>().cast<double>(),
                        model_->mass_kg(v)});
  frame_ = match_shape(matched_, frame_);
}

void VolumeDeformation::save(DeformationState& state) const {
  model_->save(state.inside_world_m);
  state.frames_world.assign(1, frame_);
}

void VolumeDeformation::restore(const SharedBody& body, const DeformationState* state) {
  ParticleState& particles = body.particles;
  std::span<const Vec4f> nodes;
  if (state) {
    nodes = state->inside_world_m;
    frame_ = state->frames_world.front();
  } else {
    if (!is_finite(frame_)) frame_ = first_frame_;
    for (VertexId v = 0; v < particles.size(); ++v)
      particles.place_particle(v, frame_.to_world(model_->mesh().vertices_body_m[v]));
  }
  std::ranges::fill(particles.velocity_world_m_per_s, Vec4f::Zero());
  model_->restore(nodes, frame_, particles.position_world_m, particles.velocity_world_m_per_s);
}

double VolumeDeformation::energy_j(const SharedBody& body) const {
  return model_->energy_j(body.particles.position_world_m, body.particles.velocity_world_m_per_s);
}

Pose VolumeDeformation::rest_frame_world(VertexId) const {
  return frame_;
}

// Makes the floor a constraint within the step, of all that may come to it: a vertex falls g h^2 - h v in an implicit
// step h, and less in an explicit one. If vertices were only put back after the step, the floor would carry their own
// weight, but not the pressure of the tissue above.
void VolumeDeformation::stand_on_floor(const ParticleState& particles) {
  const std::span<const Vec4f> at_world_m = particles.position_world_m;
  const double step_s = model_->step_s(), from_rest_m = model_->gravity_m_per_s2().norm() * step_s * step_s;
  for (VertexId v = 0; v < at_world_m.size(); ++v) {
    const double above_m = double{at_world_m[v].z()} - floor_->z_m;
    const double falls_m = from_rest_m - step_s * double{particles.velocity_world_m_per_s[v].z()};
    if (above_m > std::max(kFloorReach_m, falls_m) || model_->inverse_mass_per_kg(v) == 0) continue;
    PointConstraint stand = hold(v, {at_world_m[v].x(), at_world_m[v].y(), floor_->z_m});
    stand.unilateral = true;
    stand.sticks = floor_->kept_velocity == 0;  // a speed that is taken away after a step leaves its way: tissue creeps
    stand.normal = -Vec3::UnitZ();
    constraints_.push_back(stand);
  }
}

void VolumeDeformation::stop_at_floor(ParticleState& particles, std::size_t first) {
  const std::span<Vec4f> at_world_m = particles.position_world_m, speed_m_per_s = particles.velocity_world_m_per_s;
  const auto z = static_cast<float>(floor_->z_m), kept = static_cast<float>(floor_->kept_velocity);
  for (std::size_t n = first; n < constraints_.size(); ++n)
    if (reactions_[n].active) speed_m_per_s[constraints_[n].v[0]].head<2>() *= kept;
  for (VertexId v = 0; v < at_world_m.size(); ++v) {
    if (at_world_m[v].z() >= z || model_->inverse_mass_per_kg(v) == 0) continue;
    at_world_m[v].z() = z;
    speed_m_per_s[v].head<2>() *= kept;
    speed_m_per_s[v].z() = 0;
  }
}

}  // namespace sectio
