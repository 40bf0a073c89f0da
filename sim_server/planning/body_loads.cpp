#include "sim_server/planning/body_loads.h"

#include <algorithm>
#include <cmath>

namespace sectio::planning {
namespace {

constexpr double kSlender = 1.5;          // least overhang of a beam, in thicknesses
constexpr double kFlat = 0.05;            // fixed vertices within this share of the thickness are a face
constexpr double kSagThatMatters = 0.02;  // in thicknesses
constexpr double kTwist_rad = 15 * M_PI / 180;
constexpr double kUnknownBall_m = 0.005;  // assumed dent of an instrument that has no trace
constexpr std::size_t kMostPoints = 1500;

// The largest distance of the surface from the fixed vertices.
double overhang_m(const TriangleSoup& surface, const std::vector<Vec3>& fixed) {
  const auto every = [](std::size_t n) { return std::max<std::size_t>(1, n / kMostPoints); };
  double furthest = 0;
  for (std::size_t i = 0; i < surface.vertices_body_m.size(); i += every(surface.vertices_body_m.size())) {
    double nearest = HUGE_VAL;
    for (std::size_t k = 0; k < fixed.size(); k += every(fixed.size()))
      nearest = std::min(nearest, (surface.vertices_body_m[i] - fixed[k]).squaredNorm());
    furthest = std::max(furthest, nearest);
  }
  return std::sqrt(furthest);
}

// Bending by the body's weight. The sag of a cantilever's tip is rho g A L^4 / (8 E I), I = A t^2 / 12.
void add_weight(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& s,
                std::vector<BodyLoad>& loads) {
  if (s.fixed_m.empty() || s.lies_on_floor || s.most_gravity_m_per_s2 == 0) return;
  const double length = overhang_m(surface, s.fixed_m), t = shape.thickness_m;
  const double sag = 1.5 * s.material.density_kg_per_m3 * s.most_gravity_m_per_s2 * std::pow(length, 4) /
                     (s.material.young_pa * t * t);
  if (length < kSlender * t || sag < kSagThatMatters * t) return;
  Eigen::AlignedBox3d held;
  for (const Vec3& p : s.fixed_m) held.extend(p);
  LoadCase bends{Load::bending, t, s.material.poisson};
  if (held.sizes().minCoeff() > kFlat * t) bends.overhang_m = length;
  loads.push_back({bends, "its weight"});
}

LoadCase pressed(double a_m, double thickness_m, const BodySituation& s) {
  return {Load::indentation, 2 * a_m, s.material.poisson, a_m / thickness_m, s.bed_radius_m / a_m};
}

// The greatest depth of a tool in the body, over its trace.
struct Deepest {
  double depth_m = 0, thickness_m = 0, share = 0;
};
Deepest deepest_of(const TriangleSoup& surface, const ToolUse& tool) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices_body_m) box.extend(p);
  Deepest deepest;
  for (const ToolMoment& m : tool.moments) {
    const Vec3 shaft = m.tip_m - m.back_m;
    const Vec3 down = shaft.norm() > 0 ? Vec3(shaft.normalized()) : Vec3(-Vec3::UnitZ());
    const Vec3 tip = m.tip_m + tool.ball_radius_m * down;
    if (!Eigen::AlignedBox3d(tip.cwiseMin(m.back_m), tip.cwiseMax(m.back_m)).intersects(box)) continue;
    const double length = (tip - m.back_m).dot(down);
    const auto through = chord(surface, m.back_m, down);
    if (!through || through->enters >= length) continue;
    const double thickness = through->leaves - through->enters;
    const double depth = std::min(length, through->leaves) - through->enters;
    if (depth > deepest.depth_m) deepest = {depth, thickness, thickness > 0 ? depth / thickness : 1};
  }
  return deepest;
}

// The length along which cells count for twisting. Cells across the width count as well as those across the thickness,
// as the error is proportional to the mean of 1 / n^2.
double twisted_m(const BodyShape& shape) {
  Vec3 size = shape.size_m;
  std::sort(size.begin(), size.end());
  const double t = shape.thickness_m, w = std::max(t, size.y());
  return std::sqrt(2 / (1 / (t * t) + 1 / (w * w)));
}

void add_grip(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& s, const ToolUse& tool,
              std::vector<BodyLoad>& loads) {
  const ToolMoment* begun = nullptr;
  double turned = 0, moved = 0;
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices_body_m) box.extend(p);
  for (const ToolMoment& m : tool.moments) {
    if (!m.grips) {
      begun = nullptr;
      continue;
    }
    if (!begun && box.exteriorDistance(m.tip_m) > tool.grip_radius_m) continue;
    if (!begun) begun = &m;
    turned = std::max(turned, begun->orientation.angularDistance(m.orientation));
    moved = std::max(moved, (m.tip_m - begun->tip_m).norm());
  }
  if (!tool.moments.empty() && !begun && moved == 0 && turned == 0) return;
  loads.push_back({pressed(tool.grip_radius_m, shape.thickness_m, s), tool.name});
  if (turned > kTwist_rad) loads.push_back({{Load::twisting, twisted_m(shape), s.material.poisson}, tool.name});
  if (moved > 0.25 * shape.thickness_m && shape.size_m.maxCoeff() > 2 * kSlender * shape.thickness_m)
    loads.push_back({{Load::bending, shape.thickness_m, s.material.poisson}, tool.name});
}

}  // namespace

std::vector<BodyLoad> loads_on(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& s) {
  std::vector<BodyLoad> loads;
  add_weight(surface, shape, s, loads);
  for (const ToolUse& tool : s.tools) {
    if (tool.grip_radius_m > 0) {
      add_grip(surface, shape, s, tool, loads);
      continue;
    }
    Deepest d = deepest_of(surface, tool);
    if (tool.moments.empty()) d = {shape.thickness_m, shape.thickness_m, 1};
    if (d.depth_m <= 0) continue;
    if (tool.cuts) {
      loads.push_back(
          {{Load::opening, d.depth_m, s.material.poisson, d.share, s.bed_radius_m / d.depth_m}, tool.name, d.share});
      continue;
    }
    const double dent = tool.moments.empty() ? kUnknownBall_m : d.depth_m;
    const double ball = tool.ball_radius_m;
    loads.push_back({pressed(ball > 0 ? std::sqrt(ball * std::min(dent, ball)) : dent, d.thickness_m, s), tool.name});
  }
  return loads;
}

}  // namespace sectio::planning
