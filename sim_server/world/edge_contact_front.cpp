// The front of a cut, which holds an edge in the tissue.
#include "sim_server/world/edge_contact.h"

namespace sectio {
namespace {

constexpr double kNoEdge_m = 1e-7;  // a shorter one has no direction

}  // namespace

FeltFront EdgeContact::front() const {
  if (phase_ != Phase::cutting) return {};
  return {instrument_.drag * front_.stiffness_n_per_m(), instrument_.drag * front_.strength_n(),
          front_frame_ * front_.ahead()};
}

// Whether or not the mesh follows the edge in this step. Loose: open blades hold no tissue.
void EdgeContact::meet_front(const InstrumentShape& shape, const JointPose& pose, const Pose& frame_world, bool loose) {
  const EdgeAtRest edge{frame_world.to_local(pose.to_world(shape.edge_tip_tool_m)),
                        frame_world.to_local(pose.to_world(shape.edge_heel_tool_m))};
  if (loose || (edge.heel_m - edge.tip_m).norm() < kNoEdge_m) {
    front_.release();
    cutting_force_n_.setZero();
    return;
  }
  std::optional<Vec3> sharp_side;
  if (shape.sharp_side_tool)
    sharp_side = frame_world.orientation.conjugate() * (pose.orientation * *shape.sharp_side_tool);
  front_.move(body_.swept_tissue(), edge, sharp_side, body_.spec.material.toughness_j_per_m2);
  front_frame_ = frame_world.orientation;
  cutting_force_n_ = instrument_.drag * (front_frame_ * front_.force_n());
  cutting_work_j_ += front_.work_j();  // of a cautery hook: the current does what the hand does not
}

}  // namespace sectio
