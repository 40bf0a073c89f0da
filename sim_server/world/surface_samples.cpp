#include "sim_server/world/surface_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/intersect.h"
#include "sim_server/world/triangle_lattice.h"

namespace sectio {
namespace {

constexpr double kSpacing = 0.5;      // between samples, and of a way that pushes, over the radius
constexpr int kMostAlong = 24;        // samples along an edge
constexpr double kFarthest_m = 0.02;  // a longer motion in a step is no push: the instrument has jumped
constexpr double kLooks = 0.2;        // cosine to the way to the axis from which on a face looks at it
constexpr double kBesideTip = 0.5;    // a face no farther behind the tip, over the radius, is around the ball
constexpr double kPierced = 0.5;      // cosine to the axis from which on a face can have been pierced

Vec3 nearest_on_axis(const Capsule& c, const Vec3& p) {
  const Vec3 axis = c.to_world_m - c.from_world_m;
  const double length2 = axis.squaredNorm();
  if (length2 == 0) return c.from_world_m;
  return c.from_world_m + std::clamp((p - c.from_world_m).dot(axis) / length2, 0.0, 1.0) * axis;
}

Capsule between(const MovingCapsule& c, double share) {
  return {c.before.from_world_m + share * (c.after.from_world_m - c.before.from_world_m),
          c.before.to_world_m + share * (c.after.to_world_m - c.before.to_world_m), c.after.back_world,
          c.after.radius_m};
}

// A capsule holds a point of the surface by the nearest point of its own, or ahead of its tip.
struct Hold {
  double depth_m = -1e9;
  Vec3 target_m = Vec3::Zero(), normal = Vec3::UnitZ();
};
Hold hold_by(const Capsule& c, double tip_radius_m, bool pierced, const Vec3& at, const Vec3& outwards) {
  const Vec3 axis = nearest_on_axis(c, at), out = axis - at;
  const double distance = out.norm();
  if (outwards.dot(out) > kLooks * distance)
    return {c.radius_m - distance, axis - c.radius_m / distance * out, out / distance};
  const Vec3 from_tip = at - c.from_world_m;
  const double back_m = from_tip.dot(c.back_world);
  if (!pierced && back_m > kBesideTip * tip_radius_m) return {};
  const Vec3 aside = from_tip - back_m * c.back_world;
  const double ahead_m = std::sqrt(std::max(0.0, tip_radius_m * tip_radius_m - aside.squaredNorm()));
  if (outwards.dot(c.back_world) < kPierced || aside.norm() >= c.radius_m || std::abs(back_m) > kFarthest_m) return {};
  const Vec3 normal = (ahead_m * c.back_world - aside) / tip_radius_m, target = c.from_world_m - tip_radius_m * normal;
  return {(at - target).dot(normal), target, normal};
}

struct Sampler {
  std::span<const MovingCapsule> capsules;
  double tip_radius_m = 0;
  int ways = 1;          // into which the motion is divided
  bool pierced = false;  // the tip is inside; the axis behind it goes out through a face

  // Pushes the sample ahead of each way of the motion; false when it is out of reach at the end.
  bool push(SurfaceSample& s, const Vec3& outwards) const {
    Vec3 at = s.point_world_m;
    for (int way = 1; way <= ways; ++way) {
      Hold deepest;
      for (const MovingCapsule& moving : capsules) {
        const Capsule c = way == ways ? moving.after : between(moving, static_cast<double>(way) / ways);
        const Hold hold = hold_by(c, tip_radius_m, pierced, at, outwards);
        if (hold.depth_m > deepest.depth_m) deepest = hold;
      }
      if (way == ways && deepest.depth_m > -kBeforeCapsule_m) {
        s.target_world_m = deepest.target_m;
        s.normal_world = deepest.normal;
        s.depth_m = (s.point_world_m - s.target_world_m).dot(s.normal_world);
        return true;
      }
      if (deepest.depth_m > 0) at = deepest.target_m;
    }
    return false;
  }

  void sample(const SurfaceView& view, TriangleId t, int along, std::vector<SurfaceSample>& out) const {
    const Corners c = view.corners(t);
    const auto& v = view.mesh.triangle(t).v;
    const Vec3 a = view.mesh.rest_body_m(v[0]);
    const double area_m2 =
        0.5 * (view.mesh.rest_body_m(v[1]) - a).cross(view.mesh.rest_body_m(v[2]) - a).norm() / (along * along);
    const Vec3 outwards = (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized();
    for_lattice(along, [&](const Vec3& bary) {
      SurfaceSample s;
      s.bary = bary;
      s.point_world_m = bary.x() * c[0] + bary.y() * c[1] + bary.z() * c[2];
      if (!push(s, outwards)) return;
      s.triangle = t;
      s.area_rest_m2 = area_m2;
      out.push_back(s);
    });
  }
};

}  // namespace

std::vector<SurfaceSample> samples_at(const SurfaceView& view, const CollisionEngine& tree,
                                      std::span<const MovingCapsule> capsules) {
  double widest_m = 0, way_m = 0;
  for (const MovingCapsule& c : capsules) {
    widest_m = std::max(widest_m, c.after.radius_m);
    way_m = std::max({way_m, (c.after.from_world_m - c.before.from_world_m).norm(),
                      (c.after.to_world_m - c.before.to_world_m).norm()});
  }
  Sampler sampler{capsules, widest_m};
  std::vector<Vec3> ends;
  std::vector<std::array<std::size_t, 2>> segments;
  for (const MovingCapsule& c : capsules) {
    segments.push_back({ends.size(), ends.size() + 1});
    ends.insert(ends.end(), {c.after.from_world_m, c.after.to_world_m});
  }
  double reach_m = widest_m + kBeforeCapsule_m;
  if (way_m > kSpacing * widest_m && way_m <= kFarthest_m) {
    sampler.ways = static_cast<int>(std::ceil(way_m / (kSpacing * widest_m)));
    reach_m += way_m;
  }
  std::vector<TriangleId> near;
  tree.near_segments(view, ends, segments, reach_m, near);
  const Capsule& tip = capsules.back().after;
  const Vec3 behind_m = tip.from_world_m + kFarthest_m * tip.back_world;
  sampler.pierced = std::ranges::any_of(near, [&](TriangleId t) {
    const Corners c = view.corners(t);
    const auto crossing = cross_segment(tip.from_world_m, behind_m, c);
    return crossing && (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized().dot(tip.back_world) >= kPierced;
  });
  std::vector<SurfaceSample> samples;
  for (const TriangleId t : near) {
    const auto& v = view.mesh.triangle(t).v;
    double longest_m = 0;
    for (std::size_t i = 0; i < 3; ++i)
      longest_m = std::max(longest_m, (view.mesh.rest_body_m(v[i]) - view.mesh.rest_body_m(v[(i + 1) % 3])).norm());
    const double along = std::ceil(longest_m / (kSpacing * widest_m));
    sampler.sample(view, t, static_cast<int>(std::clamp(along, 1.0, double{kMostAlong})), samples);
  }
  return samples;
}

}  // namespace sectio
