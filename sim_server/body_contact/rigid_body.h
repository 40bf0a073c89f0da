// A rigid body of six degrees of freedom at a fixed explicit step. Its state is its pose and its two momenta, which
// only forces change: without forces, linear and angular momentum keep their last bit, and the gyroscopic term comes
// from the inertia that turns with the body. The error of energy is of second order in the step. Deterministic; no
// trigonometric function.
#pragma once

#include <span>

#include "common/math/types.h"

namespace sectio {

class RigidBody {
 public:
  RigidBody() = default;
  // `inertia` is about the mass centre, at the identity orientation. Mass and inertia must be positive (definite).
  RigidBody(double mass_kg, const Mat3& inertia_kg_m2, const Vec3& centre_world_m);

  double mass_kg() const { return mass_kg_; }
  const Pose& pose_world() const { return pose_; }  // its origin is the mass centre
  Vec3 velocity_m_per_s() const { return momentum_ / mass_kg_; }
  Vec3 angular_velocity_rad_per_s() const { return inverse_inertia_world() * angular_momentum_; }
  const Vec3& momentum_kg_m_per_s() const { return momentum_; }
  const Vec3& angular_momentum_kg_m2_per_s() const { return angular_momentum_; }  // about the centre
  double kinetic_energy_j() const;
  Vec3 velocity_at(const Vec3& point_world_m) const;
  const Mat3& inverse_inertia_world() const { return inverse_inertia_world_; }

  void set_velocity(const Vec3& velocity_m_per_s, const Vec3& angular_velocity_rad_per_s);
  void add_impulse(const Vec3& impulse_n_s, const Vec3& at_world_m);

  // A step is push(), then contacts, then move(). A body without contacts falls along the exact parabola.
  void push(const Vec3& acceleration_m_per_s2, double step_s);
  void move(double step_s);
  // Moves the body without giving it a velocity.
  void shift(const Vec3& by_m, const Vec3& turn_rad);
  // Puts the body to a pose, without motion.
  void rest_at(const Pose& pose_world);

  // A body that is slower than a threshold at its rim for a while falls asleep: it doesn't move and costs nothing.
  bool asleep() const { return asleep_; }
  void wake() { asleep_ = false, still_s_ = 0; }
  // Call after move(). `radius_m`: radius of a ball around the centre that contains the body. Only a `supported` body
  // falls asleep.
  void rest(bool supported, double radius_m, double step_s);

  template <class A>
  void archive(A& a) {
    a(mass_kg_, inertia_body_, inverse_inertia_body_, inverse_inertia_world_, pose_, momentum_, angular_momentum_,
      velocity_before_, pushed_, still_s_, asleep_);
  }

 private:
  void turn_to(const Eigen::Quaterniond& orientation);

  double mass_kg_ = 1;
  Mat3 inertia_body_ = Mat3::Identity(), inverse_inertia_body_ = Mat3::Identity();
  Mat3 inverse_inertia_world_ = Mat3::Identity();  // at the present pose
  Pose pose_;
  Vec3 momentum_ = Vec3::Zero(), angular_momentum_ = Vec3::Zero();
  Vec3 velocity_before_ = Vec3::Zero();  // velocity before push()
  Vec3 pushed_ = Vec3::Zero();           // momentum after push()
  double still_s_ = 0;
  bool asleep_ = false;
};

// The velocity of a rigid motion with the linear and the angular momentum of moving points, with which a body goes on
// when it stops deforming.
struct RigidVelocity {
  Vec3 centre_m = Vec3::Zero();
  Vec3 velocity_m_per_s = Vec3::Zero();  // velocity of the centre
  Vec3 angular_velocity_rad_per_s = Vec3::Zero();

  Vec3 at(const Vec3& point_m) const { return velocity_m_per_s + angular_velocity_rad_per_s.cross(point_m - centre_m); }
};
struct MovingPoint {
  Vec3 at_m;
  Vec3 velocity_m_per_s;
  double mass_kg;
};
RigidVelocity rigid_velocity(std::span<const MovingPoint> points);

}  // namespace sectio
