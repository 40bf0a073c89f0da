#include "sim_server/planning/strokes.h"

#include <algorithm>

namespace sectio::planning {
namespace {

constexpr double kHandM_per_s = 0.02;  // speed of a blade whose motion is unknown
constexpr double kThrough = 0.95;      // share of the thickness

// A blade that goes back and forth cuts nothing in its own slit: no more than this section, in powers 2/3 of volume.
constexpr double kLargestSection = 1.5;

Stroke unknown_stroke(const BodyShape& shape, std::string from) {
  Vec3 size = shape.size_m;
  std::sort(size.begin(), size.end());
  const double way_m = size.y();
  return {std::move(from), way_m, way_m * shape.thickness_m, way_m / kHandM_per_s, true};
}

Stroke stroke_of(const TriangleSoup& surface, const ToolUse& tool) {
  Stroke stroke{tool.name};
  const auto depths = depths_along(surface, tool);
  for (std::size_t i = 1; i < tool.moments.size(); ++i) {
    const double depth_m = 0.5 * (depths[i - 1].depth_m + depths[i].depth_m);
    if (depths[i].depth_m <= 0) continue;
    const ToolMoment &from = tool.moments[i - 1], &to = tool.moments[i];
    const Vec3 moved_m = to.tip_m - from.tip_m;
    stroke.way_m += moved_m.norm();
    const Vec3 shaft = (to.tip_m - to.back_m).stableNormalized();
    stroke.area_m2 += depth_m * (moved_m - moved_m.dot(shaft) * shaft).norm();
    stroke.time_s += to.time_s - from.time_s;
    stroke.goes_through |= depths[i].depth_m > kThrough * depths[i].thickness_m;
  }
  return stroke;
}

}  // namespace

std::vector<Stroke> strokes_in(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& situation) {
  std::vector<Stroke> strokes;
  for (const ToolUse& tool : situation.tools) {
    if (!tool.cuts) continue;
    Stroke stroke = tool.moments.empty() ? unknown_stroke(shape, tool.name) : stroke_of(surface, tool);
    stroke.area_m2 = std::min(stroke.area_m2, kLargestSection * std::pow(shape.volume_m3, 2.0 / 3));
    if (stroke.way_m > 0 && stroke.time_s > 0) strokes.push_back(std::move(stroke));
  }
  return strokes;
}

}  // namespace sectio::planning
