// The interface of a volume's deformation model, which VolumeDeformation owns: it moves the vertices of a mesh of
// tetrahedra. Positions and velocities have one entry {x, y, z, 0} a vertex.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "common/material/elastic_material.h"
#include "common/math/archive.h"
#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/divided_constraints.h"
#include "sim_server/deformation/integrator_diagnostics.h"
#include "sim_server/deformation/node.h"
#include "sim_server/deformation/sag.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {

struct VolumeMaterial : ElasticMaterial {
  double damping_per_s = 25;             // rate at which velocities decay
  std::vector<double> stiffness_factor;  // one a tetrahedron; empty: 1

  template <class A>
  void archive(A& a) {
    a(damping_per_s, stiffness_factor);
  }
};

struct VolumeSettings {
  double step_s = 0.001;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::vector<std::uint8_t> fixed;  // one a vertex; empty: none is fixed
  // A step is taken in equal, stable substeps. Vertices of small elements, which cuts and meshers leave, too light for
  // substeps of this length get added mass (selective mass scaling); gravity on them doesn't grow. 0: none does.
  double least_substep_s = 0;

  template <class A>
  void archive(A& a) {
    a(step_s, gravity_m_per_s2, fixed, least_substep_s);
  }
};

class VolumeModel {
 public:
  VolumeModel(VolumeMaterial material, VolumeSettings settings)
      : material_(std::move(material)), settings_(std::move(settings)) {}
  virtual ~VolumeModel() = default;

  // Follows a cut of the volume, or a part that has left it. Only data of touched vertices is recomputed; vertices that
  // have become light get enough added mass for the length of substeps so far. O(change).
  virtual void change(const TetChange& change) = 0;

  // Advances by settings.step_s. One reaction a constraint.
  virtual void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                    std::span<const PointConstraint> constraints, std::span<Reaction> reactions) = 0;
  double step_s() const { return settings_.step_s; }
  const Vec3& gravity_m_per_s2() const { return settings_.gravity_m_per_s2; }
  virtual void set_gravity(const Vec3& gravity_m_per_s2) { settings_.gravity_m_per_s2 = gravity_m_per_s2; }

  virtual const TetMesh& mesh() const = 0;                   // including numbers that are no longer in use
  virtual double mass_kg(VertexId v) const = 0;              // mass of the tissue, without added mass
  virtual double inverse_mass_per_kg(VertexId v) const = 0;  // the effective mass; 0 when fixed
  // Contacts push nodes (node.h): vertices, if they aren't embedded in something else. nudge() comes after a step.
  virtual void nodes_of(VertexId v, std::vector<NodeShare>& nodes) const { nodes.assign(1, {v, 1}); }
  virtual std::uint32_t node_count() const { return static_cast<std::uint32_t>(mesh().vertices_body_m.size()); }
  virtual NodeMotion node(std::span<const Vec4f> velocity_m_per_s, std::uint32_t n) const {
    return {velocity_m_per_s[n].head<3>().cast<double>(), inverse_mass_per_kg(n)};
  }
  virtual void nudge(std::span<const NodeChange> changes, std::span<Vec4f> position_world_m,
                     std::span<Vec4f> velocity_m_per_s) {
    apply(changes, position_world_m, velocity_m_per_s);
  }
  virtual double cell_m() const { return 0; }                        // edge of a lattice's cells; 0: there is none
  virtual double largest_stable_step_s() const { return HUGE_VAL; }  // infinite: any step is stable
  virtual IntegratorDiagnostics diagnostics() const { return {}; }
  virtual ModelSize size() const {
    return {static_cast<double>(mesh().tetrahedra.size()), static_cast<double>(mesh().vertices_body_m.size())};
  }
  virtual bool asks_for_origins() const { return true; }  // whether change() reads TetEdit::origin
  virtual VertexId first_bad_vertex() const = 0;          // kNone while all is finite

  // See DeformationEngine::sag(). Uses the displacement of each vertex; empty if it isn't known.
  std::vector<SagPoint> sag(const Vec3& gravity_body_m_per_s2);
  virtual std::vector<Vec3> sag_m(const Vec3& /*gravity_body_m_per_s2*/) { return {}; }

  // For recovery, as in DeformationEngine: what a model keeps beyond positions and velocities of the vertices.
  // restore() takes an empty span for the shape at rest at the pose `frame`, brings all to rest, and may place
  // vertices.
  virtual void save(std::vector<Vec4f>& nodes_world_m) const { nodes_world_m.clear(); }
  virtual void restore(std::span<const Vec4f> /*nodes_world_m*/, const Pose& /*frame*/,
                       std::span<Vec4f> /*position_world_m*/, std::span<Vec4f> /*velocity_m_per_s*/) {}
  virtual void use_stable_driver(int /*steps*/) {}

  // See Engine::archive().
  virtual void archive(Archive& a) { a.refuse(); }

  // Kinetic, elastic and gravitational. O(n).
  virtual double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const = 0;

 protected:
  void archive_settings(Archive& a) { a(material_, settings_, divided_); }
  // Substeps are halved, a few times at most, when cuts have left elements so small that they would need much mass.
  bool may_divide() const { return divided_ < 3; }
  // The length of substeps for which vertices get mass, where `substeps` make a step.
  double part_s(int substeps) const {
    const double part_s = settings_.step_s / substeps;
    return divided_ > 0 ? part_s : std::max(settings_.least_substep_s, part_s);
  }
  // The smallest number of equal substeps that are no longer than the limit, at most 1000.
  int substeps_for(double substep_limit_s) const;
  // The terms of an explicit substep other than forces.
  VelocityUpdate velocity_update(double substep_s) const;
  // Kinetic and gravitational energy, for models whose particles are the vertices.
  double energy_of_motion_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const;

  VolumeMaterial material_;
  VolumeSettings settings_;
  int divided_ = 0;  // how often substeps have been halved so far
};

// Lumped masses: rho V / 4 from each tetrahedron at a vertex.
inline std::vector<double> masses_by_volume(const TetMesh& mesh, double density_kg_per_m3) {
  std::vector<double> mass(mesh.vertices_body_m.size(), 0);
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const VertexId v : t)
      if (v != kNone) mass[v] += 0.25 * density_kg_per_m3 * tet_volume_m3(mesh, t);
  return mass;
}

// The largest stable explicit step for modes up to this frequency, where damping is explicit, too:
// omega h <= 2 (sqrt(1 + zeta^2) - zeta), zeta = (alpha / omega + damper_s omega) / 2. Infinite when nothing can move.
inline double damped_limit_s(double omega2, double damping_per_s, double damper_s = 0) {
  const double omega = std::sqrt(omega2), zeta = 0.5 * (damping_per_s / omega + damper_s * omega);
  return omega2 > 0 ? 2 * (std::sqrt(1 + zeta * zeta) - zeta) / omega : HUGE_VAL;
}

}  // namespace sectio
