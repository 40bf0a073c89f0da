// A part that has stopped deforming: its vertices follow a rigid body. Its mass is density times the volume at rest.
// Its shape is the one at the moment of release, so that no vertex jumps, and its motion begins with the linear and
// angular momentum of the particles, by their own masses.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/body_contact/rigid_body.h"

namespace sectio {

class RigidPiece {
 public:
  // State and masses: one entry a vertex slot of the mesh. Nothing when the surface encloses no volume, at rest or in
  // its present shape: such a piece has no rigid motion.
  static std::optional<RigidPiece> release(const TriangleMesh& mesh, std::span<const Vec4f> position_world_m,
                                           std::span<const Vec4f> velocity_m_per_s, std::span<const double> mass_kg,
                                           double density_kg_per_m3);

  // Writes positions and velocities of the vertices. Entries as in the constructor.
  void place(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const;
  // Takes a frame at the moment of release to its present pose.
  Pose carried(const Pose& at_release) const;
  double radius_m() const { return radius_m_; }

  RigidBody body;

 private:
  std::vector<Vec3> arm_m_;  // by vertex: place relative to the mass centre, at release
  Vec3 centre_at_release_world_m_ = Vec3::Zero();
  double radius_m_ = 0;
};

}  // namespace sectio
