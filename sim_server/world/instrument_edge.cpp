#include "sim_server/world/instrument_edge.h"

namespace sectio {

InstrumentEdge::InstrumentEdge(std::uint32_t id, const ToolSpec& tool, std::size_t number)
    : id_(id),
      kind_(&instrument_of(tool.kind)),
      geometry_(tool.geometry),
      state_{tool.intensity, 0, number},
      largest_force_n_(tool.largest_force_n),
      shape_(kind_->shape(geometry_, state_)) {}

InstrumentEdge InstrumentEdge::at(const JointPose& pose) const {
  InstrumentEdge moved = *this;
  moved.pose_ = pose;
  moved.state_.opening_rad = pose.opening_rad;
  moved.shape_ = kind_->shape(geometry_, moved.state_);
  return moved;
}

InstrumentEdge InstrumentEdge::closing_from(double opening_rad) const {
  InstrumentEdge same = *this;
  same.state_.closes_from_rad = opening_rad;
  return same.at(pose_);
}

bool InstrumentEdge::is_blunt() const {
  return (shape_.edge_tip_tool_m - shape_.edge_heel_tool_m).isZero();
}

std::optional<Vec3> InstrumentEdge::sharp_side_world() const {
  if (!shape_.sharp_side_tool) return {};
  return pose_.orientation * *shape_.sharp_side_tool;
}

ToolCorners InstrumentEdge::corners() const {
  return {{pose_.to_world(shape_.a_tool_m), pose_.to_world(shape_.b_tool_m), pose_.to_world(shape_.c_tool_m),
           pose_.to_world(shape_.d_tool_m)}};
}

Blade InstrumentEdge::blade() const {
  const EdgeInWorld edge = edge_at(shape_, pose_);
  Blade blade;
  blade.tip_world_m = edge.tip_world_m;
  blade.up_world = edge.up_world;
  blade.length_m = length_m();
  return blade;
}

}  // namespace sectio
