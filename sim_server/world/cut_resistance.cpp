#include "sim_server/world/cut_resistance.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sectio {
namespace {

constexpr double kNoEdge_m = 1e-7;  // a shorter one has no direction

}  // namespace

void CutResistance::release() {
  front_.release();
  force_n_.setZero();
  frame_world_.reset();
  frame_before_world_.reset();
}

void CutResistance::begin_step(double step_s) {
  front_.begin_step(step_s);
  force_n_.setZero();
  frame_before_world_ = std::exchange(frame_world_, std::nullopt);
}

void CutResistance::meet(Body& body, const InstrumentEdge& edge, const Pose& frame_world, VertexId near, bool loose) {
  const auto rest = [&](const EdgeAtRest& at_world_m) -> EdgeAtRest {
    return {frame_world.to_local(at_world_m.tip_m), frame_world.to_local(at_world_m.heel_m)};
  };
  const EdgeAtRest now_world_m{edge.tip_world_m(), edge.heel_world_m()}, at_rest = rest(now_world_m);
  if (loose || (at_rest.heel_m - at_rest.tip_m).norm() < kNoEdge_m) return release();
  std::optional<Vec3> sharp_side = edge.sharp_side_world();
  if (sharp_side) sharp_side = frame_world.orientation.conjugate() * *sharp_side;
  if (std::exchange(near_, near) != near) {
    front_.is_at(rest(edge_world_m_));
    frame_before_world_.reset();
  }
  edge_world_m_ = now_world_m;
  front_.move(body.swept_tissue(), at_rest, sharp_side, body.spec.material.toughness_j_per_m2);
  frame_world_ = frame_world;
  edge_middle_rest_m_ = at_rest.at(0.5);
  force_n_ = edge.kind().drag * (frame_world.orientation * front_.force_n());
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

FeltFront CutResistance::front(const InstrumentKind& kind, double step_s) const {
  if (!frame_world_) return {};
  FeltFront front{kind.drag * front_.stiffness_n_per_m(), kind.drag * front_.strength_n(),
                  frame_world_->orientation * front_.ahead()};
  if (frame_before_world_)
    front.velocity_world_m_per_s =
        (frame_world_->to_world(edge_middle_rest_m_) - frame_before_world_->to_world(edge_middle_rest_m_)) / step_s;
  return front;
}

}  // namespace sectio
