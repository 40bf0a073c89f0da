// The model tetra_springs: a volume of tetrahedra as springs and dampers (paper C, 3.1). Every edge is a spring, and so
// is every pair of vertices two edges apart (second neighbours), with constants of their own. The integrator is Verlet
// with linear drag, written with the velocity of the half step, v = (x - x_before) / h:
//
//   x_next = x + (1 - alpha h)(x - x_before) + h^2 (f / m + g)
//
// A step in which a particle gets too fast, or whose parts have become too long since mass is added up to a limit only,
// goes to the implicit driver.
//
// Constants follow from Young's modulus: sum k l^2 = 6 E V for a net that is isotropic on average,
//   edges              k = (1 - beta) E sum_t V_t / l^2 over the tetrahedra at the edge
//   second neighbours  k proportional to (m_i / d_i + m_j / d_j) / l^2, together beta 6 E V; d: number at a vertex
// and a virtual tensile test on the mesh itself then corrects all of them by one factor. The same formula makes springs
// stiffer that a cut has shortened. Masses are lumped by volume. Poisson's ratio of a net of springs is at most 1/4;
// the calibration measures it for the report.
#pragma once

#include <array>

#include "sim_server/deformation/implicit_driver.h"
#include "sim_server/deformation/max_tree.h"
#include "sim_server/deformation/spring_energy.h"
#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/spring_star.h"
#include "sim_server/deformation/tetra/tet_body.h"
#include "sim_server/deformation/tetra/tet_spring_net.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

struct TetSpringOptions {
  double second_share = 0.5;  // beta
  double damper_s = 0;        // the constant of a spring's damper over its stiffness
  bool calibrate = true;
  // A part of a body takes over the correction that calibration found for the body. Vertices closer at rest than
  // least_second_m are no second neighbours, since twins at the tip of a cut have no distance. 0: 0.3 of the mean edge.
  double correction = 1;
  double least_second_m = 0;

  template <class A>
  void archive(A& a) {
    a(second_share, damper_s, calibrate, correction, least_second_m);
  }
};

// The result of a virtual tensile test of a net along each axis: uniform stress, linear, small strain.
struct TensileTest {
  std::array<double, 3> young_pa{};
  double mean_young_pa = 0;  // the inverse of the mean compliance
  double mean_poisson = 0;

  template <class A>
  void archive(A& a) {
    a(young_pa, mean_young_pa, mean_poisson);
  }
};

class TetSprings final : public VolumeModel {
 public:
  TetSprings(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
             const TetSpringOptions& options = {});

  // Recomputes springs of touched vertices and, where second neighbours have changed, up to four edges around these.
  void change(const TetChange& change) override;
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints, std::span<Reaction> reactions) override;

  const TetMesh& mesh() const override { return body_.mesh(); }
  double mass_kg(VertexId v) const override { return body_.mass_kg(v); }
  double inverse_mass_per_kg(VertexId v) const override { return body_.inverse_mass()[v]; }
  IntegratorDiagnostics diagnostics() const override {
    IntegratorDiagnostics d;
    d.stability_margin = substep_limit_s() / kSafety * substeps_ / settings_.step_s;
    d.implicit_steps = implicit_steps_;
    d.steps_not_met = driver_.steps_not_met();
    d.residual = was_implicit_ ? driver_.residual() : 0;
    d.residual_m = was_implicit_ ? driver_.residual_m() : 0;
    d.added_mass_fraction = body_.added_mass_fraction();
    return d;
  }
  double largest_stable_step_s() const override { return 1000 * substep_limit_s(); }
  VertexId first_bad_vertex() const override { return first_bad_vertex_; }
  void restore(std::span<const Vec4f>, const Pose&, std::span<Vec4f>, std::span<Vec4f>) override {
    first_bad_vertex_ = kNone;
  }
  void use_stable_driver(int steps) override { stable_for_ = std::max(stable_for_, steps); }
  std::vector<Vec3> sag_m(const Vec3& gravity_body_m_per_s2) override;
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const override {
    return elastic_energy_j(position_world_m) + energy_of_motion_j(position_world_m, velocity_m_per_s);
  }
  // The elastic energy, and the forces that the kernels compute, on fixed vertices, too. O(n); for tests and reports.
  double elastic_energy_j(std::span<const Vec4f> position_world_m) const;
  void elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const;

  struct Spring {
    VertexId a, b;  // a < b
    double stiffness_n_per_m, rest_length_m;
  };
  // Edges, then second neighbours, each ascending. O(n); for tests and reports.
  std::vector<Spring> springs() const;
  std::size_t edge_count() const { return net_.edges(); }
  // The given options, completed with the values that the first mesh determined.
  const TetSpringOptions& options() const { return options_; }
  const TensileTest& as_made() const { return as_made_; }  // before the correction
  const TensileTest& calibrated() const { return calibrated_; }
  int substeps() const { return substeps_; }  // substeps of a step
  // 0.8 of the bound from omega_i^2 = 2 lambda_max(sum_j k_ij n n^T) / m_i at rest.
  double substep_limit_s() const {
    return kSafety * damped_limit_s(omega2_.max(), material_.damping_per_s, options_.damper_s);
  }
  ModelSize size() const override {
    ModelSize size = VolumeModel::size();
    size.parts = substeps_, size.part_limit_s = substep_limit_s();
    return size;
  }
  std::uint64_t clamped() const { return clamped_; }
  void archive(Archive& a) override {
    archive_settings(a);
    a(body_, options_, net_, as_made_, calibrated_, rows_, omega2_, substeps_, driver_, implicit_steps_, stable_for_,
      was_implicit_, clamped_, first_bad_vertex_);
  }
  const SpringRows& rows() const { return rows_; }

 private:
  static constexpr double kSafety = 0.8;  // springs turn, and stretched ones are stiff transversely, too

  // Computes the bounds and added masses of rows, and calls with_springs(v, springs) for each.
  template <class With>
  void weigh_all(std::span<const VertexId> rows, double substep_s, const With& with_springs);
  void weigh(std::span<const VertexId> rows, const FourSymmetric& sum_n_per_m, double substep_s);
  void write(VertexId v, const SpringsAtVertex& springs);
  void write_changed(VertexId v, const SpringsAtVertex& springs);
  void write_mass(VertexId v);
  void divide();
  bool explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);

  TetBody body_;
  TetSpringOptions options_;
  TetSpringNet net_;
  TensileTest as_made_, calibrated_;
  SpringRows rows_;
  MaxTree omega2_;  // by vertex, 1/s^2
  int substeps_ = 1;
  DividedConstraints constraints_;
  std::vector<Vec4f> before_, start_position_, start_velocity_;
  SpringEnergy energy_;
  ImplicitDriver driver_;
  ConstraintSupports corners_;
  std::vector<double> masses_;
  std::uint64_t implicit_steps_ = 0;
  int stable_for_ = 0;
  bool was_implicit_ = false;
  std::uint64_t clamped_ = 0;
  VertexId first_bad_vertex_ = kNone;
  SpringsAtVertex at_;                // scratch
  std::vector<HalfEdge> half_edges_;  // scratch
};

// The virtual tensile test for any springs on a mesh.
TensileTest tensile_test(const TetMesh& mesh, std::span<const TetSprings::Spring> springs);

}  // namespace sectio
