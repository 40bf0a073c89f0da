// An instrument holds or presses a point of the surface. The constraint is enforced by projection, not by a penalty:
// the point is put where the tool has it, and the reaction is the impulse that this takes over the step. The reaction
// is exact in equilibrium, and the projection is stable at any step.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

constexpr double kFastestHand_m_per_s = 1;  // an instrument drives tissue no faster; no surgeon's hand is faster

// Constrains the point sum_a w_a x_a of a triangle (weights add up to 1; vertices differ). A two-sided constraint
// puts the point at target_world_m after the step, or as near as its largest force allows. A unilateral one keeps
// the point from lying further out along `normal` (unit, out of the tissue) than the target; it never pulls. It may
// have a spring in series, and friction, by which it takes the point along with the instrument. A constraint that
// sticks holds the point at the target as long as the tissue presses against it.
struct PointConstraint {
  std::array<VertexId, 3> v{kNone, kNone, kNone};  // kNone: unused, weight 0
  std::array<double, 3> w{0, 0, 0};
  Vec3 point_world_m = Vec3::Zero();  // for a body that moves as a whole: the point itself, when no vertices are named
  Vec3 target_world_m = Vec3::Zero();
  Vec3 target_velocity_m_per_s = Vec3::Zero();  // velocity of the pressing instrument, which tissue rubs against
  bool unilateral = false;
  bool sticks = false;
  double largest_force_n = std::numeric_limits<double>::infinity();  // largest force of a two-sided constraint
  // A spring between point and target, which gives way by so much at most: of a unilateral constraint that does not
  // stick, or of a two-sided one on a body that moves as a whole, up to its largest force.
  double compliance_m_per_n = 0, gives_most_m = std::numeric_limits<double>::infinity();
  bool is_ahead = false;       // ahead of an instrument's tip, rather than beside its shaft
  double friction = 0;         // Coulomb's coefficient of such a constraint
  bool springs_along = false;  // friction is a spring of the same compliance, which draws the point to the target
  Vec3 normal = Vec3::UnitZ();
  std::uint32_t source = 0;  // number of the owner, which gets the reaction

  template <class A>
  void archive(A& a) {
    a(v, w, point_world_m, target_world_m, target_velocity_m_per_s, unilateral, sticks, largest_force_n,
      compliance_m_per_n, gives_most_m, is_ahead, friction, springs_along, normal, source);
  }
};

// Puts one vertex at one place for one step.
inline PointConstraint hold(VertexId v, const Vec3& at_world_m) {
  PointConstraint constraint;
  constraint.v[0] = v;
  constraint.w[0] = 1;
  constraint.target_world_m = at_world_m;
  return constraint;
}

// The same, but towards that place no faster than an instrument drives tissue.
inline PointConstraint drag(VertexId v, const Vec3& from_world_m, const Vec3& to_world_m, double step_s) {
  const Vec3 way = to_world_m - from_world_m;
  const double furthest_m = kFastestHand_m_per_s * step_s;
  return hold(v, from_world_m + std::min(1.0, furthest_m / std::max(way.norm(), furthest_m)) * way);
}

// Stiffness of tissue that can't move, in series with what gives way: about as much as a device can render.
constexpr double kWall_n_per_m = 2000;

struct Reaction {
  Vec3 force_on_tool_n = Vec3::Zero();  // - sum m_i dx_i / h^2
  bool active = false;                  // the constraint moved something
  double work_j = 0;                    // by the tool: its force times the displacement of the point in this step
  bool is_known = true;                 // false: the step was not solved, and says nothing of the force
};

// The force at a point that can't move, when something presses it.
Reaction reaction_of_wall(const PointConstraint& constraint, const Vec3& point_world_m);

// The particles that carry the point of each constraint, with weights: the corners of its triangle, or the nodes of a
// lattice that these corners are embedded in.
class ConstraintSupports {
 public:
  struct Share {
    std::uint32_t particle;
    double weight;
  };

  void clear() { shares_.clear(), first_.assign(1, 0); }
  // Adds to the constraint that finish() has not closed yet; weights of the same particle are added up.
  void add(std::uint32_t particle, double weight);
  void finish() { first_.push_back(shares_.size()); }
  std::span<const Share> of(std::size_t constraint) const {
    return {shares_.data() + first_[constraint], first_[constraint + 1] - first_[constraint]};
  }

 private:
  std::vector<Share> shares_;
  std::vector<std::size_t> first_{0};
};
// The place of a constraint's point, or its velocity, from those of the particles.
inline Vec3 carried(std::span<const ConstraintSupports::Share> by, std::span<const Vec4f> of_particles) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [particle, weight] : by) sum += weight * of_particles[particle].head<3>().cast<double>();
  return sum;
}
void corners_of(std::span<const PointConstraint> constraints, ConstraintSupports& supports);

// Projected Gauss-Seidel over the constraints in their order; one inverse mass a particle, 0 for a fixed one. Writes
// positions, velocities (+ dx / h) and one reaction a constraint. Allocates nothing after the first steps.
void project(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const double> inverse_mass, double step_s, std::span<Vec4f> position_world_m,
             std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions);

// The same for particles that are the vertices.
void project(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass, double step_s,
             std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions);

}  // namespace sectio
