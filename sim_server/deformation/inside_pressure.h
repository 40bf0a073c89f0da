// The pressure inside pieces of a surface that nothing holds. Home springs follow such a piece as it moves, so that the
// pull of its skin alone would shrink it on all sides. Tissue shrinks along its skin and grows thicker:
//
//   p = K (V_0 - V) / V_0,   f_i = p dV/dx_i,   K = E / (3 (1 - 2 nu)), nu at most 0.49
//
// V is the volume inside the piece and V_0 that at rest. The forces of a closed surface have no sum and no moment. p is
// that of the end of the step, if these forces alone act: stable at any step. Deterministic, one thread.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/material/elastic_material.h"
#include "common/mesh/triangle_mesh.h"
#include "sim_server/deformation/rest_frames.h"

namespace sectio {

class InsidePressure {
 public:
  explicit InsidePressure(const ElasticMaterial& material);

  // Call when a piece has come, or topology has changed: the next step looks for the pieces anew. O(triangles).
  void forget_pieces() { are_known_ = false; }
  // Changes the velocities of the pieces' vertices as a step of this length does.
  void push(const TriangleMesh& mesh, const RestFrames& frames, double step_s,
            std::span<const double> inverse_mass_per_kg, std::span<const Vec4f> position_world_m,
            std::span<Vec4f> velocity_m_per_s);
  // K (V_0 - V)^2 / (2 V_0), of all pieces. O(triangles); for tests and reports.
  double energy_j(const TriangleMesh& mesh, const RestFrames& frames, std::span<const Vec4f> position_world_m) const;

 private:
  struct Piece {
    std::vector<std::array<VertexId, 3>> triangles = {};
    std::vector<VertexId> vertices = {};
    double rest_volume_m3 = 0;
  };
  static std::vector<Piece> pieces_of(const TriangleMesh& mesh, const RestFrames& frames);

  double bulk_pa_;
  bool are_known_ = false;
  std::vector<Piece> pieces_;
  std::vector<Vec3> gradient_m2_;  // dV/dx, by vertex slot
};

}  // namespace sectio
