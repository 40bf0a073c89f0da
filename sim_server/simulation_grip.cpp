#include "sim_server/simulation_grip.h"

#include <utility>

namespace sectio {
namespace {

constexpr double kBetweenJawsM = 0.0015;  // a surface this close to the tips is between them
constexpr double kJawM = 0.003;           // how far apart the points are by which jaws hold
constexpr double kSlipsM = 0.003;         // a point pulled this far away is lost

// In the frame of the tool.
std::array<Vec3, SimulationGrip::kPoints> points_of_jaws_m(const ToolGeometry& g) {
  const Vec3 up = (g.c_tool_m - g.a_tool_m).stableNormalized(), aside = up.unitOrthogonal();
  return {g.a_tool_m + kJawM * up, g.a_tool_m + kJawM * aside, g.a_tool_m + kJawM * up.cross(aside)};
}

}  // namespace

SimulationGrip::SimulationGrip(const ToolSpec& tool)
    : instrument_(instrument_of(tool.kind)), geometry_(tool.geometry) {}

void SimulationGrip::close_about(const JointPose& pose, std::span<const std::unique_ptr<SimulationBody>> bodies) {
  const Vec3 tips = pose.to_world(geometry_.a_tool_m);
  double nearest_m = kBetweenJawsM;
  for (const auto& body : bodies) {
    if (!body->rigid || body->frozen) continue;
    const auto closest = body->tree().closest(body->view(), tips, kBetweenJawsM);
    const double distance_m = body->tree().inside(body->view(), tips) ? 0
                              : closest                               ? closest->distance_m
                                                                      : kBetweenJawsM;
    if (distance_m >= nearest_m) continue;
    nearest_m = distance_m;
    held_ = body->id;
    const Pose& piece = body->rigid->body.pose_world();
    const std::array<Vec3, SimulationGrip::kPoints> points = points_of_jaws_m(geometry_);
    for (std::size_t i = 0; i < points.size(); ++i)
      at_piece_m_[i] = piece.orientation.conjugate() * (pose.to_world(points[i]) - piece.position_m);
  }
}

void SimulationGrip::follow(const JointPose& pose, std::span<const std::unique_ptr<SimulationBody>> bodies,
                            std::vector<Grip>& grips) {
  if (!(instrument_.grip_below_rad > 0)) return;
  const bool was_open = std::exchange(open_, pose.opening_rad >= instrument_.grip_below_rad);
  if (open_ || (held_ && bodies[*held_]->frozen)) held_.reset();
  if (was_open && !open_) close_about(pose, bodies);
  if (!held_) return;
  const Pose& piece = bodies[*held_]->rigid->body.pose_world();
  const std::array<Vec3, SimulationGrip::kPoints> points = points_of_jaws_m(geometry_);
  Vec3 off = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    grips.push_back({*held_, piece.to_world(at_piece_m_[i]), pose.to_world(points[i]),
                     instrument_.grip_force_n / static_cast<double>(points.size())});
    off += (grips.back().to_world_m - grips.back().point_world_m) / static_cast<double>(points.size());
  }
  if (off.norm() <= kSlipsM) return;
  held_.reset();
  grips.resize(grips.size() - points.size());
}

}  // namespace sectio
