// An implicit step by Newton's method with conjugate gradients, the driver that is stable at any step. It minimises
//
//   phi(x) = sum_i m_i |x_i - y_i|^2 / (2 h^2) + E(x) + points that instruments hold or press
//
// where y is the place that inertia and gravity alone would lead to. An iteration solves (M / h^2 + K) dx = - grad phi
// by conjugate gradients, preconditioned by the 3 x 3 blocks of the diagonal, and in long steps by the rigid motions of
// groups of particles as well (rigid_aggregates.h). K is the Hessian of E, made positive where a model knows how. An
// iteration is taken as it is when the slope of phi along it has fallen by half or turned no further than that; else it
// is halved while phi grows. Points are constraints by multipliers (method of
// Hestenes and Powell): a point has a force lambda and a stiffness k above that of the particles that carry it;
// after an iteration lambda <- P(lambda + k (target - point)), where P is what the constraint may exert: pushes only, a
// largest force. A push through a spring of compliance a is P((lambda + k (target - point)) / (1 + a k)). Friction
// holds a point to where the instrument takes it along, by no more than the coefficient times the push
// where the iteration begins. A point that the step solved before had, too, begins with the force that it bore there.
//
// The outcome says by force how far the state is from equilibrium. Positions are in double precision, products with K
// in single. Deterministic, one thread.
#pragma once

#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "common/math/types.h"
#include "sim_server/deformation/point_constraint.h"
#include "sim_server/deformation/rigid_aggregates.h"

namespace sectio {

// The elastic energy of a model. Spans have one entry a particle; entries of Vec4f are {x, y, z, scratch}.
class ElasticEnergy {
 public:
  virtual ~ElasticEnergy() = default;
  virtual double energy_j(std::span<const Vec3> position_world_m) = 0;
  // Adds - dE/dx.
  virtual void add_forces(std::span<const Vec3> position_world_m, std::span<Vec3> force_n) = 0;
  // The Hessian K for add_product() and add_blocks() is the one here from now on.
  virtual void linearise(std::span<const Vec3> position_world_m) = 0;
  // Adds K p; may write the fourth components of p.
  virtual void add_product(std::span<Vec4f> p_m, std::span<Vec4f> force_n) const = 0;
  virtual void add_blocks(std::span<Mat3> blocks_n_per_m) const = 0;
  // The rounding error of the forces, as a vector over all particles, once they have been computed.
  virtual double rounding_n() const { return 0; }

  // For the coarse levels of long steps: another number after each change of the particles (0: there are no levels),
  // how particles hang together, and the Hessian's shares in the blocks of groups.
  virtual std::uint64_t changes() const { return 0; }
  virtual ParticleGraph graph() const { return {}; }
  virtual void add_to(RigidAggregates& /*coarse*/) const {}
};

struct NewtonOutcome {
  bool met = false;        // the residual is below the tolerance
  double residual = 0;     // |force left over| over |weight|, both over all free particles
  double last_move_m = 0;  // the largest displacement in the last iteration
  int iterations = 0, products = 0;
};

class NewtonStep {
 public:
  static constexpr double kTolerance = 0.02;     // share of the residual
  static constexpr double kLongTolerance = 0.1;  // the same, for steps that are long by choice

  struct Problem {
    double step_s = 0;
    double tolerance = kTolerance;
    std::span<const double> mass_kg, inverse_mass_per_kg;  // effective; inverse 0: held where it is
    std::span<const Vec3> inertial_world_m;                // y
    std::span<const PointConstraint> constraints;
    const ConstraintSupports* supports = nullptr;  // the particles that carry the points
    std::span<const Vec3> taken_along_world_m;     // places to which each instrument would take its point
    // The best positions found with so many products with Hessians will have to do.
    int most_products = std::numeric_limits<int>::max();
  };

  using Point = std::pair<std::array<VertexId, 3>, std::array<double, 3>>;  // its corners and weights
  // The force on a point in the step that was solved before, which may be some steps ago.
  struct Borne {
    Point point;
    Vec3 force_n = Vec3::Zero();

    template <class A>
    void archive(A& a) {
      a(point.first, point.second, force_n);
    }
  };
  // In the order of points. solve() begins with these, finish() leaves those of its step.
  const std::vector<Borne>& borne() const { return borne_; }
  void begin_with(std::vector<Borne> borne) { borne_ = std::move(borne); }

  // Begins at the positions given and leaves the best ones found there.
  NewtonOutcome solve(ElasticEnergy& energy, const Problem& problem, std::span<Vec3> position_world_m);
  // The reactions of the constraints in the last solution, and the work of each on a point that moves with these
  // velocities.
  void finish(const Problem& problem, double step_s, std::span<const Vec4f> velocity_m_per_s,
              std::span<Reaction> reactions);

  template <class A>
  void archive(A& a) {
    a(borne_);
  }

 private:
  struct Held {
    Vec3 force_n = Vec3::Zero();   // lambda, on the tissue
    double stiffness_n_per_m = 0;  // k
    double friction_n = 0;         // largest friction
    Mat3 slope_n_per_m = Mat3::Zero();
  };
  // The force of a constraint on the tissue, its slope, and its share of phi.
  struct Exerted {
    Vec3 force_n = Vec3::Zero();
    Mat3 slope_n_per_m = Mat3::Zero();
    double energy_j = 0;
  };
  Exerted exerted(const Problem& problem, std::size_t constraint, std::span<const Vec3> x) const;
  void recall(const Problem& problem);
  void stiffen(const Problem& problem);
  void bound_friction(const Problem& problem, std::span<const Vec3> x);
  double objective_j(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x);
  double forces(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x);  // returns |r|
  double add_points(const Problem& problem, std::span<const Vec3> x);                     // adds to sums of forces()
  void linearise(ElasticEnergy& energy, const Problem& problem, std::span<const Vec3> x, bool with_groups);
  bool find_direction(const ElasticEnergy& energy, const Problem& problem, double tolerance_n, int& products);
  bool group(const ElasticEnergy& energy, std::span<const Vec3> x);
  void group_point(const Problem& problem, std::size_t constraint);
  void precondition();
  void multiply(const ElasticEnergy& energy, const Problem& problem);
  Vec3 at(const Problem& problem, std::size_t constraint, std::span<const Vec3> x) const;

  std::vector<Borne> borne_;
  std::vector<Held> held_;
  std::vector<double> carries_;                   // by particle: the points that it carries, by weight
  std::vector<Vec3> free_force_, force_, tried_;  // free: without the points
  std::vector<float> inertia_n_per_m_;            // m / h^2; 0: held
  std::vector<Mat3> blocks_;
  std::vector<std::array<Vec4f, 3>> inverse_;  // inverse blocks, by columns
  std::vector<Vec4f> p_, ap_, r_, z_, dx_;     // fourth components are 0, except in p_
  RigidAggregates coarse_;
  std::uint64_t grouped_ = 0;  // the energy's count of changes when particles were grouped
  bool is_grouped_ = false;    // in this step
};

}  // namespace sectio
