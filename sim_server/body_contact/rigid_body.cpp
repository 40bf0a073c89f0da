#include "sim_server/body_contact/rigid_body.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kStill_m_per_s = 0.004;  // largest speed of any point at rest
constexpr double kStillBeforeSleep_s = 0.2;

// The orientation turned by w h, by Cayley's map, which agrees with the exponential to the third order and needs a
// square root only.
Eigen::Quaterniond turned(const Eigen::Quaterniond& q, const Vec3& w_rad_per_s, double h) {
  const Vec3 half = 0.5 * h * w_rad_per_s;
  return (Eigen::Quaterniond(1, half.x(), half.y(), half.z()).normalized() * q).normalized();
}

}  // namespace

RigidBody::RigidBody(double mass_kg, const Mat3& inertia_kg_m2, const Vec3& centre_world_m)
    : mass_kg_(mass_kg),
      inertia_body_(inertia_kg_m2),
      inverse_inertia_body_(inertia_kg_m2.inverse()),
      inverse_inertia_world_(inverse_inertia_body_) {
  SECTIO_ASSERT(mass_kg > 0 && inertia_kg_m2.determinant() > 0, "a rigid body has mass and extent");
  pose_.position_m = centre_world_m;
}

void RigidBody::turn_to(const Eigen::Quaterniond& orientation) {
  pose_.orientation = orientation;
  const Mat3 r = orientation.toRotationMatrix();
  inverse_inertia_world_ = r * inverse_inertia_body_ * r.transpose();
}

double RigidBody::kinetic_energy_j() const {
  return 0.5 * momentum_.squaredNorm() / mass_kg_ + 0.5 * angular_momentum_.dot(angular_velocity_rad_per_s());
}

Vec3 RigidBody::velocity_at(const Vec3& point_world_m) const {
  return velocity_m_per_s() + angular_velocity_rad_per_s().cross(point_world_m - pose_.position_m);
}

void RigidBody::set_velocity(const Vec3& velocity_m_per_s, const Vec3& angular_velocity_rad_per_s) {
  momentum_ = mass_kg_ * velocity_m_per_s;
  const Mat3 r = pose_.orientation.toRotationMatrix();
  angular_momentum_ = r * (inertia_body_ * (r.transpose() * angular_velocity_rad_per_s));
}

void RigidBody::add_impulse(const Vec3& impulse_n_s, const Vec3& at_world_m) {
  momentum_ += impulse_n_s;
  angular_momentum_ += (at_world_m - pose_.position_m).cross(impulse_n_s);
}

void RigidBody::push(const Vec3& acceleration_m_per_s2, double step_s) {
  velocity_before_ = velocity_m_per_s();
  momentum_ += mass_kg_ * step_s * acceleration_m_per_s2;
  pushed_ = momentum_;
}

// An untouched body moves by the mean of the old and the new velocity, which is exact under constant acceleration; a
// touched body moves by the new velocity, which contacts allow. Orientation follows the midpoint rule at the body's
// angular momentum.
void RigidBody::move(double step_s) {
  const Vec3 after = velocity_m_per_s();
  pose_.position_m += step_s * (momentum_ == pushed_ ? Vec3(0.5 * (velocity_before_ + after)) : after);
  const Eigen::Quaterniond start = pose_.orientation;
  const Vec3 w = angular_velocity_rad_per_s();
  if (w.isZero(0)) return;
  turn_to(turned(start, w, 0.5 * step_s));
  turn_to(turned(start, angular_velocity_rad_per_s(), step_s));
}

void RigidBody::shift(const Vec3& by_m, const Vec3& turn_rad) {
  pose_.position_m += by_m;
  if (!turn_rad.isZero(0)) turn_to(turned(pose_.orientation, turn_rad, 1));
}

void RigidBody::rest_at(const Pose& pose_world) {
  pose_.position_m = pose_world.position_m;
  turn_to(pose_world.orientation);
  set_velocity(Vec3::Zero(), Vec3::Zero());
}

void RigidBody::rest(bool supported, double radius_m, double step_s) {
  const double fastest = velocity_m_per_s().norm() + radius_m * angular_velocity_rad_per_s().norm();
  still_s_ = supported && fastest < kStill_m_per_s ? still_s_ + step_s : 0;
  if (still_s_ < kStillBeforeSleep_s) return;
  asleep_ = true;
  momentum_.setZero();
  angular_momentum_.setZero();
}

RigidVelocity rigid_velocity(std::span<const MovingPoint> points) {
  RigidVelocity result;
  double mass = 0;
  Vec3 momentum = Vec3::Zero();
  for (const MovingPoint& p : points) {
    mass += p.mass_kg;
    result.centre_m += p.mass_kg * p.at_m;
    momentum += p.mass_kg * p.velocity_m_per_s;
  }
  if (!(mass > 0)) return {};
  result.centre_m /= mass;
  result.velocity_m_per_s = momentum / mass;
  Vec3 spin = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (const MovingPoint& p : points) {
    const Vec3 r = p.at_m - result.centre_m;
    spin += p.mass_kg * r.cross(p.velocity_m_per_s);
    inertia += p.mass_kg * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
  }
  const Eigen::LDLT<Mat3> solver(inertia);
  if (inertia.determinant() > 1e-12 * std::pow(inertia.trace(), 3))
    result.angular_velocity_rad_per_s = solver.solve(spin);
  return result;
}

}  // namespace sectio
