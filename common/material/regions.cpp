#include "common/material/regions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sectio {
namespace {

double tube_m(const RegionPart& p, const Vec3& x) {
  const Vec3 axis = p.b_m - p.a_m;
  const double s = std::clamp((x - p.a_m).dot(axis) / std::max(axis.squaredNorm(), 1e-12), 0.0, 1.0);
  return (x - p.a_m - s * axis).norm() - (p.radius_a_m + s * (p.radius_b_m - p.radius_a_m));
}

// The gradient of |q / r| has the length |q / r^2| / |q / r|.
double ellipsoid_m(const Vec3& q, const Vec3& r) {
  const double k = q.cwiseQuotient(r).norm(), slope = q.cwiseQuotient(r.cwiseProduct(r)).norm();
  return slope > 1e-6 ? k * (k - 1) / slope : -r.minCoeff();
}

// A lower bound on the distance to the border. For an ellipsoid: k changes by less than 1 / min r on a metre.
double least_distance_to_border_m(const RegionPart& p, const Vec3& x) {
  if (p.form == RegionForm::ellipsoid) {
    const double k = (p.orientation.conjugate() * (x - p.a_m)).cwiseQuotient(p.b_m).norm();
    return std::abs(k - 1) * p.b_m.minCoeff();
  }
  // The distance function of a tapered tube has a slope above 1.
  const double length_m = (p.b_m - p.a_m).norm();
  const double taper =
      p.form == RegionForm::tube ? std::abs(p.radius_b_m - p.radius_a_m) / std::max(length_m, 1e-6) : 0;
  return std::abs(signed_distance_m(p, x)) / (1 + taper);
}

}  // namespace

double signed_distance_m(const RegionPart& part, const Vec3& x) {
  if (part.form == RegionForm::tube) return tube_m(part, x);
  const Vec3 q = part.orientation.conjugate() * (x - part.a_m);
  return part.form == RegionForm::box ? (q.cwiseAbs() - part.b_m).maxCoeff() : ellipsoid_m(q, part.b_m);
}

double signed_distance_m(const Region& region, const Vec3& x) {
  double distance_m = std::numeric_limits<double>::infinity();
  for (const RegionPart& part : region.parts) distance_m = std::min(distance_m, signed_distance_m(part, x));
  return region.ripple_m == 0 ? distance_m : distance_m - region.ripple_m * ripple_at(x);
}

std::uint32_t region_at(const Regions& regions, const Vec3& x) {
  for (std::size_t i = regions.size(); i-- > 0;)
    if (signed_distance_m(regions[i], x) <= 0) return static_cast<std::uint32_t>(i);
  return kNoRegion;
}

bool may_reach(const RegionPart& part, const Vec3& centre_m, double radius_m) {
  return signed_distance_m(part, centre_m) <= 0 || least_distance_to_border_m(part, centre_m) <= radius_m;
}

bool is_one_region(const Regions& regions, const Vec3& centre_m, double radius_m) {
  for (const Region& region : regions)
    for (const RegionPart& part : region.parts)
      if (least_distance_to_border_m(part, centre_m) <= radius_m + region.ripple_m) return false;
  return true;
}

double stiffness_factor_at(const Regions& regions, const Vec3& x) {
  const std::uint32_t region = region_at(regions, x);
  return region == kNoRegion ? 1 : regions[region].stiffness_factor;
}

bool vary_in_stiffness(const Regions& regions) {
  return std::ranges::any_of(regions, [](const Region& r) { return r.stiffness_factor != 1; });
}

// Products of waves along the axes; the sum of three products is at most 3. A wave consists of two parabolas a period,
// since a sine would not have the same bits on every machine.
double ripple_at(const Vec3& x) {
  const auto wave = [](double t) {
    const double v = 2 * (t - std::floor(t)) - 1;
    return 4 * v * (1 - std::abs(v));
  };
  const auto waves = [&](const Vec3& p) {
    return wave(p.x()) * wave(p.y() + 0.25) + wave(p.y()) * wave(p.z() + 0.25) + wave(p.z()) * wave(p.x() + 0.25);
  };
  return (0.65 * waves(x / 0.014) + 0.35 * waves(x / 0.006 + Vec3(0.15, 0.3, 0.45))) / 3;
}

std::string flaw_of(const Regions& regions) {
  if (regions.size() > kMaxRegions) return "at most " + std::to_string(kMaxRegions) + " regions";
  std::size_t parts = 0;
  for (const Region& r : regions) {
    parts += r.parts.size();
    if (r.parts.empty()) return "a region needs a shape";
    const auto is_colour = [](const Vec3& c) { return c.allFinite() && c.minCoeff() >= 0 && c.maxCoeff() <= 1; };
    if (!is_colour(r.colour) || !is_colour(r.grain_colour) || !is_colour(r.rim_colour))
      return "colours lie between 0 and 1";
    if (!(r.rim_m >= 0 && r.rim_m < 1 && r.ripple_m >= 0 && r.ripple_m < 1)) return "a rim or ripple is out of range";
    if (!(r.stiffness_factor > 0 && r.stiffness_factor <= 1e3)) return "a stiffness factor is out of range";
    for (const RegionPart& p : r.parts) {
      const bool tube = p.form == RegionForm::tube;
      const double least_m = tube ? std::min(p.radius_a_m, p.radius_b_m) : p.b_m.minCoeff();
      const double most_m =
          std::max({p.a_m.cwiseAbs().maxCoeff(), p.b_m.cwiseAbs().maxCoeff(), p.radius_a_m, p.radius_b_m});
      if (!p.a_m.allFinite() || !p.b_m.allFinite() || !(least_m > 0 && most_m <= 10) ||
          !(std::abs(p.orientation.norm() - 1) < 1e-3))
        return "a shape has no extent, or is larger than 10 m";
    }
  }
  if (parts > kMaxRegionParts)
    return std::to_string(parts) + " ellipsoids, boxes and pieces of tubes; at most " +
           std::to_string(kMaxRegionParts) + " can be drawn";
  return {};
}

}  // namespace sectio
