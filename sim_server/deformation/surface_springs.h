// The model surface_springs: a surface of masses and springs with home springs (paper B, 2.1). Every edge is a spring,
// and every vertex has a home spring to its place in the rigid rest shape. Damping is proportional to velocity; the
// integrator is symplectic Euler at a fixed step.
//
//   m_i a_i = sum_j k_ij (1 - l0_ij / l)(x_j - x_i) + k_h,i (R h_i + t - x_i) - alpha m_i v_i + m_i g + external
//
// All constants follow from elasticity:
//   k_ij   membrane of thickness t_skin, see gather_star()
//   k_h,i  K_w A_i, K_w = 2 E* / (pi a_ref), E* = E / (1 - nu^2): the stiffness of a half-space under a flat punch of
//          radius a_ref (Winkler's bed), A_i a third of the area of the triangles around i, at rest
//   m_i    rho A_i a_ref: the tissue that moves with the surface is about as deep as the punch is wide, which is the
//          depth in which the displacement of a half-space decays
// The shape that is given is at rest until it is cut: where the skin is whole, a vertex's home is lifted off its place
// by the inward part of the pull of its springs over k_h. The lips of a cut have no such counterweight, and gape. (The
// part along the skin averages out from vertex to vertex; at the small triangles around a cut it pulls away from the
// cut, and to take it from them would close the cut by a fifth.) The homes of anchored tissue are also lifted by the
// weight m g / k_h in the gravity in which the body was given; when gravity turns, the tissue follows the difference.
// A piece that falls or turns carries no weight on its home springs, and the frame of its homes follows it: none of its
// springs can push it as a whole. The pressure inside it keeps its volume (inside_pressure.h); the overload of step()
// without a body has no triangles and leaves it out.
//
// The step is divided into as many equal parts as the surface needs at rest, and these in two or four when cuts need
// much added mass; the implicit driver takes the steps when they need more than a body may have, or when a vertex that
// nothing holds is too fast again and again.
//
// Components: (R, t) is the body's pose for an anchored component and found by shape matching for a free one.
// Deterministic, one thread; an explicit step does not allocate.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/material/elastic_material.h"
#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"
#include "sim_server/deformation/cut_damping.h"
#include "sim_server/deformation/deformation_engine.h"
#include "sim_server/deformation/divided_constraints.h"
#include "sim_server/deformation/implicit_driver.h"
#include "sim_server/deformation/inside_pressure.h"
#include "sim_server/deformation/max_tree.h"
#include "sim_server/deformation/rest_frames.h"
#include "sim_server/deformation/spring_energy.h"
#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/spring_rows.h"
#include "sim_server/deformation/spring_star.h"

namespace sectio {

struct SurfaceSpringMaterial : ElasticMaterial {
  double skin_thickness_m = 0.002;
  double foundation_radius_m = 0.008;  // a_ref
  double pretension = 0.06;
  double damping_per_s = 25;
  bool home_springs = true;  // without them the body has no inside: a control for tests
};

struct SurfaceSpringSettings {
  double step_s = 0.001;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::optional<Vec3> given_gravity_m_per_s2 = {};  // gravity in which the shape was given; empty: the one above
  // Vertices whose rest place it accepts never move; empty: none.
  std::function<bool(const Vec3& rest_world_m)> fixed = {};
  // The stiffness factor of the tissue at a rest point; empty: 1. A home spring stands for the column of tissue beneath
  // its vertex, a_ref deep; sections of the column with different factors act as springs in series.
  std::function<double(const Vec3& rest_body_m)> stiffness_factor = {};
  // False: neither parts at rest nor the implicit driver, to measure the limit of one explicit step.
  bool adapts = true;
};

class SurfaceSprings final : public DeformationEngine {
 public:
  static constexpr int kMostParts = 32;  // a step is divided into at most so many, at rest

  // All vertices form component 0, which is anchored. Accepts any step; the caller compares largest_stable_step_s(),
  // which is that of at most kMostParts parts.
  SurfaceSprings(const TriangleMesh& mesh, const Pose& body, const SurfaceSpringMaterial& material,
                 const SurfaceSpringSettings& settings);

