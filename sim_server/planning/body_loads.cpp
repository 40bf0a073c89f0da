#include "sim_server/planning/body_loads.h"

#include <algorithm>
#include <cmath>

namespace sectio::planning {
namespace {

constexpr double kSlender = 1.5;  // least overhang of a beam, in thicknesses
constexpr double kSteep = 0.75;   // rise over run from what is held to the middle of a body that still bends
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

double extent_m(const TriangleSoup& surface, const Vec3& along) {
  double lowest = HUGE_VAL, highest = -HUGE_VAL;
  for (const Vec3& p : surface.vertices_body_m) {
    lowest = std::min(lowest, p.dot(along));
    highest = std::max(highest, p.dot(along));
  }
  return highest - lowest;
}

// From the middle of what is held to that of the body.
Vec3 reach_m(const TriangleSoup& surface, const std::vector<Vec3>& fixed) {
  Eigen::AlignedBox3d box;
  Vec3 held = Vec3::Zero();
  for (const Vec3& p : surface.vertices_body_m) box.extend(p);
  for (const Vec3& p : fixed) held += p / static_cast<double>(fixed.size());
  return box.center() - held;
}

// Bending by the body's weight: the sag of a cantilever's tip is rho g A L^4 / (8 E I), I = A t^2 / 12. A body that is
// stout or upright, or one that lies, is stretched or pressed together by rho g H^2 / (2 E).
void add_weight(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& s,
                std::vector<BodyLoad>& loads) {
  if (s.most_gravity_m_per_s2 == 0) return;
  const double t = shape.thickness_m,
               weight_per_young = s.material.density_kg_per_m3 * s.most_gravity_m_per_s2 / s.material.young_pa;
  const bool is_held = !s.fixed_m.empty() && !s.lies_on_floor;
  const double length = is_held ? overhang_m(surface, s.fixed_m) : 0;
  const double height_m = extent_m(surface, s.down_body);
  BodyLoad load{{Load::hanging, std::min(t, shape.size_m.minCoeff()), s.material.poisson}, "lies on the floor"};
  load.is_weight = true;
  double moved = 0.5 * weight_per_young * height_m * height_m;
  const Vec3 reach = is_held ? reach_m(surface, s.fixed_m) : Vec3::Zero();
  const double up = -reach.dot(s.down_body), aside = reach.cross(s.down_body).norm();
  const bool at_the_side = std::abs(up) < kSteep * aside;
  if (is_held) load.from = at_the_side ? "is held at its side" : up > 0 ? "stands" : "hangs";
  if (length >= kSlender * t && at_the_side) {
    load.what.load = Load::bending;
    load.from = "its weight";
    moved = 1.5 * weight_per_young * std::pow(length, 4) / (t * t);
  }
  load.what.share = std::min(1.0, moved / (kSagThatMatters * t));
  loads.push_back(std::move(load));
}

LoadCase pressed(double a_m, double thickness_m, const BodySituation& s) {
  return {Load::indentation, 2 * a_m, s.material.poisson, a_m / thickness_m, s.bed_radius_m / a_m};
}

// The greatest depth of a tool in the body, over its trace.
struct Deepest {
  double depth_m = 0, thickness_m = 0, share = 0;
};
Deepest deepest_of(const TriangleSoup& surface, const ToolUse& tool) {
  Deepest deepest;
  for (const ToolDepth& at : depths_along(surface, tool))
    if (at.depth_m > deepest.depth_m)
      deepest = {at.depth_m, at.thickness_m, at.thickness_m > 0 ? at.depth_m / at.thickness_m : 1};
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

std::vector<ToolDepth> depths_along(const TriangleSoup& surface, const ToolUse& tool) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices_body_m) box.extend(p);
  std::vector<ToolDepth> depths(tool.moments.size());
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const ToolMoment& m = tool.moments[i];
    const Vec3 shaft = m.tip_m - m.back_m;
    const Vec3 down = shaft.norm() > 0 ? Vec3(shaft.normalized()) : Vec3(-Vec3::UnitZ());
    const Vec3 tip = m.tip_m + tool.ball_radius_m * down;
    if (!Eigen::AlignedBox3d(tip.cwiseMin(m.back_m), tip.cwiseMax(m.back_m)).intersects(box)) continue;
    const double length = (tip - m.back_m).dot(down);
    const auto through = chord(surface, m.back_m, down);
    if (!through || through->enters >= length) continue;
    depths[i] = {std::min(length, through->leaves) - through->enters, through->leaves - through->enters};
  }
  return depths;
}

double gripped_share(const TriangleSoup& surface, const BodySituation& s) {
  constexpr int kAlong = 6;  // samples along an edge of a triangle
  double most = 0;
  for (const ToolUse& tool : s.tools) {
    const auto begun = std::ranges::find_if(tool.moments, &ToolMoment::grips);
    if (!(tool.grip_radius_m > 0) || begun == tool.moments.end()) continue;
    double held = 0, all = 0;
    for (const auto& [i, j, k] : surface.triangles) {
      const Vec3 &a = surface.vertices_body_m[i], u = surface.vertices_body_m[j] - a,
                 w = surface.vertices_body_m[k] - a;
      const double area = u.cross(w).norm();
      for (int m = 0; m < kAlong; ++m)
        for (int n = 0; m + n < kAlong; ++n) {
          all += area;
          const Vec3 at = a + (m + 1.0 / 3) / kAlong * u + (n + 1.0 / 3) / kAlong * w;
          if ((at - begun->tip_m).norm() < tool.grip_radius_m) held += area;
        }
    }
    most = std::max(most, held / all);
  }
  return most;
}

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
      loads.push_back({{Load::opening, d.depth_m, s.material.poisson, d.share, s.bed_radius_m / d.depth_m},
                       tool.name,
                       false,
                       d.share});
      continue;
    }
    const double dent = tool.moments.empty() ? kUnknownBall_m : d.depth_m;
    const double ball = tool.ball_radius_m;
    loads.push_back({pressed(ball > 0 ? std::sqrt(ball * std::min(dent, ball)) : dent, d.thickness_m, s), tool.name});
  }
  return loads;
}

}  // namespace sectio::planning
