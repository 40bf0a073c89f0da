#include "render_client/draw/region_uniforms.h"

#include <algorithm>

namespace sectio {

namespace {

Vec4f packed(const Vec3& v, double w) {
  return Vec4f(static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w));
}

// Screens have a gamma of 2 here (shaders.h).
Vec3 linear(const Vec3& colour) {
  return colour.cwiseProduct(colour);
}

}  // namespace

RegionUniforms pack(std::span<const Region> regions) {
  RegionUniforms u;
  for (auto* parts : {&u.part_a, &u.part_b, &u.part_q}) parts->fill(Vec4f::UnitW());
  for (auto* colours : {&u.colour, &u.grain, &u.rim}) colours->fill(Vec4f::Zero());
  std::size_t part = 0;
  for (const Region& region : regions.first(std::min(regions.size(), kMaxRegions))) {
    const auto r = static_cast<std::size_t>(u.count++);
    constexpr std::array kOrder{RegionForm::tube, RegionForm::ellipsoid, RegionForm::box};
    for (std::size_t form = 0; form < kOrder.size(); ++form) {
      for (const RegionPart& p : region.parts) {
        if (p.form != kOrder[form] || part == kMaxRegionParts) continue;
        u.part_a[part] = packed(p.a_m, p.radius_a_m);
        u.part_b[part] = packed(p.b_m, p.radius_b_m);
        u.part_q[part] = p.orientation.coeffs().cast<float>();
        ++part;
      }
      u.part_end[r][form] = static_cast<int>(part);
    }
    u.colour[r] = packed(linear(region.colour), region.rim_m);
    u.grain[r] = packed(linear(region.grain_colour), region.ripple_m);
    u.rim[r] = packed(linear(region.rim_colour), 0);
  }
  return u;
}

}  // namespace sectio