  // Positions and velocities {x, y, z, 0}, one a vertex slot of the mesh. reactions: empty, or one a constraint.
  void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
            std::span<const PointConstraint> constraints = {}, std::span<Reaction> reactions = {});
  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    inside_.push(body.mesh, frames_, settings_.step_s, inverse_mass_, body.particles.position_world_m,
                 body.particles.velocity_world_m_per_s);
    step(body.particles.position_world_m, body.particles.velocity_world_m_per_s, constraints, reactions);
  }

  const Vec3& given_gravity_m_per_s2() const { return *settings_.given_gravity_m_per_s2; }
  void set_gravity(const Vec3& gravity_m_per_s2) override { settings_.gravity_m_per_s2 = gravity_m_per_s2; }

  // Call after a change of topology: recomputes the rows of `touched`, the vertices of all changed triangles before and
  // after the change, each once. Positions and velocities of new slots must have been set on the present surface (not
  // at rest: a short new edge would start inverted). A new vertex joins the component of a neighbour. Mass is added
  // where a row would not be stable at step_s. O(touched), compaction aside. A temporary change belongs to a
  // deformation; undoing it restores everything, added mass included, bit for bit.
  enum class Change { permanent, temporary };
  void update(const TriangleMesh& mesh, std::span<const VertexId> touched, Change change = Change::permanent);
  void follow(const SharedBody& body, const TopologyChange& change) override {
    update(body.mesh, change.vertices, change.delta.temporary ? Change::temporary : Change::permanent);
  }

  // The rest shape of a free component moves with it; a component with a fixed vertex is anchored in any case. Another
  // call for the same id keeps the frame. O(vertices).
  void set_component(std::uint32_t component, std::span<const VertexId> vertices, bool anchored);
  // Vertices of this component that get below the plane are put onto it and stop, as on a floor with high friction.
  void set_bed(std::uint32_t component, const Vec3& point_world_m, const Vec3& normal) {
    frames_.set_bed(component, point_world_m, normal);
  }
  // The piece becomes a new component.
  void release(std::span<const VertexId> piece, const std::optional<SupportPlane>& support) override;
  Pose rest_frame_world(VertexId v) const override { return frame_world(component_of(v)); }
  std::uint32_t component_of(VertexId v) const { return frames_.component_of(v); }
  bool anchored(std::uint32_t component) const { return !frames_.is_free(component); }
  const Pose& frame_world(std::uint32_t component) const { return frames_.frame_world(component); }

  // Acts in the next step only.
  void add_force(VertexId v, const Vec3& force_world_n);
  // Moves a vertex now, and changes its velocity by dx / h; returns the force on the object that pushed it, - m dx /
  // h^2.
  Vec3 displace(VertexId v, const Vec3& by_m, std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);

  // Follows from the bound omega_i^2 = (2 lambda_max(sum_j K_ij) + k_h,i) / m_i of every vertex, with omega h <= 2
  // (sqrt(1 + zeta^2) - zeta); infinite when nothing can move.
  double largest_stable_step_s() const override;
  IntegratorDiagnostics diagnostics() const override {
    IntegratorDiagnostics d;
    d.stability_margin = largest_stable_step_s() / settings_.step_s;
    d.added_mass_fraction = added_mass_kg_ / physical_mass_kg_;
    d.implicit_steps = implicit_steps_;
    d.steps_not_met = driver_.steps_not_met();
    d.residual = was_implicit_ ? driver_.residual() : 0;
    d.residual_m = was_implicit_ ? driver_.residual_m() : 0;
    return d;
  }

  double layer_m() const override { return layer_m_; }
  double mass_kg(VertexId v) const override { return physical_mass_[v]; }  // without added mass
  double inverse_mass_per_kg(VertexId v) const override { return inverse_mass_[v]; }
  bool fixed(VertexId v) const override { return fixed_[v] != 0; }
  std::uint64_t clamped() const { return clamped_; }  // velocities of free vertices that were capped so far
  VertexId first_bad_vertex() const override { return first_bad_vertex_; }
  void save(DeformationState& state) const override;
  void restore(const SharedBody& body, const DeformationState* state) override;
  void use_stable_driver(int steps) override { stable_for_ = std::max(stable_for_, steps); }
  void archive(Archive& a, const SharedBody&) override {
    a(settings_.gravity_m_per_s2, settings_.given_gravity_m_per_s2, body_, least_area_m2_, layer_m_, rows_,
      cut_damping_, rest_body_m_, home_body_m_, lift_world_m_, physical_mass_, added_mass_, inverse_mass_, fixed_,
      displaced_, cut_, temporary_, frames_, omega2_, physical_mass_kg_, added_mass_kg_, driver_, parts_,
      parts_at_rest_, refused_, implicit_steps_, stable_for_, was_implicit_, parts_looked_at_, capped_parts_, forces_,
      clamped_, first_bad_vertex_);
    inside_.forget_pieces();
  }
  const SpringRows& rows() const { return rows_; }
  int parts() const { return parts_; }  // parts of an explicit step
  ModelSize size(const SharedBody& body) const override {
    const double vertices = body.mesh.vertex_count();
    return {vertices, vertices, parts_};
  }

  // Kinetic, elastic and gravitational energy, with the frames of the last step. O(n); for tests and reports.
  double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const;
  double energy_j(const SharedBody& body) const override {
    return energy_j(body.particles.position_world_m, body.particles.velocity_world_m_per_s) +
           inside_.energy_j(body.mesh, frames_, body.particles.position_world_m);
  }

 private:
  struct Force {
    VertexId v;
    Vec3 force_n;

    template <class A>
    void archive(A& a) {
      a(v, force_n);
    }
  };

  void resize(std::uint32_t vertex_slots);
  void set_row(const TriangleMesh& mesh, VertexId v);
  void remove_row(VertexId v);
  void forget_mass(VertexId v);
  void adopt_new_vertices(const TriangleMesh& mesh, std::span<const VertexId> touched);
  Vec3f home_world_m(VertexId v) const;
  double stable_mass_kg(double stiffness_n_per_m) const;
  double added_mass_kg(double physical_kg, double stiffness_n_per_m);
  double part_s() const { return settings_.step_s / parts_; }
  void divide();
  void divide_at_rest();
  // A vertex that a constraint may push, with its velocity before the last step, and after it when that is beyond the
  // cap of free vertices. Its constraint decides with all of its velocity.
  struct Held {
    VertexId v = kNone;
    Vec4f before_m_per_s = Vec4f::Zero(), free_m_per_s = Vec4f::Zero();
  };
  void follow(std::span<const Vec4f> position_world_m);
  void take_fixed_home(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);
  void find_held(std::span<const PointConstraint> constraints);
  void slow_down_unpushed(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const;
  Vec4f free_velocity(const Held& held, const VelocityUpdate& update, std::span<const Vec4f> position_world_m) const;
  void explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);
  void implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                     std::span<const PointConstraint> constraints, std::span<Reaction> reactions);
  void push(std::span<Vec4f> velocity_m_per_s);
  double column_factor(const TriangleMesh& mesh, VertexId v) const;

  SurfaceSpringMaterial material_;
  SurfaceSpringSettings settings_;
  Pose body_;
  MembraneConstants membrane_;
  double foundation_pa_per_m_ = 0;  // K_w
  double area_density_kg_per_m2_ = 0;
  double least_area_m2_ = 0;
  double layer_m_ = 0;  // before cuts have made small triangles

  SpringRows rows_;
  CutDamping cut_damping_;
  std::vector<Vec3> rest_body_m_;
  std::vector<Vec3> home_body_m_;   // the home springs pull here
  std::vector<Vec3> lift_world_m_;  // anchored tissue's homes are lifted so by its weight
  std::vector<double> physical_mass_;
  std::vector<double> added_mass_;
  std::vector<double> inverse_mass_;  // the effective mass; 0 when fixed
  std::vector<std::uint8_t> fixed_;
  std::vector<VertexId> displaced_;      // fixed vertices that may not be at their places yet
  std::vector<std::uint8_t> cut_;        // a permanent change has touched the vertex
  std::vector<std::uint8_t> temporary_;  // the vertex was added by a temporary change
  RestFrames frames_;
  MaxTree omega2_;  // per vertex, 1/s^2
  double physical_mass_kg_ = 0;
  double added_mass_kg_ = 0;

  SpringEnergy energy_;
  ImplicitDriver driver_;
  std::vector<Vec4f> ahead_world_m_;  // after an implicit step without forces
  InsidePressure inside_;
  std::vector<Held> held_;
  ConstraintSupports corners_;
  DividedConstraints divided_;
  int parts_ = 1, parts_at_rest_ = 1;
  bool refused_ = false;  // some mass was refused since it was last shared out
  std::uint64_t implicit_steps_ = 0;
  int stable_for_ = 0;  // steps that the implicit driver takes whatever the bound says
  bool was_implicit_ = false;
  int parts_looked_at_ = 0, capped_parts_ = 0;

  std::vector<Force> forces_;
  SpringStar star_;
  std::uint64_t clamped_ = 0;
  VertexId first_bad_vertex_ = kNone;
};

}  // namespace sectio
