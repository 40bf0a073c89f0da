// A part that has stopped deforming: its vertices follow a rigid body. Mass is density times the volume at rest; the
// shape is the one at the moment of release, so that nothing jumps; the motion begins with the linear and the angular
// momentum that the particles had, by their own masses.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/body_contact/rigid_body.h"

namespace sectio {

class RigidPiece {
 public:
  // State and masses: one entry a vertex slot of the mesh. Nothing when the surface encloses no volume, at rest or as
  // it is now: such a piece has no rigid motion.
  static std::optional<RigidPiece> release(const TriangleMesh& mesh, std::span<const Vec4f> position_world_m,
                                           std::span<const Vec4f> velocity_m_per_s, std::span<const double> mass_kg,
                                           double density_kg_per_m3);

  // Where the vertices are and how fast they move, as the body has them. Entries as in the constructor.
  void place(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const;
  // Where that motion has taken a frame that the piece had when it was released.
  Pose carried(const Pose& at_release) const;
  double radius_m() const { return radius_m_; }

  RigidBody body;

 private:
  std::vector<Vec3> arm_m_;  // of each vertex from the mass centre, at release
  Vec3 centre_at_release_world_m_ = Vec3::Zero();
  double radius_m_ = 0;
};

}  // namespace sectio
