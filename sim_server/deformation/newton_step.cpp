#include "sim_server/deformation/newton_step.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr int kMostIterations = 8, kMostProducts = 400, kMostHalvings = 8;
constexpr double kInner = 0.01;       // share of the residual that conjugate gradients may leave
constexpr double kRests = 1e-4;       // a residual below this share of the weight needs no iteration
constexpr double kPointOverOwn = 50;  // stiffness of a held point over that of its particles
constexpr double kStandardGravity_m_per_s2 = 9.81;

double dot(std::span<const Vec4f> a, std::span<const Vec4f> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double{a[i].head<3>().dot(b[i].head<3>())};
  return sum;
}

// P of a largest force, and its slope.
Vec3 at_most(double largest_n, const Vec3& force_n, const Mat3& space, Mat3& slope) {
  const double size_n = force_n.norm();
  slope = space;
  if (size_n <= largest_n) return force_n;
  const Vec3 along = force_n / size_n;
  slope = largest_n / size_n * (space - along * along.transpose());
  return largest_n * along;
}

}  // namespace

Vec3 NewtonStep::at(const Problem& problem, std::size_t n, std::span<const Vec3> x) const {
  Vec3 point = Vec3::Zero();
  for (const auto& [particle, weight] : problem.supports->of(n)) point += weight * x[particle];
  return point;
}

// A constraint's share of phi is (|z|^2 - |z - P z|^2) / (2 k) with z = lambda + k (target - point): its gradient is
// - P z. The push and the friction of one that presses have a share each.
NewtonStep::Exerted NewtonStep::exerted(const Problem& problem, std::size_t n, std::span<const Vec3> x) const {
  const PointConstraint& c = problem.constraints[n];
  const Held& h = held_[n];
  const double k = h.stiffness_n_per_m;
  Exerted e;
  if (k == 0) return e;
  const Vec3 point = at(problem, n, x), z = h.force_n + k * (c.target_world_m - point);
  const auto share_j = [](const Vec3& wanted, const Vec3& given, double stiffness) {
    return (wanted.squaredNorm() - (wanted - given).squaredNorm()) / (2 * stiffness);
  };
  if (!c.unilateral || c.sticks) {
    const bool lifts = c.unilateral && z.dot(c.normal) >= 0;
    e.force_n = at_most(lifts ? 0 : c.largest_force_n, z, Mat3::Identity(), e.slope_n_per_m);
    e.energy_j = share_j(z, e.force_n, k);
    e.slope_n_per_m *= lifts ? 0 : k;
    return e;
  }
  // The spring, and beyond what it gives way the point itself: the larger force of the two, whose energies are the same
  // where they meet.
  const Mat3 across = c.normal * c.normal.transpose();
  const double wanted_n = -z.dot(c.normal), gives = 1 + c.compliance_m_per_n * k, most_n = k * c.gives_most_m;
  const double spring_n = wanted_n / gives, stop_n = wanted_n - most_n;
  if (spring_n > 0) {
    const bool stops = stop_n > spring_n;
    const double push_n = stops ? stop_n : spring_n;
    e.force_n = -push_n * c.normal;
    e.slope_n_per_m = (stops ? k : k / gives) * across;
    e.energy_j = stops ? push_n * push_n / (2 * k) : push_n * push_n * gives / (2 * k);
    if (stops && gives > 1) {  // at their meeting point, wanted (1 - 1 / gives) = most
      const double meet_n = most_n / (gives - 1);
      e.energy_j += meet_n * meet_n * (gives - 1) / (2 * k);
    }
  }
  if (c.friction == 0) return e;
  const Mat3 along = Mat3::Identity() - across;
  const Vec3 rub = along * (k * (problem.taken_along_world_m[n] - point));
  Mat3 slope;
  const Vec3 rubbing = at_most(h.friction_n, rub, along, slope);
  e.force_n += rubbing;
  e.energy_j += share_j(rub, rubbing, k);
  e.slope_n_per_m += k * slope;
  return e;
}

double NewtonStep::objective_j(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x) {
  double inertia = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (problem.inverse_mass_per_kg[i] > 0)
      inertia += (x[i] - problem.inertial_world_m[i]).squaredNorm() / problem.inverse_mass_per_kg[i];
  double sum = inertia / (2 * problem.step_s * problem.step_s) + energy.energy_j(x);
  for (std::size_t n = 0; n < held_.size(); ++n) sum += exerted(problem, n, x).energy_j;
  return sum;
}

