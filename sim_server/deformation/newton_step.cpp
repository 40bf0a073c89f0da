#include "sim_server/deformation/newton_step.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr int kMostIterations = 8, kMostProducts = 400, kMostHalvings = 8;
constexpr double kInner = 0.01;       // share of the residual that conjugate gradients may leave,
constexpr double kLongInner = 0.03;   // in long steps,
constexpr double kBelow = 0.3;        // and needn't go further below the tolerance than this
constexpr double kStiffer = 250;      // diagonal over inertia from which groups pay
constexpr double kSlope = 0.5;        // a slope that has turned by no more than this is taken for a smaller objective
constexpr double kRests = 1e-4;       // a residual below this share of the weight needs no iteration
constexpr double kPointOverOwn = 50;  // stiffness of a held point over that of its particles,
constexpr double kResting = 3;        // and of one that may come off, and has no spring: stiffer ones do so in turns

double dot(std::span<const Vec4f> a, std::span<const Vec4f> b) {
  constexpr std::size_t kInFloat = 32;
  Eigen::Array4d sum = Eigen::Array4d::Zero();
  for (std::size_t from = 0; from < a.size(); from += kInFloat) {
    Eigen::Array4f part = Eigen::Array4f::Zero();
    for (std::size_t i = from; i < std::min(a.size(), from + kInFloat); ++i) part += a[i].array() * b[i].array();
    sum += part.cast<double>();
  }
  return sum.head<3>().sum();
}

double dot(std::span<const Vec3> a, std::span<const Vec4f> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i].head<3>().cast<double>());
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

NewtonStep::Point point_of(const PointConstraint& c) {
  return {c.v, c.w};
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
  const double rub_n_per_m = c.springs_along ? 1 / c.compliance_m_per_n : k;
  const Vec3 to_world_m = c.springs_along ? c.target_world_m : problem.taken_along_world_m[n];
  const Vec3 rub = along * (rub_n_per_m * (to_world_m - point));
  Mat3 slope;
  const Vec3 rubbing = at_most(h.friction_n, rub, along, slope);
  e.force_n += rubbing;
  e.energy_j += share_j(rub, rubbing, rub_n_per_m);
  e.slope_n_per_m += rub_n_per_m * slope;
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
  std::ranges::fill(free_force_, Vec3::Zero());
  energy.add_forces(x, free_force_);
  const double per_s2 = 1 / (problem.step_s * problem.step_s);
  for (std::size_t i = 0; i < x.size(); ++i)
    if (const double inverse = problem.inverse_mass_per_kg[i]; inverse > 0)
      free_force_[i] += per_s2 / inverse * (problem.inertial_world_m[i] - x[i]);
  return add_points(problem, x);
}

double NewtonStep::add_points(const Problem& problem, std::span<const Vec3> x) {
  std::ranges::copy(free_force_, force_.begin());
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Exerted on_tissue = exerted(problem, n, x);
    held_[n].slope_n_per_m = on_tissue.slope_n_per_m;
    for (const auto& [particle, weight] : problem.supports->of(n)) force_[particle] += weight * on_tissue.force_n;
  }
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (problem.inverse_mass_per_kg[i] == 0) force_[i].setZero();
    sum += force_[i].squaredNorm();
  }
  return std::sqrt(sum);
}

void NewtonStep::linearise(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x, bool with_groups) {
  energy.linearise(x);
  std::ranges::fill(blocks_, Mat3::Zero());
  energy.add_blocks(blocks_);
  double stiffness = 0, inertia = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double own = double{inertia_n_per_m_[i]};
    if (own == 0) continue;
    stiffness += blocks_[i].trace() / 3;
    inertia += own;
    blocks_[i].diagonal().array() += own;
  }
  stiffen(problem);
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (const auto& [particle, weight] : problem.supports->of(n))
      blocks_[particle] += weight * weight * held_[n].slope_n_per_m;
  for (std::size_t i = 0; i < x.size(); ++i) {
    inverse_[i].fill(Vec4f::Zero());
    if (inertia_n_per_m_[i] == 0) continue;
    const Eigen::Matrix3f inverse = blocks_[i].cast<float>().inverse();
    for (int k = 0; k < 3; ++k) inverse_[i][static_cast<std::size_t>(k)].head<3>() = inverse.col(k);
  }
  const bool pays = with_groups && energy.changes() != 0 && stiffness > kStiffer * inertia;
  const bool was_grouped = is_grouped_;
  is_grouped_ = pays && (was_grouped || group(energy, x));
  if (!is_grouped_ || (was_grouped && held_.empty())) return;  // the matrix of the step's first iteration will do
  if (was_grouped) coarse_.begin_with_kept();                  // the tissue's share of it will do; points come and go
  for (std::size_t n = 0; n < held_.size(); ++n) group_point(problem, n);
  coarse_.finish();
}

