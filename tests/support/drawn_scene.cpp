#include "tests/support/drawn_scene.h"

#include <algorithm>
#include <limits>

#include "render_client/draw/camera.h"

namespace sectio::test {

std::vector<std::optional<SeenPoint>> seen_points(const Frame& frame, int width_px, int height_px) {
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  std::vector<std::optional<SeenPoint>> seen(pixels);
  std::vector<double> nearest(pixels, std::numeric_limits<double>::infinity());
  const Eigen::Matrix4d to_clip =
      (projection(frame.camera, double(width_px) / height_px) * view_from_world(frame.camera)).cast<double>();
  for (std::size_t b = 0; b < frame.bodies.size(); ++b) {
    const BodyFrame& body = frame.bodies[b];
    for (const Triangle& t : body.triangles) {
      if (!t.alive()) continue;
      // In pixels, and 1 / w, which is linear on the screen.
      Mat3 corner, rest, world;
      for (int i = 0; i < 3; ++i) {
        const VertexId v = t.v[static_cast<std::size_t>(i)];
        world.col(i) = body.positions_world_m[v].cast<double>();
        rest.col(i) = body.rest_body_m[v].cast<double>();
        const Eigen::Vector4d clip = to_clip * Eigen::Vector4d(world(0, i), world(1, i), world(2, i), 1);
        corner.col(i) =
            Vec3((clip.x() / clip.w() + 1) / 2 * width_px, (1 - clip.y() / clip.w()) / 2 * height_px, 1 / clip.w());
      }
      const auto side = [&](int i, int j, const Vec3& p) {
        return (corner(0, j) - corner(0, i)) * (p.y() - corner(1, i)) -
               (corner(1, j) - corner(1, i)) * (p.x() - corner(0, i));
      };
      const double area = side(0, 1, corner.col(2));
      if (area == 0) continue;
      const Vec3 low = corner.rowwise().minCoeff(), high = corner.rowwise().maxCoeff();
      for (int y = std::max(0, int(low.y())); y <= std::min(height_px - 1, int(high.y())); ++y)
        for (int x = std::max(0, int(low.x())); x <= std::min(width_px - 1, int(high.x())); ++x) {
          const Vec3 p(x + 0.5, y + 0.5, 0);
          const Vec3 bary = Vec3(side(1, 2, p), side(2, 0, p), side(0, 1, p)) / area;
          if (bary.minCoeff() < 0) continue;
          const double inverse_w = bary.dot(corner.row(2));
          const auto at = static_cast<std::size_t>(y * width_px + x);
          if (1 / inverse_w >= nearest[at]) continue;
          nearest[at] = 1 / inverse_w;
          const Vec3 weights = bary.cwiseProduct(corner.row(2).transpose()) / inverse_w;
          seen[at] = SeenPoint{b, t.surface, rest * weights, world * weights};
        }
    }
  }
  return seen;
}

}  // namespace sectio::test
