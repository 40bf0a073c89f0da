// The interface of a deformation model: it moves the vertices of one body.
#pragma once

#include <optional>
#include <span>

#include "common/math/types.h"
#include "sim_server/deformation/integrator_diagnostics.h"
#include "sim_server/deformation/point_constraint.h"
#include "sim_server/engine/engine.h"

namespace sectio {

// A plane that bears a loose piece.
struct SupportPlane {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
};

class RigidMotion;

class DeformationEngine : public Engine {
 public:
  // Moves the particles by one step of the scene. One reaction a constraint.
  virtual void step(const SharedBody& body, std::span<const PointConstraint> constraints,
                    std::span<Reaction> reactions) = 0;

  // Takes effect with the next step.
  virtual void set_gravity(const Vec3& gravity_m_per_s2) = 0;

  // The pose of the rest shape of the connected piece that v belongs to.
  virtual Pose rest_frame_world(VertexId v) const = 0;
  // Lets a connected piece move freely: the rest of the body no longer holds it, and `support` bears it if given.
  virtual void release(std::span<const VertexId> piece, const std::optional<SupportPlane>& support) = 0;

  virtual bool fixed(VertexId v) const = 0;               // the vertex never moves
  virtual double mass_kg(VertexId v) const = 0;           // of the tissue, without added mass
  virtual double inverse_mass_per_kg(VertexId v) const {  // change of velocity per impulse of a contact
    return fixed(v) || !(mass_kg(v) > 0) ? 0 : 1 / mass_kg(v);
  }
  virtual double energy_j(const SharedBody& body) const = 0;  // kinetic, elastic and gravitational; O(all)
  virtual double largest_stable_step_s() const = 0;
  virtual VertexId first_bad_vertex() const = 0;  // kNone while all is finite
  virtual IntegratorDiagnostics diagnostics() const { return {}; }
  // The engine itself when it moves its body as a whole: contacts with other bodies push that body, not its particles.
  virtual RigidMotion* rigid() { return nullptr; }
};

}  // namespace sectio
