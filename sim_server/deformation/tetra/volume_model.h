// What a model of a whole volume is to the engine that carries it (volume_engine.h): it moves the vertices of a mesh of
// tetrahedra. Positions and velocities are one entry a vertex, {x, y, z, 0} from outside.
#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/point_constraint.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {

struct VolumeMaterial {
  double young_pa = 6000;
  double poisson = 0.45;
  double density_kg_per_m3 = 1060;
  double damping_per_s = 25;             // of velocities
  std::vector<double> stiffness_factor;  // of each tetrahedron; empty: 1
};

struct VolumeSettings {
  double step_s = 0.001;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::vector<std::uint8_t> fixed;  // by vertex; empty: none
  // A step is taken in equal parts that are stable. Vertices too light for parts of this length, where a cut or a
  // mesher has left small elements, are made heavier until they are not; their weight stays. 0: none is.
  double least_part_s = 0;
};

// Faster than any surgical motion.
constexpr double kMaxVolumeSpeed_m_per_s = 5;

class VolumeModel {
 public:
  VolumeModel(VolumeMaterial material, VolumeSettings settings)
      : material_(std::move(material)), settings_(std::move(settings)) {}
  virtual ~VolumeModel() = default;

  // The volume has been cut, or a part of it has left. Rows of what was touched are written anew, nothing else; what
  // has become small is made heavy enough for the parts of a step that were stable before. O(change).
  virtual void change(const TetChange& change) = 0;

  // By settings.step_s. reactions: one a constraint.
  virtual void step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                    std::span<const PointConstraint> constraints, std::span<Reaction> reactions) = 0;
  const Vec3& gravity_m_per_s2() const { return settings_.gravity_m_per_s2; }
  virtual void set_gravity(const Vec3& gravity_m_per_s2) { settings_.gravity_m_per_s2 = gravity_m_per_s2; }

  virtual const TetMesh& mesh() const = 0;                   // numbers that are not used any more included
  virtual double mass_kg(VertexId v) const = 0;              // the tissue's own
  virtual double inverse_mass_per_kg(VertexId v) const = 0;  // of the effective mass; 0 when fixed
  virtual double added_mass_fraction() const { return 0; }
  virtual double largest_stable_step_s() const { return HUGE_VAL; }  // of settings.step_s; infinite: there is none
  virtual std::uint64_t implicit_steps() const { return 0; }         // taken over from an explicit driver, so far
  virtual double residual_m() const { return 0; }                    // see DeformationEngine
  virtual double margin() const { return HUGE_VAL; }  // likewise; infinite when the last step was implicit
  virtual VertexId first_bad_vertex() const = 0;      // kNone while all is finite

  // Kinetic, elastic and gravitational. O(n).
  virtual double energy_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const = 0;

 protected:
  // As few equal parts of a step as are no longer than that, but never more than 1000.
  int parts_for(double part_limit_s) const;
  // What an explicit part of a step has besides the forces.
  VelocityUpdate velocity_update(double part_s) const;
  // Without the elastic part, for models whose particles are the vertices.
  double energy_of_motion_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) const;

  VolumeMaterial material_;
  VolumeSettings settings_;
};

// rho V / 4 from each tetrahedron at a vertex.
inline std::vector<double> masses_by_volume(const TetMesh& mesh, double density_kg_per_m3) {
  std::vector<double> mass(mesh.vertices_body_m.size(), 0);
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const VertexId v : t)
      if (v != kNone) mass[v] += 0.25 * density_kg_per_m3 * tet_volume_m3(mesh, t);
  return mass;
}

// The longest explicit step for modes up to this frequency, velocities damped explicitly, too:
// omega h <= 2 (sqrt(1 + zeta^2) - zeta), zeta = (alpha / omega + damper_s omega) / 2. Infinite when nothing can move.
inline double damped_limit_s(double omega2, double damping_per_s, double damper_s = 0) {
  const double omega = std::sqrt(omega2), zeta = 0.5 * (damping_per_s / omega + damper_s * omega);
  return omega2 > 0 ? 2 * (std::sqrt(1 + zeta * zeta) - zeta) / omega : HUGE_VAL;
}

// Constraints of a step that is taken in several: the target of each moves evenly from where its point is at the start,
// and the reaction is the mean of the parts',
// its work their sum.
class DividedConstraints {
 public:
  // On the vertices, or on what carries them.
  void begin(std::span<const PointConstraint> constraints, std::span<const Vec4f> position_world_m, int parts);
  void begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const Vec4f> position_world_m, int parts);
  // After the movement of a part, of which there were `part` before it.
  void project_part(int part, double part_s, std::span<const double> inverse_mass, std::span<Vec4f> position_world_m,
                    std::span<Vec4f> velocity_m_per_s);
  void finish(std::span<Reaction> reactions) const;

 private:
  std::vector<PointConstraint> constraints_;
  ConstraintSupports supports_;
  std::vector<Vec3> start_, end_;
  std::vector<Reaction> part_, mean_;
  int parts_ = 1;
};

}  // namespace sectio
