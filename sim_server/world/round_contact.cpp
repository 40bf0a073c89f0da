#include "sim_server/world/round_contact.h"

#include <algorithm>

#include "sim_server/world/contact_layer.h"
#include "sim_server/world/edge_meets_body.h"

namespace sectio {
namespace {

constexpr double kAhead = 0.5;  // cosine to the axis from which on tissue is ahead of a tip

Vec3 axis_tool_of(const InstrumentShape& shape) {
  return (shape.b_tool_m - shape.a_tool_m).stableNormalized();
}

// The ball about the tip; the shaft, when it has a thickness, is no thicker.
std::vector<MovingCapsule> round_parts(const InstrumentEdge& edge, const Pose& before) {
  const InstrumentShape& shape = edge.shape();
  const double radius_m = edge.ball_radius_m();
  const Vec3 axis = axis_tool_of(shape), side = shape.c_tool_m - shape.a_tool_m;
  const double shaft_m = std::min(radius_m, (side - side.dot(axis) * axis).norm());
  std::vector<MovingCapsule> parts;
  const auto add = [&](const Vec3& end_tool_m, double part_radius_m) {
    const auto at = [&](const Pose& pose) {
      return Capsule{pose.to_world(shape.a_tool_m), pose.to_world(end_tool_m), pose.orientation * axis, part_radius_m};
    };
    parts.push_back({at(before), at(edge.pose())});
  };
  if (shaft_m > 0) add(shape.b_tool_m, shaft_m);
  if (shaft_m < radius_m) add(shape.a_tool_m, radius_m);
  return parts;
}

bool are_near(const std::vector<MovingCapsule>& parts, const Box3& box) {
  return !box.isEmpty() && std::ranges::any_of(parts, [&](const MovingCapsule& c) {
    Box3 swept;
    for (const Vec3& end : {c.before.from_world_m, c.before.to_world_m, c.after.from_world_m, c.after.to_world_m})
      swept.extend(end);
    return box.intersects(grown(swept, c.after.radius_m + kToolReach_m));
  });
}

}  // namespace

bool RoundContact::is_for(const Body& body, const InstrumentEdge& edge) {
  if (!(edge.ball_radius_m() > 0) || !edge.is_blunt() || body.contact_by_templates()) return false;
  return body.deforms() || edge.kind().grip_force_n == 0;  // a ball would push a piece away from the jaws
}

std::optional<SurfaceSample> RoundContact::press(Body& body, const InstrumentEdge& edge, const Pose& before,
                                                 double least_depth_m) {
  const std::vector<MovingCapsule> parts = round_parts(edge, before);
  samples_.clear();
  if (are_near(parts, body.bounds_world_m())) samples_ = samples_at(body.view(), body.tree(), parts);
  const auto found = std::ranges::max_element(samples_, {}, &SurfaceSample::depth_m);
  if (found == samples_.end() || found->depth_m < least_depth_m) {
    samples_.clear();
    return {};
  }
  const SurfaceSample deepest = *found;
  if (!body.deforms()) samples_ = {deepest};  // it meets a ball at one point
  return deepest;
}

std::vector<PointConstraint> RoundContact::constraints(const Body& body, const InstrumentEdge& edge) const {
  const ContactLayer layer(body, 0.5 * edge.ball_radius_m());
  const Vec3 back_world = edge.pose().orientation * axis_tool_of(edge.shape());
  std::vector<PointConstraint> held;
  for (const SurfaceSample& s : samples_) {
    PointConstraint c;
    c.v = body.mesh.triangle(s.triangle).v;
    for (std::size_t i = 0; i < 3; ++i) c.w[i] = s.bary[static_cast<int>(i)];
    c.target_world_m = s.target_world_m;
    c.normal = s.normal_world;
    c.unilateral = true;
    c.friction = body.spec.material.friction;
    c.is_ahead = s.normal_world.dot(back_world) > kAhead;
    layer.put_under(c, s.area_rest_m2);
    held.push_back(c);
  }
  return held;
}

std::optional<RoundContact::Middle> RoundContact::deformed(const Body& body,
                                                           std::span<const PointConstraint> constraints,
                                                           std::span<const Reaction> reactions) {
  if (reactions.size() != samples_.size()) return {};
  double sum_n = 0;
  Vec3 middle = Vec3::Zero();
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const PointConstraint& c = constraints[i];
    SurfaceSample& sample = samples_[i];
    sample.point_world_m = body.position_at(c.v, {c.w[0], c.w[1], c.w[2]});
    sample.depth_m = (sample.point_world_m - c.target_world_m).dot(c.normal);
    const double push_n = std::max(0.0, reactions[i].force_on_tool_n.dot(c.normal));
    sum_n += push_n;
    middle += push_n * sample.point_world_m;
  }
  if (!(sum_n > 0)) return {};
  middle /= sum_n;
  const auto away = [&](const SurfaceSample& s) { return (s.point_world_m - middle).squaredNorm(); };
  return Middle{middle, *std::ranges::min_element(samples_, {}, away)};
}

double RoundContact::depth_m() const {
  return samples_.empty() ? 0 : std::max(0.0, std::ranges::max(samples_, {}, &SurfaceSample::depth_m).depth_m);
}

}  // namespace sectio
