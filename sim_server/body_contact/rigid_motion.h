// The motion of a part that has stopped deforming: its vertices follow a rigid body. Its mass is density times the
// volume at rest. Its shape is the one at the moment of release, so that no vertex jumps (that at rest, if the part is
// crushed), and its motion begins with the linear and angular momentum of the particles, by their own masses.
//
// step() only takes the constraints of instruments: they are contacts like those with other bodies and with the floor,
// and are solved together with these (step/collide). Then move() moves the body.
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sim_server/body_contact/body_contact.h"
#include "sim_server/body_contact/rigid_body.h"
#include "sim_server/deformation/deformation_engine.h"

namespace sectio {

struct RigidSettings {
  double step_s = 0.001;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double density_kg_per_m3 = 1000;
  double friction = 0.4;  // Coulomb's coefficient, with instruments

  template <class A>
  void archive(A& a) {
    a(step_s, gravity_m_per_s2, density_kg_per_m3, friction);
  }
};

class RigidMotion final : public DeformationEngine {
 public:
  // `frame_world`: the frame of the shape at rest; `mass_kg`: by vertex. Null when the surface encloses no volume, at
  // rest or in its present shape: such a part has no rigid motion.
  static std::unique_ptr<RigidMotion> release(const SharedBody& part, const Pose& frame_world,
                                              std::span<const double> mass_kg, const RigidSettings& settings);

  // A body that sleeps wakes when an instrument presses or holds it. The reactions come after contacts: reactions().
  void step(const SharedBody& self, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override;
  std::span<const PointConstraint> constraints() const { return constraints_; }
  // Appends the same constraints as contacts of a body with this number, in their order.
  void append_contacts(std::uint32_t number, std::vector<BodyContact>& contacts) const;
  // One reaction a constraint; the caller that solves the contacts sets them.
  std::span<const Reaction> reactions() const { return reactions_; }
  void react(std::size_t constraint, const Vec3& impulse_on_tool_n_s);

  void push_by_gravity() { body.push(settings_.gravity_m_per_s2, settings_.step_s); }
  // After contacts: moves the body with its vertices, or lets it fall asleep when something bears it.
  void move(const SharedBody& self, bool supported);

  void follow(const SharedBody&, const TopologyChange&) override {}  // nothing cuts it
  void set_gravity(const Vec3& gravity_m_per_s2) override { settings_.gravity_m_per_s2 = gravity_m_per_s2; }
  Pose rest_frame_world(VertexId v) const override;
  void release(std::span<const VertexId>, const std::optional<SupportPlane>&) override {}
  bool fixed(VertexId) const override { return false; }
  double mass_kg(VertexId v) const override { return mass_kg_[v]; }
  double energy_j(const SharedBody& self) const override;
  double largest_stable_step_s() const override { return std::numeric_limits<double>::infinity(); }
  VertexId first_bad_vertex() const override { return is_finite() ? kNone : 0; }
  // Saves the pose. Without one the body stays where it is, and has the shape of its release.
  void save(DeformationState& state) const override { state.frames_world.assign(1, body.pose_world()); }
  void restore(const SharedBody& self, const DeformationState* state) override;
  bool deforms() const override { return false; }
  bool asleep() const override { return body.asleep(); }
  void wake() override { body.wake(); }
  RigidMotion* rigid() override { return this; }
  void archive(Archive& a, const SharedBody&) override {
    a(settings_, body, constraints_, mass_kg_, arm_m_, frame_at_release_, centre_at_release_world_m_, radius_m_);
  }

  double radius_m() const { return radius_m_; }  // the ball around the mass centre that contains the body

  RigidBody body;

 private:
  bool is_finite() const;
  Pose pose_at_release() const { return {centre_at_release_world_m_, Eigen::Quaterniond::Identity()}; }
  void place(ParticleState& particles) const;

  RigidSettings settings_;
  std::vector<PointConstraint> constraints_;
  std::vector<BodyContact> contacts_;
  std::vector<Reaction> reactions_;
  std::vector<double> mass_kg_;
  std::vector<Vec3> arm_m_;  // by vertex: place relative to the mass centre, at release
  Pose frame_at_release_;
  Vec3 centre_at_release_world_m_ = Vec3::Zero();
  double radius_m_ = 0;
};

}  // namespace sectio
