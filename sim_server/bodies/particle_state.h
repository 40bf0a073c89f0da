// The state of a body's particles: positions and velocities. The particles are the vertices of the surface, and in a
// volume the vertices inside, too. Code that knows the surface alone names a particle by a vertex slot. The topology is
// in common/mesh/triangle_mesh.h, masses are in the deformation model. Entries of dead slots are stale but finite.
#pragma once

#include <span>
#include <vector>

#include "common/math/positions_view.h"
#include "common/math/types.h"
#include "common/mesh/slot_table.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

// A read-only view of the state, by vertex slot.
struct ParticleView {
  std::span<const Vec4f> position_world_m;          // by particle
  std::span<const Vec4f> velocity_world_m_per_s;    // by particle
  std::span<const VertexId> particle_of_slot = {};  // see ParticleState

  std::size_t particle_of(std::size_t slot) const { return particle_of_slot.empty() ? slot : particle_of_slot[slot]; }
  Vec3 position(std::size_t slot) const { return position_world_m[particle_of(slot)].head<3>().cast<double>(); }
  Vec3 velocity(std::size_t slot) const { return velocity_world_m_per_s[particle_of(slot)].head<3>().cast<double>(); }
};

// Entries are 16 bytes {x, y, z, w}, so that a kernel fetches one with one aligned load. Nobody reads w: kernels of
// volumes write what they like there, those of surfaces leave it 0.
struct ParticleState {
  std::vector<Vec4f> position_world_m;        // by particle
  std::vector<Vec4f> velocity_world_m_per_s;  // by particle
  // Empty: each slot is the particle of its number. Else the engine of the volume keeps it (bind()); slots in which a
  // surface touches itself are the same particle, and a dead slot is any.
  std::vector<VertexId> particle_of_slot;

  std::size_t size() const { return position_world_m.size(); }
  bool slots_are_particles() const { return particle_of_slot.empty(); }
  ParticleView view() const { return {position_world_m, velocity_world_m_per_s, particle_of_slot}; }
  PositionsView positions() const { return {position_world_m, particle_of_slot}; }  // by vertex slot
  std::size_t bytes() const {
    return (position_world_m.capacity() + velocity_world_m_per_s.capacity()) * sizeof(Vec4f) +
           particle_of_slot.capacity() * sizeof(VertexId);
  }

  // For so many slots of the surface. New particles are at the origin, without velocity, until they are placed.
  void resize(std::size_t vertex_slots) {
    if (slots_are_particles())
      resize_particles(vertex_slots);
    else
      resize_slots<VertexId>(particle_of_slot, vertex_slots, 0);
  }
  void resize_particles(std::size_t count) {
    resize_slots<Vec4f>(position_world_m, count, Vec4f::Zero());
    resize_slots<Vec4f>(velocity_world_m_per_s, count, Vec4f::Zero());
  }
  // kNone: the slot is dead.
  void bind(VertexId slot, VertexId particle) { particle_of_slot[slot] = particle == kNone ? 0 : particle; }

  void place_particle(std::size_t particle, const Vec3& at_world_m, const Vec3& velocity_m_per_s = Vec3::Zero()) {
    position_world_m[particle] << at_world_m.cast<float>(), 0.0f;
    velocity_world_m_per_s[particle] << velocity_m_per_s.cast<float>(), 0.0f;
  }
  void place(std::size_t slot, const Vec3& at_world_m, const Vec3& velocity_m_per_s = Vec3::Zero()) {
    place_particle(view().particle_of(slot), at_world_m, velocity_m_per_s);
  }
  void nudge(std::size_t slot, const Vec3& faster_by_m_per_s, const Vec3& by_m) {
    const std::size_t particle = view().particle_of(slot);
    velocity_world_m_per_s[particle].head<3>() += faster_by_m_per_s.cast<float>();
    position_world_m[particle].head<3>() += by_m.cast<float>();
  }

  template <class A>
  void archive(A& a) {
    a(position_world_m, velocity_world_m_per_s, particle_of_slot);
  }
};

// The rest shape at the given pose, without velocity.
inline ParticleState particles_at_rest(std::span<const Vec3> rest_body_m, const Pose& pose) {
  ParticleState state;
  state.resize(rest_body_m.size());
  for (std::size_t v = 0; v < rest_body_m.size(); ++v) state.place(v, pose.to_world(rest_body_m[v]));
  return state;
}

}  // namespace sectio
