#include "common/math/contact_model.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kLongestWay_s = 0.25;  // time for which a plane goes on without news

}  // namespace

void TipMotion::go_on(double to_s, const Vec3& to_m) {
  const double dt = to_s - time_s;
  const Vec3 way_m = to_m - position_m;
  position_m = to_m;
  if (dt <= 0) return;
  time_s = to_s;
  const Vec3 faster = dt / (dt + kVelocityFilter_s) * (way_m / dt - velocity_m_per_s);
  velocity_m_per_s += faster;
  acceleration_m_per_s2 = faster / dt;
}

Dent dent_of(const ContactModel& model, const TipMotion& tip) {
  const Vec3& n = model.normal_world;
  const double age_s = std::clamp(tip.time_s - model.tool_time_s, 0.0, kLongestWay_s);
  Dent dent;
  dent.depth_m = -n.dot(tip.position_m - model.point_world_m - age_s * model.velocity_world_m_per_s);
  if (dent.depth_m <= 0) return dent;
  const bool is_soft = dent.depth_m < model.soft_depth_m;
  const double slope = is_soft ? std::sqrt(dent.depth_m / model.soft_depth_m) : 1;
  dent.spring_m = is_soft ? 2.0 / 3 * dent.depth_m * slope : dent.depth_m - model.soft_depth_m / 3;
  dent.damper_m_per_s = -slope * n.dot(tip.velocity_m_per_s - model.velocity_world_m_per_s);
  dent.mass_m_per_s2 = -slope * n.dot(tip.acceleration_m_per_s2);
  return dent;
}

}  // namespace sectio
