#include "sim_server/world/turning_gravity.h"

#include <algorithm>
#include <cmath>

#include "common/core/formatted.h"

namespace sectio {
namespace {

constexpr double kEarth_m_per_s2 = 9.81;
constexpr double kWeightless_m_per_s2 = 1e-9;  // it has no direction

}  // namespace

// In the plane of both: cos a = (1 - t^2) / (1 + t^2), sin a = 2 t / (1 + t^2) with t = tan(a / 2), near a / 2.
Vec3 turned_towards(const Vec3& now, const Vec3& target, double max_rad, double max_m_per_s2) {
  const double strength = now.norm(), wanted = target.norm();
  if (strength < kWeightless_m_per_s2 || wanted < kWeightless_m_per_s2) {
    const Vec3 missing = target - now;
    return missing.norm() <= max_m_per_s2 ? target : Vec3(now + max_m_per_s2 * missing.normalized());
  }
  const Vec3 u = now / strength, w = target / wanted;
  const double t = 0.5 * max_rad, cosine = (1 - t * t) / (1 + t * t), sine = 2 * t / (1 + t * t);
  Vec3 direction = w;
  if (u.dot(w) < cosine) {
    Vec3 across = w - u.dot(w) * u;
    across = across.norm() > 1e-9 ? Vec3(across.normalized()) : Vec3(u.unitOrthogonal());
    direction = (cosine * u + sine * across).normalized();
  }
  const double next = strength + std::clamp(wanted - strength, -max_m_per_s2, max_m_per_s2);
  return direction == w && next == wanted ? target : Vec3(next * direction);
}

TurningGravity::TurningGravity(const Scene& scene)
    : changes_(scene.gravity_changes),
      max_rad_(scene.gravity_turns_deg_per_s * M_PI / 180 * scene.step_s),
      max_m_per_s2_(kEarth_m_per_s2 * max_rad_),
      now_(scene.gravity_m_per_s2),
      target_(scene.gravity_m_per_s2) {}

bool TurningGravity::step(const StepInput& input, StepOutput& output) {
  std::optional<Vec3> asked;
  for (; next_ < changes_.size() && changes_[next_].at_s <= output.sim_time_s + 1e-9; ++next_)
    asked = changes_[next_].gravity_m_per_s2;
  if (input.gravity_m_per_s2) asked = input.gravity_m_per_s2;
  if (asked && *asked != target_) {
    target_ = *asked;
    const std::string text = formatted("to [%.3g, %.3g, %.3g] m/s2", target_.x(), target_.y(), target_.z());
    output.events.push_back({output.step, EventKind::gravity_turned, 0, 0, text});
  }
  const Vec3 before = now_;
  if (now_ != target_) now_ = turned_towards(now_, target_, max_rad_, max_m_per_s2_);
  output.gravity_m_per_s2 = now_;
  output.gravity_target_m_per_s2 = target_;
  return now_ != before;
}

}  // namespace sectio
