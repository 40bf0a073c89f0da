// A blunt instrument with a radius presses with a ball about its tip and with its shaft, as capsules that hold samples
// of the surface out of themselves (surface_samples.h).
//
// The stress beneath a contact that is smaller than the elements is not resolved, and the surface between vertices is
// too stiff. A layer of tissue in series, as deep as a share of an element, gives way by as much; it vanishes as meshes
// get finer. It is no deeper than half the radius, and gives way by no more: an instrument does not sink through it.
#include <algorithm>

#include "common/material/regions.h"
#include "sim_server/world/edge_contact.h"

namespace sectio {
bool EdgeContact::is_round() const {
  if (!(geometry_.sphere_radius_m > 0) || !is_blunt() || body_.contact_by_templates()) return false;
  return body_.deforms() || instrument_.grip_force_n == 0;  // a ball would push a piece away from the jaws
}

// The ball about the tip; the shaft, when it has a thickness, is no thicker.
std::vector<MovingCapsule> EdgeContact::round_parts(const JointPose& before) const {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  const Vec3 axis = (shape.b_tool_m - shape.a_tool_m).stableNormalized(), side = shape.c_tool_m - shape.a_tool_m;
  const double shaft_m = std::min(geometry_.sphere_radius_m, (side - side.dot(axis) * axis).norm());
  const auto at = [&](const JointPose& pose, const Vec3& end_tool_m, double radius_m) {
    return Capsule{pose.to_world(shape.a_tool_m), pose.to_world(end_tool_m), pose.orientation * axis, radius_m};
  };
  std::vector<MovingCapsule> parts;
  const auto add = [&](const Vec3& end_tool_m, double radius_m) {
    parts.push_back({at(before, end_tool_m, radius_m), at(pose_, end_tool_m, radius_m)});
  };
  if (shaft_m > 0) add(shape.b_tool_m, shaft_m);
  if (shaft_m < geometry_.sphere_radius_m) add(shape.a_tool_m, geometry_.sphere_radius_m);
  return parts;
}

void EdgeContact::approach_round(const JointPose& before) {
  if (phase_ == Phase::through) return;
  const std::vector<MovingCapsule> parts = round_parts(before);
  const Box3 box = body_.bounds_world_m();
  const bool is_near = !box.isEmpty() && std::ranges::any_of(parts, [&](const MovingCapsule& c) {
    Box3 swept;
    for (const Vec3& end : {c.before.from_world_m, c.before.to_world_m, c.after.from_world_m, c.after.to_world_m})
      swept.extend(end);
    return box.intersects(grown(swept, c.after.radius_m + kNear_m));
  });
  samples_.clear();
  if (is_near) samples_ = samples_at(body_.view(), body_.tree(), parts);
  const auto deepest = std::ranges::max_element(samples_, {}, &SurfaceSample::depth_m);
  const double least_m = phase_ == Phase::pressing ? -kLetGo_m : 0;
  if (deepest == samples_.end() || deepest->depth_m < least_m) {
    samples_.clear();
    return set_free();
  }
  if (phase_ == Phase::free) events_.push_back({EventKind::contact_began});
  phase_ = Phase::pressing;
  at_tip_ = true;
  contact_corners_ = {0, 0};
  stand_at(*deepest);
  if (!body_.deforms()) samples_ = {SurfaceSample(*deepest)};  // it meets a ball at one point
  hold_samples();
}

void EdgeContact::hold_samples() {
  const MaterialSpec& m = body_.spec.material;
  const double e_star_pa = m.young_pa / (1 - m.poisson * m.poisson);
  const double deepest_m = 0.5 * geometry_.sphere_radius_m;
  const double layer_m_per_pa = std::min(deepest_m, body_.engines.deformation->layer_m()) / e_star_pa;
  const bool varies = vary_in_stiffness(body_.spec.regions);
  for (const SurfaceSample& s : samples_) {
    PointConstraint c;
    c.v = body_.mesh.triangle(s.triangle).v;
    for (std::size_t i = 0; i < 3; ++i) c.w[i] = s.bary[static_cast<int>(i)];
    c.target_world_m = s.target_world_m;
    c.normal = s.normal_world;
    c.unilateral = true;
    c.friction = m.friction;
    c.gives_most_m = deepest_m;
    c.compliance_m_per_n = layer_m_per_pa / s.area_rest_m2;
    if (varies) c.compliance_m_per_n /= stiffness_factor_at(body_.spec.regions, body_.mesh.rest_body_m(c.v[0]));
    constraints_.push_back(c);
  }
}

void EdgeContact::stand_at(const SurfaceSample& s) {
  triangle_ = s.triangle;
  bary_ = s.bary;
  point_ = s.point_world_m;
  normal_ =
      body_.home_normal_world(MeshDraft(body_.mesh, body_.particle_view()), body_.mesh.triangle(s.triangle).v, s.bary);
}

// The instrument stands at the middle of what it presses.
void EdgeContact::round_deformed(std::span<const Reaction> reactions) {
  if (reactions.size() != samples_.size()) return;
  double sum_n = 0;
  Vec3 middle = Vec3::Zero();
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const PointConstraint& c = constraints_[i];
    samples_[i].point_world_m.setZero();
    for (std::size_t a = 0; a < 3; ++a) samples_[i].point_world_m += c.w[a] * body_.particle_view().position(c.v[a]);
    samples_[i].depth_m = (samples_[i].point_world_m - c.target_world_m).dot(c.normal);
    const double push_n = std::max(0.0, reactions[i].force_on_tool_n.dot(c.normal));
    sum_n += push_n;
    middle += push_n * samples_[i].point_world_m;
  }
  if (!(sum_n > 0)) return;
  middle /= sum_n;
  const auto away = [&](const SurfaceSample& s) { return (s.point_world_m - middle).squaredNorm(); };
  const SurfaceSample& nearest = *std::ranges::min_element(samples_, {}, away);
  stand_at(nearest);
  point_ = middle;
  const Vec3 home = body_.home_world_m(body_.mesh.triangle(triangle_).v, bary_);
  if ((home - nearest.target_world_m).dot(normal_) < kDeepDent_m || deep_steps_++ % kLookThroughEvery != 0) return;
  const Vec3 ahead = contact_world_m() - (geometry_.sphere_radius_m + kBeneath_m) * normal_;
  if (!body_.tree().inside(body_.view(), ahead)) slip_off();
}

}  // namespace sectio
