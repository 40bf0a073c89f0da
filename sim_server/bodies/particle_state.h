// The state of a body's vertices: positions and velocities. The topology is in common/mesh/triangle_mesh.h, masses are
// in the deformation model. One entry a vertex slot; entries of dead slots are stale but finite.
#pragma once

#include <span>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/slot_table.h"

namespace sectio {

// A read-only view of the state.
struct ParticleView {
  std::span<const Vec4f> position_world_m;
  std::span<const Vec4f> velocity_world_m_per_s;

  Vec3 position(std::size_t v) const { return position_world_m[v].head<3>().cast<double>(); }
  Vec3 velocity(std::size_t v) const { return velocity_world_m_per_s[v].head<3>().cast<double>(); }
};

// Entries are 16 bytes {x, y, z, 0}, so that a kernel fetches one with one aligned load. w must stay 0.
struct ParticleState {
  std::vector<Vec4f> position_world_m;
  std::vector<Vec4f> velocity_world_m_per_s;

  std::size_t size() const { return position_world_m.size(); }
  ParticleView view() const { return {position_world_m, velocity_world_m_per_s}; }
  std::size_t bytes() const {
    return (position_world_m.capacity() + velocity_world_m_per_s.capacity()) * sizeof(Vec4f);
  }

  // New entries are at the origin, without velocity, until they are placed.
  void resize(std::size_t vertex_slots) {
    resize_slots<Vec4f>(position_world_m, vertex_slots, Vec4f::Zero());
    resize_slots<Vec4f>(velocity_world_m_per_s, vertex_slots, Vec4f::Zero());
  }

  void place(std::size_t v, const Vec3& at_world_m, const Vec3& velocity_m_per_s = Vec3::Zero()) {
    position_world_m[v] << at_world_m.cast<float>(), 0.0f;
    velocity_world_m_per_s[v] << velocity_m_per_s.cast<float>(), 0.0f;
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
