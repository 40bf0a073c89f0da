#include "sim_server/splitting/rigid_body.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kSlopM = 5e-5;          // of depth that is left alone, so that contacts last
constexpr double kDepthUndone = 0.2;     // of the rest in one step
constexpr double kStillM_per_s = 0.004;  // of the fastest point
constexpr double kStillBeforeSleepS = 0.2;

// Turned by w h: Cayley's map, which agrees with the exponential to the third order and needs a square root only.
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

// Untouched: the mean of both velocities, exact under constant acceleration. Touched: the new one, which contacts
// allow. Orientation by the midpoint rule at the angular momentum that the body has.
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

void RigidBody::rest(bool supported, double radius_m, double step_s) {
  const double fastest = velocity_m_per_s().norm() + radius_m * angular_velocity_rad_per_s().norm();
  still_s_ = supported && fastest < kStillM_per_s ? still_s_ + step_s : 0;
  if (still_s_ < kStillBeforeSleepS) return;
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

namespace {

// One contact as the solver needs it.
struct Row {
  RigidBody* body = nullptr;
  RigidBody* other = nullptr;
  Vec3 u, w;  // across the normal
  double mass_n = 0, mass_u = 0, mass_w = 0;
  double target_m_per_s = 0;  // least velocity apart
  double n = 0;
  Eigen::Vector2d t = Eigen::Vector2d::Zero();
  Vec3 total = Vec3::Zero();
};

double mass_along(const RigidBody* body, const RigidBody* other, const Vec3& at, const Vec3& along) {
  double inverse = 0;
  for (const RigidBody* b : {body, other}) {
    if (!b) continue;
    const Vec3 arm = (at - b->pose_world().position_m).cross(along);
    inverse += 1 / b->mass_kg() + arm.dot(b->inverse_inertia_world() * arm);
  }
  return 1 / inverse;
}

void shove(Row& row, const Vec3& impulse, const Vec3& at) {
  row.body->add_impulse(impulse, at);
  if (row.other) row.other->add_impulse(-impulse, at);
  row.total += impulse;
}

Vec3 velocity_apart(const Row& row, const RigidContact& c) {
  const Vec3& at = c.point_world_m;
  return row.body->velocity_at(at) - (row.other ? row.other->velocity_at(at) : c.surface_velocity_m_per_s);
}

void solve(Row& row, const RigidContact& c) {
  const Vec3& at = c.point_world_m;
  const double missing = row.target_m_per_s - velocity_apart(row, c).dot(c.normal_world);
  const double n = std::max(0.0, row.n + row.mass_n * missing);
  if (n != row.n) shove(row, (n - row.n) * c.normal_world, at);
  row.n = n;
  const Vec3 slip = velocity_apart(row, c);
  Eigen::Vector2d t = row.t - Eigen::Vector2d(row.mass_u * row.u.dot(slip), row.mass_w * row.w.dot(slip));
  const double limit = c.friction * row.n;
  if (const double size = t.norm(); size > limit) t *= limit / size;
  const Eigen::Vector2d dt = t - row.t;
  if (!dt.isZero(0)) shove(row, dt[0] * row.u + dt[1] * row.w, at);
  row.t = t;
}

}  // namespace

void solve_contacts(std::span<RigidBody* const> bodies, std::span<const RigidContact> contacts,
                    const ContactSettings& settings, std::span<Vec3> impulses_on_other_n_s) {
  std::vector<Row> rows(contacts.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const RigidContact& c = contacts[i];
    Row& row = rows[i];
    row.body = bodies[c.body];
    row.other = c.other == kImmovable ? nullptr : bodies[c.other];
    row.u = c.normal_world.unitOrthogonal();
    row.w = c.normal_world.cross(row.u);
    row.mass_n = mass_along(row.body, row.other, c.point_world_m, c.normal_world);
    row.mass_u = mass_along(row.body, row.other, c.point_world_m, row.u);
    row.mass_w = mass_along(row.body, row.other, c.point_world_m, row.w);
    row.target_m_per_s = std::min(0.0, c.depth_m) / settings.step_s;  // a gap may close
  }
  for (int sweep = 0; sweep < settings.sweeps; ++sweep)
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::size_t i = sweep % 2 == 0 ? k : rows.size() - 1 - k;
      solve(rows[i], contacts[i]);
    }
  for (std::size_t i = 0; i < impulses_on_other_n_s.size() && i < rows.size(); ++i)
    impulses_on_other_n_s[i] = -rows[i].total;
}

namespace {

// Velocities of a body that are only for undoing depths.
struct Drift {
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
};

Vec3 drift_at(const Drift& drift, const RigidBody& body, const Vec3& at) {
  return drift.velocity + drift.spin.cross(at - body.pose_world().position_m);
}

void shove(Drift& drift, const RigidBody& body, const Vec3& impulse, const Vec3& at) {
  drift.velocity += impulse / body.mass_kg();
  drift.spin += body.inverse_inertia_world() * (at - body.pose_world().position_m).cross(impulse);
}

}  // namespace

void undo_depths(std::span<RigidBody* const> bodies, std::span<const RigidContact> contacts,
                 const ContactSettings& settings) {
  std::vector<Drift> drifts(bodies.size());
  std::vector<double> impulses(contacts.size(), 0);
  for (int sweep = 0; sweep < settings.sweeps; ++sweep)
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const RigidContact& c = contacts[i];
      if (c.depth_m <= kSlopM) continue;
      const double wanted = std::min(c.largest_speed_m_per_s, kDepthUndone * (c.depth_m - kSlopM) / settings.step_s);
      RigidBody* other = c.other == kImmovable ? nullptr : bodies[c.other];
      Vec3 apart = drift_at(drifts[c.body], *bodies[c.body], c.point_world_m);
      if (other) apart -= drift_at(drifts[c.other], *other, c.point_world_m);
      const double mass = mass_along(bodies[c.body], other, c.point_world_m, c.normal_world);
      const double impulse = std::max(0.0, impulses[i] + mass * (wanted - apart.dot(c.normal_world)));
      const Vec3 added = (impulse - impulses[i]) * c.normal_world;
      impulses[i] = impulse;
      shove(drifts[c.body], *bodies[c.body], added, c.point_world_m);
      if (other) shove(drifts[c.other], *other, -added, c.point_world_m);
    }
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (bodies[b] && !bodies[b]->asleep())
      bodies[b]->shift(settings.step_s * drifts[b].velocity, settings.step_s * drifts[b].spin);
}

}  // namespace sectio
