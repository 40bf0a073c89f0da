// An instrument that holds or presses a point of the surface. Projection, not a penalty: the point is put where the
// tool has it, and the force comes from the momentum that this took (methods: exact in equilibrium and stable at any
// step).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

// The point sum_a w_a x_a of a triangle (weights add up to 1; vertices differ).
// Two-sided: it is at target_world_m after the step, or as far on its way as the largest force brings it. Unilateral:
// it is not further out along `normal` (unit, out of the tissue) than the target; only motion along the normal is
// constrained, and the tissue is never pulled. One that sticks is at the target as long as the tissue presses against
// it; one that stops leaves what it moved without velocity.
struct PointConstraint {
  std::array<VertexId, 3> v{kNone, kNone, kNone};  // kNone: unused, weight 0
  std::array<double, 3> w{0, 0, 0};
  Vec3 target_world_m = Vec3::Zero();
  bool unilateral = false;
  bool sticks = false;
  bool stops = false;
  double largest_force_n = std::numeric_limits<double>::infinity();  // of a two-sided one
  Vec3 normal = Vec3::UnitZ();
  std::uint32_t source = 0;  // whose it is; its reaction is for the same
};

// One vertex, put at one place for one step.
inline PointConstraint hold(VertexId v, const Vec3& at_world_m) {
  PointConstraint constraint;
  constraint.v[0] = v;
  constraint.w[0] = 1;
  constraint.target_world_m = at_world_m;
  return constraint;
}

struct Reaction {
  Vec3 force_on_tool_n = Vec3::Zero();  // - sum m_i dx_i / h^2
  bool active = false;                  // the constraint moved something
  double work_j = 0;                    // of the tool: its force times the way of the point in this step
};

// What carries a constraint's point: the corners of its triangle, or, where vertices ride on nodes, the nodes.
class ConstraintSupports {
 public:
  struct Share {
    std::uint32_t particle;
    double weight;
  };

  void clear() { shares_.clear(), first_.assign(1, 0); }
  // To the constraint after the last one finished; shares of one particle are one.
  void add(std::uint32_t particle, double weight);
  void finish() { first_.push_back(shares_.size()); }
  std::span<const Share> of(std::size_t constraint) const {
    return {shares_.data() + first_[constraint], first_[constraint + 1] - first_[constraint]};
  }

 private:
  std::vector<Share> shares_;
  std::vector<std::size_t> first_{0};
};
void corners_of(std::span<const PointConstraint> constraints, ConstraintSupports& supports);

// Gauss-Seidel over the constraints in their order, kSweeps times; inverse masses per particle, 0 for one that is held.
// Writes positions, velocities (+ dx / h) and one reaction a constraint. No allocation.
void project(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const double> inverse_mass, double step_s, std::span<Vec4f> position_world_m,
             std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions);

// The particles are the vertices.
void project(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass, double step_s,
             std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions);

}  // namespace sectio