// The share of a point: by each group, how the point moves.
void NewtonStep::group_point(const Problem& problem, std::size_t n) {
  using Modes = Eigen::Matrix<float, 3, 6>;
  std::vector<std::pair<std::uint32_t, Modes>> moves;
  for (const auto& [particle, weight] : problem.supports->of(n)) {
    const std::uint32_t group = coarse_.group(particle);
    if (group == RigidAggregates::kNoGroup) continue;
    auto to = std::ranges::find(moves, group, &std::pair<std::uint32_t, Modes>::first);
    if (to == moves.end()) to = moves.insert(to, {group, Modes::Zero()});
    const Vec4f& r = coarse_.arm(particle);
    Modes at;
    at << 1, 0, 0, 0, r.z(), -r.y(), 0, 1, 0, -r.z(), 0, r.x(), 0, 0, 1, r.y(), -r.x(), 0;
    to->second += static_cast<float>(weight) * at;
  }
  const Eigen::Matrix3f slope = held_[n].slope_n_per_m.cast<float>();
  for (const auto& [a, by_a] : moves)
    for (const auto& [b, by_b] : moves)
      if (RigidAggregates::Mat6f* const block = a <= b ? coarse_.block(a, b) : nullptr)
        *block += by_a.transpose() * slope * by_b;
}

// The matrix of the coarse levels, without points. False when there are no groups.
bool NewtonStep::group(const ElasticEnergy& energy, std::span<const Vec3> x) {
  if (grouped_ != energy.changes()) {
    grouped_ = energy.changes();
    coarse_.divide(energy.graph());
  }
  if (coarse_.empty()) return false;
  coarse_.begin(x);
  energy.add_to(coarse_);
  for (std::uint32_t i = 0; i < x.size(); ++i) {
    if (coarse_.group(i) == RigidAggregates::kNoGroup) continue;
    RigidAggregates::Mat6f& block = *coarse_.block(coarse_.group(i), coarse_.group(i));
    const Vec3f r = coarse_.arm(i).head<3>();
    const float m = inertia_n_per_m_[i];
    block.diagonal().head<3>().array() += m;
    block.bottomRightCorner<3, 3>() -= m * r * r.transpose();
    block.diagonal().tail<3>().array() += m * r.squaredNorm();
    const Eigen::Matrix3f arm = cross_matrix(r);
    block.bottomLeftCorner<3, 3>() += m * arm;
    block.topRightCorner<3, 3>() -= m * arm;
  }
  if (!held_.empty()) coarse_.keep();
  return true;
}

void NewtonStep::bound_friction(const Problem& problem, std::span<const Vec3> x) {
  for (std::size_t n = 0; n < held_.size(); ++n)
    if (const PointConstraint& c = problem.constraints[n]; c.friction > 0)
      held_[n].friction_n = c.friction * std::max(0.0, -exerted(problem, n, x).force_n.dot(c.normal));
}

void NewtonStep::recall(const Problem& problem) {
  held_.assign(problem.constraints.size(), {});
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const auto of = point_of(problem.constraints[n]);
    const auto known = std::ranges::lower_bound(borne_, of, {}, &Borne::point);
    if (known != borne_.end() && known->point == of) held_[n].force_n = known->force_n;
  }
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
    const PointConstraint& c = problem.constraints[n];
    const double over_own = c.unilateral && c.compliance_m_per_n == 0 ? kResting : kPointOverOwn;
    if (compliance > 0) held_[n].stiffness_n_per_m = over_own / (compliance * std::max(1.0, points));
  }
}

// ap <- (M / h^2 + K + points) p, without the rows of held particles.
void NewtonStep::multiply(const ElasticEnergy& energy, const Problem& problem) {
  for (std::size_t i = 0; i < p_.size(); ++i) ap_[i] = inertia_n_per_m_[i] * p_[i];
  energy.add_product(p_, ap_);
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Vec3 moved = carried(problem.supports->of(n), p_);
    const Vec3 force = held_[n].slope_n_per_m * moved;
    for (const auto& [particle, weight] : problem.supports->of(n))
      ap_[particle].head<3>() += (weight * force).cast<float>();
  }
  for (std::size_t i = 0; i < p_.size(); ++i) {
    ap_[i].w() = p_[i].w() = 0;
    if (inertia_n_per_m_[i] == 0) ap_[i].setZero();
  }
}

void NewtonStep::precondition() {
  for (std::size_t i = 0; i < r_.size(); ++i) {
    const auto& [x, y, z] = inverse_[i];
    z_[i] = r_[i].x() * x + r_[i].y() * y + r_[i].z() * z;
  }
  if (is_grouped_) coarse_.add_correction(r_, z_);
}

// False when the Hessian isn't positive along a direction on the first one.
bool NewtonStep::find_direction(const ElasticEnergy& energy, const Problem& problem, double tolerance_n,
                                int& products) {
  for (std::size_t i = 0; i < r_.size(); ++i) r_[i].head<3>() = force_[i].cast<float>();
  std::ranges::fill(dx_, Vec4f::Zero());
  precondition();
  p_ = z_;
  double rz = dot(r_, z_);
  const int most = std::min(kMostProducts, problem.most_products - products);
  for (int n = 0; n < most && rz > 0; ++n) {
    multiply(energy, problem);
    ++products;
    const double pap = dot(p_, ap_);
    if (!(pap > 0)) return n > 0;
    const auto alpha = static_cast<float>(rz / pap);
    for (std::size_t i = 0; i < r_.size(); ++i) {
      dx_[i] += alpha * p_[i];
      r_[i] -= alpha * ap_[i];
    }
    if (std::sqrt(dot(r_, r_)) <= tolerance_n) break;
    precondition();
    const double next = dot(r_, z_);
    const auto beta = static_cast<float>(next / rz);
    rz = next;
    for (std::size_t i = 0; i < r_.size(); ++i) p_[i] = z_[i] + beta * p_[i];
  }
  return true;
}

