#include "tests/chart/specimen.h"

namespace sectio::chart {

void add_contacts(const ChartScene& scene, double share, double reach_m, std::span<const VertexId> vertices,
                  std::span<const Vec4f> position_m, std::vector<PointConstraint>& constraints) {
  const double radius_m = scene.ball->radius_m;
  const Vec3 centre = scene.ball->centre_m(scene.size_m, share);
  for (const VertexId v : vertices) {
    const Vec3 out = centre - position_m[v].head<3>().cast<double>();
    if (out.norm() > radius_m + reach_m) continue;
    PointConstraint c = hold(v, centre - radius_m * out.normalized());
    c.unilateral = true;
    c.normal = out.normalized();
    constraints.push_back(c);
  }
}

}  // namespace sectio::chart
