#include "sim_server/world/cut_resistance.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kNoEdge_m = 1e-7;  // a shorter one has no direction

}  // namespace

void CutResistance::release() {
  front_.release();
  force_n_.setZero();
}

void CutResistance::meet(Body& body, const InstrumentEdge& edge, const Pose& frame_world, bool loose) {
  const EdgeAtRest at_rest{frame_world.to_local(edge.tip_world_m()), frame_world.to_local(edge.heel_world_m())};
  if (loose || (at_rest.heel_m - at_rest.tip_m).norm() < kNoEdge_m) return release();
  std::optional<Vec3> sharp_side = edge.sharp_side_world();
  if (sharp_side) sharp_side = frame_world.orientation.conjugate() * *sharp_side;
  front_.move(body.swept_tissue(), at_rest, sharp_side, body.spec.material.toughness_j_per_m2);
  from_rest_ = frame_world.orientation;
  force_n_ = edge.kind().drag * (from_rest_ * front_.force_n());
  work_j_ += front_.work_j();  // a cautery hook's current does what the hand does not
}

void CutResistance::push_out(const Body& body, const InstrumentEdge& edge, const Vec3& point_world_m,
                             const Vec3& normal_world) {
  const InstrumentShape& shape = edge.shape();
  const double sunk_m = (point_world_m - edge.pose().to_world(shape.c_tool_m)).dot(normal_world);
  const double e_star_pa = body.spec.material.young_pa / (1 - std::pow(body.spec.material.poisson, 2));
  const double half_length_m = 0.5 * (shape.c_tool_m - shape.a_tool_m).norm();
  force_n_ = 2 * e_star_pa * half_length_m * std::max(0.0, sunk_m) * normal_world;
}

FeltFront CutResistance::front(const InstrumentKind& kind) const {
  return {kind.drag * front_.stiffness_n_per_m(), kind.drag * front_.strength_n(), from_rest_ * front_.ahead()};
}

}  // namespace sectio