double NewtonStep::forces(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x) {
  std::ranges::fill(force_, Vec3::Zero());
  energy.add_forces(x, force_);
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Exerted on_tissue = exerted(problem, n, x);
    held_[n].slope_n_per_m = on_tissue.slope_n_per_m;
    for (const auto& [particle, weight] : problem.supports->of(n)) force_[particle] += weight * on_tissue.force_n;
  }
  double sum = 0;
  const double per_s2 = 1 / (problem.step_s * problem.step_s);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (problem.inverse_mass_per_kg[i] == 0) {
      force_[i].setZero();
      continue;
    }
    force_[i] += per_s2 / problem.inverse_mass_per_kg[i] * (problem.inertial_world_m[i] - x[i]);
    sum += force_[i].squaredNorm();
  }
  return std::sqrt(sum);
}

void NewtonStep::linearise(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x) {
  energy.linearise(x);
  const double per_s2 = 1 / (problem.step_s * problem.step_s);
  for (std::size_t i = 0; i < x.size(); ++i)
    blocks_[i] = problem.inverse_mass_per_kg[i] > 0 ? Mat3(per_s2 / problem.inverse_mass_per_kg[i] * Mat3::Identity())
                                                    : Mat3(Mat3::Zero());
  energy.add_blocks(blocks_);
  stiffen(problem);
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (const auto& [particle, weight] : problem.supports->of(n))
      blocks_[particle] += weight * weight * held_[n].slope_n_per_m;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (problem.inverse_mass_per_kg[i] == 0)
      inverse_[i].setZero();
    else
      inverse_[i] = blocks_[i].inverse().cast<float>();
  }
}

void NewtonStep::bound_friction(const Problem& problem, std::span<const Vec3> x) {
  for (std::size_t n = 0; n < held_.size(); ++n)
    if (const PointConstraint& c = problem.constraints[n]; c.friction > 0)
      held_[n].friction_n = c.friction * std::max(0.0, -exerted(problem, n, x).force_n.dot(c.normal));
}

// Computes the stiffness of each held point once. A particle's stiffness is divided among the points that it carries.
void NewtonStep::stiffen(const Problem& problem) {
  if (held_.empty() || held_.front().stiffness_n_per_m > 0) return;
  carries_.assign(blocks_.size(), 0);
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (const auto& [particle, weight] : problem.supports->of(n)) carries_[particle] += std::abs(weight);
  for (std::size_t n = 0; n < held_.size(); ++n) {
    double compliance = 0, points = 0;
    for (const auto& [particle, weight] : problem.supports->of(n)) {
      if (problem.inverse_mass_per_kg[particle] > 0) compliance += 3 * weight * weight / blocks_[particle].trace();
      points += std::abs(weight) * carries_[particle];
    }
    if (compliance > 0) held_[n].stiffness_n_per_m = kPointOverOwn / (compliance * std::max(1.0, points));
  }
}

// ap <- (M / h^2 + K + points) p, without the rows of held particles.
void NewtonStep::multiply(const ElasticEnergy& energy, const Problem& problem) {
  const double per_s2 = 1 / (problem.step_s * problem.step_s);
  for (std::size_t i = 0; i < p_.size(); ++i) {
    const double inverse = problem.inverse_mass_per_kg[i];
    ap_[i] = inverse > 0 ? Vec4f(static_cast<float>(per_s2 / inverse) * p_[i]) : Vec4f(Vec4f::Zero());
  }
  energy.add_product(p_, ap_);
  for (std::size_t n = 0; n < held_.size(); ++n) {
    Vec3 moved = Vec3::Zero();
    for (const auto& [particle, weight] : problem.supports->of(n))
      moved += weight * p_[particle].head<3>().cast<double>();
    const Vec3 force = held_[n].slope_n_per_m * moved;
    for (const auto& [particle, weight] : problem.supports->of(n))
      ap_[particle].head<3>() += (weight * force).cast<float>();
  }
  for (std::size_t i = 0; i < p_.size(); ++i)
    if (problem.inverse_mass_per_kg[i] == 0) ap_[i].setZero();
}

