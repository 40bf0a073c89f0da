// Model M2: a volume of tetrahedra as springs and dampers (paper C, 3.1): every edge is a spring, and so is every pair
// of vertices two edges apart (second neighbours), with constants of their own. Verlet with linear drag, written with
// the velocity of the half step, v = (x - x_before) / h:
//
//   x_next = x + (1 - alpha h)(x - x_before) + h^2 (f / m + g)
//
// Constants come from Young's modulus (methods 2.4): sum k l^2 = 6 E V for a net that is isotropic on average,
//   edges              k = (1 - beta) E sum_t V_t / l^2 over the tetrahedra at the edge
//   second neighbours  k proportional to (m_i / d_i + m_j / d_j) / l^2, together beta 6 E V; d: how many a vertex has
// and a virtual tensile test on the mesh itself then corrects all of them by one factor. Springs that a cut has made
// shorter are stiffer by the same formula. Masses go by volume. A net of springs has a Poisson's ratio of at most 1/4:
// what it has is in the calibration, for the report.
#pragma once

#include <array>

#include "sim_server/deformation/max_tree.h"
#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/spring_star.h"
#include "sim_server/deformation/tetra/tet_body.h"
#include "sim_server/deformation/tetra/tet_spring_net.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

struct TetSpringOptions {
  double second_share = 0.5;  // beta
  double damper_s = 0;        // constant of a spring's damper over its stiffness
  bool calibrate = true;
  // Of what calibration finds for the body that a part comes from; and vertices closer than that at rest are no second
  // neighbours: twins at the tip of a cut have no length. 0: 0.3 of the mean length of the edges.
  double correction = 1;
  double least_second_m = 0;
};

// Of the net as the formula makes it, by a virtual tensile test along each axis: uniform stress, linear, small strain.
struct TensileTest {
  std::array<double, 3> young_pa{};
  double mean_young_pa = 0;  // of the compliances' mean
  double mean_poisson = 0;
};

class TetSprings final : public VolumeModel {
 public:
  TetSprings(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
             const TetSpringOptions& options = {});

  // Springs of touched vertices and, where a second neighbour came or went, as far as four edges around them.
  void change(const TetChange& change) override;
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints, std::span<Reaction> reactions) override;

  const TetMesh& mesh() const override { return body_.mesh(); }
  double mass_kg(VertexId v) const override { return body_.mass_kg(v); }
  double inverse_mass_per_kg(VertexId v) const override { return body_.inverse_mass()[v]; }
  double added_mass_fraction() const override { return body_.added_mass_fraction(); }
  double largest_stable_step_s() const override { return 1000 * part_limit_s(); }
  VertexId first_bad_vertex() const override { return first_bad_vertex_; }
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const override {
    return elastic_energy_j(position_world_m) + energy_of_motion_j(position_world_m, velocity_m_per_s);
  }
  // For tests and reports, O(n): the elastic energy, and the forces that the kernels compute, fixed vertices included.
  double elastic_energy_j(std::span<const Vec4f> position_world_m) const;
  void elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const;

  struct Spring {
    VertexId a, b;  // a < b
    double stiffness_n_per_m, rest_length_m;
  };
  // Edges, then second neighbours; each ascending. O(n), for tests and reports.
  std::vector<Spring> springs() const;
  std::size_t edge_count() const { return net_.edges(); }
  // As given, with what the first mesh made of them.
  const TetSpringOptions& options() const { return options_; }
  const TensileTest& as_made() const { return as_made_; }  // before the correction
  const TensileTest& calibrated() const { return calibrated_; }
  int parts() const { return parts_; }  // of a step
  double margin() const override { return part_limit_s() / kSafety * parts_ / settings_.step_s; }
  // 0.8 of the bound from omega_i^2 = 2 lambda_max(sum_j k_ij n n^T) / m_i at rest.
  double part_limit_s() const {
    return kSafety * damped_limit_s(omega2_.max(), material_.damping_per_s, options_.damper_s);
  }
  std::uint64_t clamped() const { return clamped_; }
  const SpringRows& rows() const { return rows_; }

 private:
  static constexpr double kSafety = 0.8;  // directions change and stretched springs are stiff across, too

  // Bounds and masses of rows; each with its springs goes to with_springs(v, springs) on the way.
  template <class With>
  void weigh_all(std::span<const VertexId> rows, double part_s, const With& with_springs);
  void weigh(std::span<const VertexId> rows, const FourSymmetric& sum_n_per_m, double part_s);
  void write(VertexId v, const SpringsAtVertex& springs);
  void write_changed(VertexId v, const SpringsAtVertex& springs);
  void write_mass(VertexId v);

  TetBody body_;
  TetSpringOptions options_;
  TetSpringNet net_;
  TensileTest as_made_, calibrated_;
  SpringRows rows_;
  MaxTree omega2_;  // by vertex, 1/s^2
  int parts_ = 1;
  DividedConstraints constraints_;
  std::vector<Vec4f> before_;
  std::uint64_t clamped_ = 0;
  VertexId first_bad_vertex_ = kNone;
  SpringsAtVertex at_;                // scratch
  std::vector<HalfEdge> half_edges_;  // scratch
};

// The tensile test, for any springs on a mesh.
TensileTest tensile_test(const TetMesh& mesh, std::span<const TetSprings::Spring> springs);

}  // namespace sectio
