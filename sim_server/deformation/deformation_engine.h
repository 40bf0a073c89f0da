// The interface of a deformation model: it moves the vertices of one body.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "sim_server/deformation/integrator_diagnostics.h"
#include "sim_server/deformation/node.h"
#include "sim_server/deformation/point_constraint.h"
#include "sim_server/deformation/sag.h"
#include "sim_server/engine/engine.h"

namespace sectio {

// A plane that bears a loose piece.
struct SupportPlane {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
};

class RigidMotion;

inline bool is_finite(const Pose& pose) {
  return pose.position_m.allFinite() && pose.orientation.coeffs().allFinite();
}

// The state of a deformation model beyond the particles of the surface: inner vertices or nodes, and the poses of the
// shapes at rest.
struct DeformationState {
  std::vector<Vec4f> inside_world_m;
  std::vector<Pose> frames_world;

  template <class A>
  void archive(A& a) {
    a(inside_world_m, frames_world);
  }
};

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
  virtual double mass_kg(VertexId v) const = 0;           // mass of the tissue, without added mass
  virtual double inverse_mass_per_kg(VertexId v) const {  // change of its velocity per impulse on it; 0: held
    return fixed(v) || !(mass_kg(v) > 0) ? 0 : 1 / mass_kg(v);
  }
  // Contacts push nodes (node.h). Most models have one in each particle.
  virtual void nodes_of(VertexId v, std::vector<NodeShare>& nodes) const { nodes.assign(1, {v, 1}); }
  virtual std::uint32_t node_count(const ParticleView& particles) const {
    return static_cast<std::uint32_t>(particles.position_world_m.size());
  }
  virtual NodeMotion node(const ParticleView& particles, std::uint32_t n) const {
    return {particles.velocity(n), inverse_mass_per_kg(n)};
  }
  virtual void nudge(const SharedBody& body, std::span<const NodeChange> changes) {
    for (const NodeChange& c : changes) body.particles.nudge(c.node, c.faster_by_m_per_s, c.moved_by_m);
  }
  // The mesh is too stiff beneath what is smaller than its elements: an instrument that presses has this depth of
  // tissue in series, a layer of E* / layer_m (Pa/m).
  virtual double layer_m() const { return 0; }
  virtual double energy_j(const SharedBody& body) const = 0;  // kinetic, elastic and gravitational; O(all)
  virtual double largest_stable_step_s() const = 0;
  virtual VertexId first_bad_vertex() const = 0;  // kNone while all is finite

  // For the recovery of a body in trouble. restore() takes what save() gave at the present topology, or nullptr for the
  // shape at rest where the body is; all comes to rest, and first_bad_vertex() is forgotten. The caller places the
  // surface alike.
  virtual void save(DeformationState&) const {}
  virtual void restore(const SharedBody&, const DeformationState*) {}
  // The next steps are taken by the driver that is stable at any step, where there is one.
  virtual void use_stable_driver(int /*steps*/) {}
  virtual IntegratorDiagnostics diagnostics() const { return {}; }
  // How far its weight moves the body, for small strains, if the engine knows: one a particle that isn't held. In the
  // body's frame, before anything has changed its topology.
  virtual std::vector<SagPoint> sag(const Vec3& /*gravity_body_m_per_s2*/) { return {}; }
  virtual ModelSize size(const SharedBody& body) const {
    const double vertices = body.mesh.vertex_count();
    return {vertices, vertices};
  }

  // A body that doesn't deform moves as a whole and keeps its shape. Its engine knows what bears it, and puts it to
  // sleep itself; a body that deforms sleeps when its particles are still.
  virtual bool deforms() const { return true; }
  virtual bool asleep() const { return false; }
  virtual void wake() {}
  // The engine itself when its body doesn't deform: contacts push that body, not its particles (step/collide).
  virtual RigidMotion* rigid() { return nullptr; }
};

}  // namespace sectio
