// One instrument of a simulation: its newest samples and its path in a step, its grasp, and the contact that its hand
// gets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim_server/haptics/contact_model_fitter.h"
#include "sim_server/world/grasp.h"
#include "sim_server/world/surface_under_tool.h"

namespace sectio {

struct Tool {
  Tool(std::uint32_t tool_id, const Scene& scene);

  // A step begins at the end of the last one; then come its samples, in order.
  void begin_step();
  void take(const ToolSample& sample);
  // It lets go and is kWithdrawn_m further back along its own axis, outside of everything, until it is free: then it
  // has no pose. False when it has none already, or a sample in this step. Its next sample brings it back, wherever its
  // hand is by then.
  bool withdraw();

  // The instrument's contact in this step, with the reaction of its grasp. It must have a pose.
  ContactStep contact(double sim_time_s) const;

  ContactModelFitter fitter;
  Grasp grasp;
  std::optional<JointPose> pose;  // pose of the newest sample
  bool force_is_capped = false;   // in the last step
  double time_s = 0;              // time stamp of the newest sample
  std::uint64_t source = 0;
  std::uint64_t sequence = 0;
  Vec3 velocity_m_per_s = Vec3::Zero();
  TipMotion tip;           // its motion as the hand's side knows it, too
  double sags_more_m = 0;  // the surface under it, above the undeformed one, than the surface around
  OwnDent own_dent;

  // The motion in this step.
  std::optional<JointPose> before;
  std::vector<JointPose> poses;
  bool continuous = true;
  bool arrives = false;  // it comes back into the scene, at its hand

  static constexpr double kWithdrawn_m = 10;
  bool is_withdrawn = false, comes_back = false;  // until the next sample

  template <class A>
  void archive(A& a) {
    a(fitter, grasp, pose, force_is_capped, time_s, source, sequence, velocity_m_per_s, tip, sags_more_m, own_dent,
      before, poses, continuous, arrives, is_withdrawn, comes_back);
  }

 private:
  Vec3 back_tool_;  // the direction from the tip to the handle, of length 1
};

}  // namespace sectio