NewtonOutcome NewtonStep::solve(ElasticEnergy& energy, const Problem& problem, std::span<Vec3> x) {
  SECTIO_ASSERT(problem.supports || problem.constraints.empty(), "points have supports");
  NewtonOutcome outcome;
  recall(problem);
  free_force_.resize(x.size()), force_.resize(x.size()), blocks_.resize(x.size()), inverse_.resize(x.size());
  for (auto* vectors : {&p_, &ap_, &r_, &z_, &dx_}) vectors->assign(x.size(), Vec4f::Zero());
  inertia_n_per_m_.assign(x.size(), 0);
  double weight_n = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double inverse = problem.inverse_mass_per_kg[i];
    if (!(inverse > 0)) continue;
    weight_n += problem.mass_kg[i] * problem.mass_kg[i];
    inertia_n_per_m_[i] = static_cast<float>(1 / (problem.step_s * problem.step_s * inverse));
  }
  weight_n = kStandardGravity_m_per_s2 * std::sqrt(weight_n);
  if (!(weight_n > 0)) return outcome.met = true, outcome;  // nothing can move
  bool linearised = is_grouped_ = false;
  if (!held_.empty()) linearise(energy, problem, x, false), linearised = true;  // for the stiffness of points
  bound_friction(problem, x);
  double left_n = forces(energy, problem, x);
  const double rounding_n = energy.rounding_n(), enough_n = std::max(problem.tolerance * weight_n, 3 * rounding_n);
  const bool is_long = problem.tolerance > kTolerance;
  const auto may_go_on = [&] {
    return outcome.iterations < kMostIterations && outcome.products < problem.most_products && std::isfinite(left_n);
  };
  for (; may_go_on(); ++outcome.iterations) {
    if (left_n <= (outcome.iterations == 0 ? std::max(kRests * weight_n, rounding_n) : enough_n)) break;
    if (!linearised || outcome.iterations > 0 || !held_.empty()) linearise(energy, problem, x, true);
    const double inner_n =
        is_long ? std::min(kBelow * left_n, std::max(kLongInner * left_n, kBelow * enough_n)) : kInner * left_n;
    if (!find_direction(energy, problem, inner_n, outcome.products)) break;
    tried_.assign(x.begin(), x.end());
    const auto try_share = [&](double share) {
      for (std::size_t i = 0; i < x.size(); ++i) tried_[i] = x[i] + share * dx_[i].head<3>().cast<double>();
    };
    const double slope_n_m = dot(force_, dx_);
    try_share(1);
    left_n = forces(energy, problem, tried_);
    bool better = std::isfinite(left_n) && dot(force_, dx_) >= -kSlope * slope_n_m;
    if (!better) {
      const double before_j = objective_j(energy, problem, x);
      double share = 1;
      for (int n = 0; n < kMostHalvings && !better; ++n, share /= 2) {
        try_share(share);
        better = objective_j(energy, problem, tried_) <= before_j + 1e-9 * std::abs(before_j);
      }
      left_n = forces(energy, problem, better ? std::span<const Vec3>(tried_) : x);
      if (!better) break;
    }
    outcome.last_move_m = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      outcome.last_move_m = std::max(outcome.last_move_m, (tried_[i] - x[i]).norm());
    std::ranges::copy(tried_, x.begin());
    if (held_.empty()) continue;
    for (std::size_t n = 0; n < held_.size(); ++n) held_[n].force_n = exerted(problem, n, x).force_n;
    bound_friction(problem, x);
    left_n = add_points(problem, x);
  }
  outcome.residual = left_n / weight_n;
  outcome.met = left_n <= enough_n;
  return outcome;
}

void NewtonStep::finish(const Problem& problem, double step_s, std::span<const Vec4f> velocity_m_per_s,
                        std::span<Reaction> reactions) {
  SECTIO_ASSERT(reactions.size() == held_.size(), "one reaction a constraint");
  borne_.clear();
  for (std::size_t n = 0; n < held_.size(); ++n) {
    const Vec3 velocity = carried(problem.supports->of(n), velocity_m_per_s);
    if (held_[n].stiffness_n_per_m == 0) {
      reactions[n] = reaction_of_wall(problem.constraints[n], at(problem, n, problem.inertial_world_m));
      continue;
    }
    const Vec3& force = held_[n].force_n;
    borne_.push_back({point_of(problem.constraints[n]), force});
    reactions[n] = {-force, !force.isZero(0), step_s * force.dot(velocity)};
  }
  std::ranges::stable_sort(borne_, {}, &Borne::point);
}

}  // namespace sectio
