#include "sim_server/world/tool.h"

#include <utility>

namespace sectio {

Tool::Tool(std::uint32_t tool_id, const Scene& scene) : fitter(tool_id), grasp(scene.tools[tool_id]) {
  const ToolGeometry& g = scene.tools[tool_id].geometry;
  back_tool_ =
      (g.b_tool_m - g.a_tool_m).squaredNorm() > 0 ? Vec3((g.b_tool_m - g.a_tool_m).normalized()) : Vec3::UnitZ();
}

void Tool::begin_step() {
  before = pose;
  poses.clear();
  continuous = true;
  arrives = false;
}

bool Tool::withdraw() {
  comes_back |= poses.empty();
  if (!pose || is_withdrawn || !poses.empty()) return false;
  grasp.withdraw();
  pose->position_m += kWithdrawn_m * (pose->orientation * back_tool_);
  poses.push_back(*pose);
  continuous = false;
  velocity_m_per_s.setZero();
  is_withdrawn = true;
  return true;
}

void Tool::take(const ToolSample& sample) {
  if (is_withdrawn) pose.reset(), before.reset(), is_withdrawn = false;
  const bool same_source = pose && sample.source == source;
  if (pose && !(same_source && sample.sequence == sequence + 1)) continuous = false;
  if (same_source && sample.tool_time_s > time_s)
    velocity_m_per_s = (sample.pose_world.position_m - pose->position_m) / (sample.tool_time_s - time_s);
  if (same_source)
    tip.go_on(sample.tool_time_s, sample.pose_world.position_m);
  else  // another source has another clock
    velocity_m_per_s.setZero(), tip = {sample.tool_time_s, sample.pose_world.position_m, Vec3::Zero(), Vec3::Zero()};
  pose = JointPose{sample.pose_world, sample.opening_rad};
  source = sample.source;
  sequence = sample.sequence;
  time_s = sample.tool_time_s;
  if (before || !poses.empty())
    poses.push_back(*pose);
  else
    before = pose, arrives = std::exchange(comes_back, false);  // the first one of all: it has not moved yet
}

ContactStep Tool::contact(double sim_time_s) const {
  ContactStep step;
  step.reaction_world_n = grasp.force_on_tool_n();
  if (grasp.holds_something()) {
    step.state = ContactState::held;
    step.grip = {grasp.stiffness_n_per_m(), grasp.largest_force_n(), grasp.velocity_m_per_s(), grasp.holds_tissue()};
  }
  step.sim_time_s = sim_time_s;
  step.tip = tip;
  step.tip.position_m = pose->position_m;
  return step;
}

}  // namespace sectio