// False when the Hessian isn't positive along a direction on the first one.
bool NewtonStep::find_direction(const ElasticEnergy& energy, const Problem& problem, double tolerance_n,
                                int& products) {
  const auto precondition = [&] {
    for (std::size_t i = 0; i < r_.size(); ++i) z_[i].head<3>() = inverse_[i] * r_[i].head<3>();
  };
  for (std::size_t i = 0; i < r_.size(); ++i) r_[i].head<3>() = force_[i].cast<float>();
  std::ranges::fill(dx_, Vec4f::Zero());
  precondition();
  p_ = z_;
  double rz = dot(r_, z_);
  for (int n = 0; n < kMostProducts && rz > 0; ++n) {
    multiply(energy, problem);
    ++products;
    const double pap = dot(p_, ap_);
    if (!(pap > 0)) return n > 0;
    const auto alpha = static_cast<float>(rz / pap);
    for (std::size_t i = 0; i < r_.size(); ++i) {
      dx_[i].head<3>() += alpha * p_[i].head<3>();
      r_[i].head<3>() -= alpha * ap_[i].head<3>();
    }
    if (std::sqrt(dot(r_, r_)) <= tolerance_n) break;
    precondition();
    const double next = dot(r_, z_);
    const auto beta = static_cast<float>(next / rz);
    rz = next;
    for (std::size_t i = 0; i < r_.size(); ++i) p_[i].head<3>() = z_[i].head<3>() + beta * p_[i].head<3>();
  }
  return true;
}

NewtonOutcome NewtonStep::solve(ElasticEnergy& energy, const Problem& problem, std::span<Vec3> x) {
  SECTIO_ASSERT(problem.supports || problem.constraints.empty(), "points have supports");
  NewtonOutcome outcome;
  held_.assign(problem.constraints.size(), {});
  force_.resize(x.size()), blocks_.resize(x.size()), inverse_.resize(x.size());
  for (auto* vectors : {&p_, &ap_, &r_, &z_, &dx_}) vectors->assign(x.size(), Vec4f::Zero());
  double weight_n = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (problem.inverse_mass_per_kg[i] > 0) weight_n += problem.mass_kg[i] * problem.mass_kg[i];
  weight_n = kStandardGravity_m_per_s2 * std::sqrt(weight_n);
  if (!(weight_n > 0)) return outcome.met = true, outcome;  // nothing can move
  bool linearised = false;
  if (!held_.empty()) linearise(energy, problem, x), linearised = true;
  bound_friction(problem, x);
  double left_n = forces(energy, problem, x);
  for (; outcome.iterations < kMostIterations && std::isfinite(left_n); ++outcome.iterations) {
    if (left_n <= (outcome.iterations == 0 ? kRests : kTolerance) * weight_n) break;
    if (!linearised || outcome.iterations > 0 || !held_.empty()) linearise(energy, problem, x);
    if (!find_direction(energy, problem, kInner * left_n, outcome.products)) break;
    const double before_j = objective_j(energy, problem, x);
    tried_.assign(x.begin(), x.end());
    double share = 1;
    bool better = false;
    for (int n = 0; n < kMostHalvings && !better; ++n, share /= 2) {
      for (std::size_t i = 0; i < x.size(); ++i) tried_[i] = x[i] + share * dx_[i].head<3>().cast<double>();
      better = objective_j(energy, problem, tried_) <= before_j + 1e-9 * std::abs(before_j);
    }
    if (!better) break;
    outcome.last_move_m = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      outcome.last_move_m = std::max(outcome.last_move_m, (tried_[i] - x[i]).norm());
    std::ranges::copy(tried_, x.begin());
    for (std::size_t n = 0; n < held_.size(); ++n) held_[n].force_n = exerted(problem, n, x).force_n;
    bound_friction(problem, x);
    left_n = forces(energy, problem, x);
  }
  outcome.residual = left_n / weight_n;
  outcome.met = left_n <= kTolerance * weight_n;
  return outcome;
}

void NewtonStep::finish(const Problem& problem, double step_s, std::span<const Vec4f> velocity_m_per_s,
                        std::span<Reaction> reactions) const {
  SECTIO_ASSERT(reactions.size() == held_.size(), "one reaction a constraint");
  for (std::size_t n = 0; n < held_.size(); ++n) {
    Vec3 velocity = Vec3::Zero();
    for (const auto& [particle, weight] : problem.supports->of(n))
      velocity += weight * velocity_m_per_s[particle].head<3>().cast<double>();
    const Vec3& force = held_[n].force_n;
    reactions[n] = {-force, !force.isZero(0), step_s * force.dot(velocity)};
  }
}

}  // namespace sectio
