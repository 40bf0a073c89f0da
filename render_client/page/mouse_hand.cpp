#include "render_client/page/mouse_hand.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sectio {

namespace {

constexpr double kMostJump_m = 0.03;  // along the line of sight, from one contact to the next of the same stroke

Vec3 across(const Vec3& v, const Vec3& normal) {
  return v - v.dot(normal) * normal;
}

}  // namespace

// Skin that is seen from outside, and isn't far before or behind the plane through the last contact; else that plane. A
// hand that comes over a cut has none yet: it takes the wall's place, and the line of sight for a normal.
std::optional<MouseHand::Contact> MouseHand::contact_at(const Ray& ray, const std::optional<Hit>& hit) const {
  std::optional<Contact> on_plane;
  if (contact_) {
    const Vec3 normal = pressed_ ? contact_->normal_world : Vec3(-ray.along_world);
    const double slope = ray.along_world.dot(normal);
    const double distance_m = (contact_->point_world_m - ray.from_world_m).dot(normal) / slope;
    if (std::abs(slope) > 0.05 && distance_m > 0)
      on_plane = Contact{ray.from_world_m + distance_m * ray.along_world, contact_->normal_world};
  }
  const bool usable = hit && hit->surface == Surface::skin && hit->normal_world.dot(ray.along_world) < 0;
  if (!usable && hit && !on_plane) return Contact{hit->point_world_m, -ray.along_world};
  if (!usable) return on_plane;
  if (pressed_ && on_plane && (hit->point_world_m - on_plane->point_world_m).norm() > kMostJump_m) return on_plane;
  return Contact{hit->point_world_m, mean_normal(*hit, ray, shot_, kAround_m)};
}

std::optional<MouseHand::Contact> MouseHand::contact_beside(const Ray& ray) const {
  const std::optional<Hit> rim = pick_beside(ray, shot_, kBeside_m);
  if (!rim) return std::nullopt;
  return Contact{ray.from_world_m + rim->distance_m * ray.along_world, mean_normal(*rim, ray, shot_, kAround_m)};
}

void MouseHand::point(const Pointer& pointer, const Frame& frame, const Vec3& right_world) {
  closes_ = pointer.closes;
  is_lifted_ = is_lifted_ && pointer.pressed;
  const bool presses = pointer.pressed && !is_lifted_;
  const bool was_down = std::exchange(button_is_down_, presses);
  const bool was_any_down = std::exchange(any_is_down_, presses || pointer.closes);
  if (pressed_ && !presses) {  // it is lifted where it is, wherever the pointer has gone
    pressed_ = false;
    return;
  }
  if (!was_any_down || !any_is_down_) shot_ = shot_of(frame);
  const std::optional<Hit> hit = pick(pointer.ray, shot_);
  std::optional<Contact> next = hit || pressed_ ? std::nullopt : contact_beside(pointer.ray);
  if (presses && !was_down && !hit && !next) ++presses_beside_;
  if (!next) next = contact_at(pointer.ray, hit);
  pressed_ = presses && next;
  if (!next) return;
  if (!has_ahead_) ahead_world_ = right_world;
  has_ahead_ = true;
  const bool carries = closes_ && !pressed_ && !frame.gravity_m_per_s2.isZero();
  const Vec3 wanted = carries ? Vec3(-frame.gravity_m_per_s2.normalized()) : next->normal_world;
  Vec3 normal = wanted;
  if (contact_) {
    const Vec3 way = next->point_world_m - contact_->point_world_m;
    const double share = std::min(1.0, way.norm() / kTurn_m);
    normal = (contact_->normal_world + share * (wanted - contact_->normal_world)).stableNormalized();
    if (pressed_ && way.norm() > 1e-6) ahead_world_ += share * (way.normalized() - ahead_world_);
    // A stroke begins where the edge faces: it turns on the spot, before it goes anywhere.
    if (!pressed_) begins_at_m_.reset();
    if (pressed_ && !begins_at_m_) begins_at_m_ = contact_->point_world_m, has_begun_ = false;
    if (const Vec3 since = pressed_ ? Vec3(next->point_world_m - *begins_at_m_) : Vec3(Vec3::Zero());
        !has_begun_ && since.norm() > kBegins_m)
      ahead_world_ = since.normalized(), has_begun_ = true;
  }
  contact_ = Contact{next->point_world_m, normal};
  const Vec3 flat = across(ahead_world_, normal);
  ahead_world_ = flat.norm() > 1e-3 ? flat.normalized() : normal.unitOrthogonal();
}

void MouseHand::lift() {
  is_lifted_ = is_lifted_ || button_is_down_;
  pressed_ = false;
}

void MouseHand::deepen(double by_m) {
  depth_m_ = std::clamp(depth_m_ + by_m, 0.0, kDeepest_m);
}

void MouseHand::pitch(double by_rad) {
  pitch_rad_ = std::clamp(pitch_rad_ + by_rad, -1.5, 1.5);
}

void MouseHand::tick(double now_s) {
  const double dt_s = last_s_ ? std::clamp(now_s - *last_s_, 0.0, 0.2) : 0;
  last_s_ = now_s;
  const double wanted_m = pressed_ ? -depth_m_ : closes_ ? kCarry_m : kHover_m;
  height_m_ = std::clamp(wanted_m, height_m_ - kSink_m_per_s * dt_s, height_m_ + kSink_m_per_s * dt_s);
  const double wanted_rad = closes_ ? 0 : widest_rad_;
  opening_rad_ = std::clamp(wanted_rad, opening_rad_ - kJaws_rad_per_s * dt_s, opening_rad_ + kJaws_rad_per_s * dt_s);
}

// The tool's frame: z up its shaft, x where the sharp edge points.
std::optional<JointPose> MouseHand::wish() const {
  if (!contact_) return std::nullopt;
  const Vec3& n = contact_->normal_world;
  const Vec3 ahead = Eigen::AngleAxisd(roll_rad_, n) * ahead_world_;
  Mat3 axes;
  axes.col(2) = std::cos(pitch_rad_) * n - std::sin(pitch_rad_) * ahead;
  axes.col(1) = n.cross(ahead);
  axes.col(0) = axes.col(1).cross(axes.col(2));
  return JointPose{{contact_->point_world_m + height_m_ * n, Eigen::Quaterniond(axes).normalized()}, opening_rad_};
}

}  // namespace sectio
