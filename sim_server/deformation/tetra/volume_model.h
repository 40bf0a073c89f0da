// The interface of a volume's deformation model, which VolumeDeformation owns: it moves the vertices of a mesh of
// tetrahedra. Positions and velocities have one entry {x, y, z, 0} a vertex.
#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "common/material/elastic_material.h"
#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/integrator_diagnostics.h"
#include "sim_server/deformation/point_constraint.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {

struct VolumeMaterial : ElasticMaterial {
  double damping_per_s = 25;             // rate at which velocities decay
  std::vector<double> stiffness_factor;  // one a tetrahedron; empty: 1
};

struct VolumeSettings {
  double step_s = 0.001;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::vector<std::uint8_t> fixed;  // one a vertex; empty: none is fixed
  // A step is taken in equal, stable substeps. Where a cut or a mesher has left small elements, vertices too light for
  // substeps of this length get added mass (selective mass scaling); gravity on them doesn't grow. 0: none does.
  double least_substep_s = 0;
};

// The largest speed of a particle, above that of any surgical motion.
constexpr double kMaxVolumeSpeed_m_per_s = 5;

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
  const Vec3& gravity_m_per_s2() const { return settings_.gravity_m_per_s2; }
  virtual void set_gravity(const Vec3& gravity_m_per_s2) { settings_.gravity_m_per_s2 = gravity_m_per_s2; }

  virtual const TetMesh& mesh() const = 0;                           // including numbers that are no longer in use
  virtual double mass_kg(VertexId v) const = 0;                      // of the tissue, without added mass
  virtual double inverse_mass_per_kg(VertexId v) const = 0;          // of the effective mass; 0 when fixed
  virtual double largest_stable_step_s() const { return HUGE_VAL; }  // infinite: any step is stable
  virtual IntegratorDiagnostics diagnostics() const { return {}; }
  virtual VertexId first_bad_vertex() const = 0;  // kNone while all is finite

  // Kinetic, elastic and gravitational. O(n).
  virtual double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const = 0;

 protected:
  // The smallest number of equal substeps that are no longer than the limit, at most 1000.
  int substeps_for(double substep_limit_s) const;
  // The terms of an explicit substep other than forces.
  VelocityUpdate velocity_update(double substep_s) const;
  // Kinetic and gravitational energy, for models whose particles are the vertices.
  double energy_of_motion_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const;

  VolumeMaterial material_;
  VolumeSettings settings_;
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

// The constraints of a step that is taken in substeps. Each target moves evenly from the place of its point at the
// start; the reaction is the mean over the substeps, and its work is the sum.
class DividedConstraints {
 public:
  // Without supports, the corners of the constraints carry their points.
  void begin(std::span<const PointConstraint> constraints, std::span<const Vec4f> position_world_m, int substeps);
  void begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const Vec4f> position_world_m, int substeps);
  // Call after the motion of each substep, with the number of substeps before it.
  void project_substep(int substep, double substep_s, std::span<const double> inverse_mass,
                       std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);
  void finish(std::span<Reaction> reactions) const;

 private:
  std::vector<PointConstraint> constraints_;
  ConstraintSupports supports_;
  std::vector<Vec3> start_, end_;
  std::vector<Reaction> substep_reactions_, mean_;
  int substeps_ = 1;
};

}  // namespace sectio
