#include "sim_server/body_contact/rigid_piece.h"

#include <Eigen/LU>
#include <algorithm>

#include "sim_server/body_contact/mass_properties.h"

namespace sectio {

std::optional<RigidPiece> RigidPiece::release(const TriangleMesh& mesh, std::span<const Vec4f> position_world_m,
                                              std::span<const Vec4f> velocity_m_per_s, std::span<const double> mass_kg,
                                              double density_kg_per_m3) {
  std::vector<Vec3> now;
  std::vector<MovingPoint> points;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    now.push_back(position_world_m[v].head<3>().cast<double>());
    if (mesh.vertex_alive(v)) points.push_back({now[v], velocity_m_per_s[v].head<3>().cast<double>(), mass_kg[v]});
  }
  const double mass = mass_properties(mesh.rest_body_m(), mesh.triangles(), density_kg_per_m3).mass_kg;
  const MassProperties shape = mass_properties(now, mesh.triangles(), 1);
  if (!(mass > 0) || !(shape.mass_kg > 0) || !(shape.inertia_kg_m2.determinant() > 0)) return std::nullopt;

  RigidPiece piece;
  piece.body = RigidBody(mass, mass / shape.mass_kg * shape.inertia_kg_m2, shape.centre_m);
  piece.centre_at_release_world_m_ = shape.centre_m;
  const RigidVelocity motion = rigid_velocity(points);
  piece.body.set_velocity(motion.at(shape.centre_m), motion.angular_velocity_rad_per_s);
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    piece.arm_m_.push_back(now[v] - shape.centre_m);
    if (mesh.vertex_alive(v)) piece.radius_m_ = std::max(piece.radius_m_, piece.arm_m_[v].norm());
  }
  return piece;
}

void RigidPiece::place(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const {
  const Vec3 velocity = body.velocity_m_per_s(), spin = body.angular_velocity_rad_per_s();
  const Mat3 turn = body.pose_world().orientation.toRotationMatrix();
  for (std::size_t v = 0; v < arm_m_.size(); ++v) {
    const Vec3 arm = turn * arm_m_[v];
    position_world_m[v].head<3>() = (body.pose_world().position_m + arm).cast<float>();
    velocity_m_per_s[v].head<3>() = (velocity + spin.cross(arm)).cast<float>();
  }
}

Pose RigidPiece::carried(const Pose& at_release) const {
  const Pose& now = body.pose_world();
  return {now.to_world(at_release.position_m - centre_at_release_world_m_), now.orientation * at_release.orientation};
}

}  // namespace sectio
