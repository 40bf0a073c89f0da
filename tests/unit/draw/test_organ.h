// A hand-made organ for pictures: an ellipsoid with an open cut along its top, and an instrument in it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "render_client/replica/frame.h"

namespace sectio::test {

struct OrganShape {
  std::uint32_t rings = 40;   // along the long axis
  std::uint32_t around = 80;  // a multiple of 4
  double opening_m = 0.012;   // 0: no cut
  double depth_m = 0.012;
};

// Rings of vertices about x. Along the top (a quarter of the way round) the middle rings are doubled: the original
// vertices move to one side, the doubles to the other, and a bottom line lies below; walls join the three.
inline BodyFrame make_organ(const OrganShape& shape = {}) {
  BodyFrame body;
  body.name = "organ";
  body.revision = 1;
  body.skin_colour = Vec3(0.62, 0.20, 0.16);
  body.wall_colour = Vec3(0.78, 0.33, 0.27);
  const std::uint32_t n = shape.rings, m = shape.around, top = m / 4;
  const auto add = [&](const Vec3& p) {
    body.rest_body_m.push_back(p.cast<float>());
    return static_cast<VertexId>(body.rest_body_m.size() - 1);
  };
  const auto on_ring = [&](std::uint32_t i, std::uint32_t j) { return (i - 1) * m + j % m; };
  for (std::uint32_t i = 1; i < n; ++i) {
    const double u = std::numbers::pi * i / n;
    for (std::uint32_t j = 0; j < m; ++j) {
      const double v = 2 * std::numbers::pi * j / m;
      const double lump = 1 + 0.05 * std::sin(3 * u + 2 * v) + 0.03 * std::cos(5 * v);
      add(Vec3(-0.09 * std::cos(u), 0.055 * std::sin(u) * std::cos(v) * lump,
               0.035 * std::sin(u) * std::sin(v) * lump));
    }
  }
  const VertexId left_pole = add(Vec3(-0.09, 0, 0)), right_pole = add(Vec3(0.09, 0, 0));
  const std::uint32_t begin = n / 3, end = 2 * n / 3;  // rings where the cut begins and ends
  std::vector<VertexId> other_lip(n + 1, kNone), bottom(n + 1, kNone);
  const auto triangle = [&](VertexId a, VertexId b, VertexId c, Surface surface) {
    if (a != b && b != c && c != a) body.triangles.push_back({{a, b, c}, surface});
  };
  body.positions_world_m = body.rest_body_m;
  if (shape.opening_m > 0) {
    for (std::uint32_t i = begin; i <= end; ++i) {
      const VertexId lip = on_ring(i, top);
      other_lip[i] = bottom[i] = lip;
      if (i == begin || i == end) continue;
      const double s = std::sin(std::numbers::pi * (i - begin) / (end - begin));
      const Vec3 rest = body.rest_body_m[lip].cast<double>();
      other_lip[i] = add(rest);
      bottom[i] = add(rest - Vec3(0, 0, shape.depth_m * std::sqrt(s)));
      body.positions_world_m.push_back((rest - Vec3(0, 0.5 * shape.opening_m * s, -0.001 * s)).cast<float>());
      body.positions_world_m.push_back(body.rest_body_m[bottom[i]]);
      body.positions_world_m[lip] = (rest + Vec3(0, 0.5 * shape.opening_m * s, 0.001 * s)).cast<float>();
      // The neighbours of the lips follow by half.
      body.positions_world_m[on_ring(i, top - 1)].y() += static_cast<float>(0.25 * shape.opening_m * s);
      body.positions_world_m[on_ring(i, top + 1)].y() -= static_cast<float>(0.25 * shape.opening_m * s);
    }
  }
  const auto lip_after = [&](std::uint32_t i) {
    return other_lip[i] == kNone ? on_ring(i, top) : other_lip[i];  // seen from the side of larger angles
  };
  for (std::uint32_t j = 0; j < m; ++j) {
    triangle(left_pole, on_ring(1, j + 1), on_ring(1, j), Surface::skin);
    triangle(right_pole, on_ring(n - 1, j), on_ring(n - 1, j + 1), Surface::skin);
    for (std::uint32_t i = 1; i + 1 < n; ++i) {
      const VertexId a = j == top ? lip_after(i) : on_ring(i, j), b = j == top ? lip_after(i + 1) : on_ring(i + 1, j);
      const VertexId c = on_ring(i + 1, j + 1), d = on_ring(i, j + 1);
      triangle(a, c, b, Surface::skin);
      triangle(a, d, c, Surface::skin);
    }
  }
  if (shape.opening_m > 0) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const VertexId a = on_ring(i, top), b = on_ring(i + 1, top);
      triangle(a, bottom[i], bottom[i + 1], Surface::wall);
      triangle(a, bottom[i + 1], b, Surface::wall);
      triangle(other_lip[i], bottom[i + 1], bottom[i], Surface::wall);
      triangle(other_lip[i], other_lip[i + 1], bottom[i + 1], Surface::wall);
    }
  }
  return body;
}

inline ToolFrame make_scalpel_at(const Vec3& tip_world_m) {
  ToolFrame tool;
  tool.name = "scalpel";
  tool.kind = "scalpel";
  tool.present = true;
  tool.abcd_tool_m = {Vec3(0, 0, 0), Vec3(0, 0, 0.03), Vec3(0.006, 0, 0.012), Vec3(0.006, 0, 0.03)};
  tool.pose_world.position_m = tip_world_m;
  tool.pose_world.orientation = Eigen::AngleAxisd(0.75, Vec3::UnitY()) * Eigen::AngleAxisd(0.25, Vec3::UnitX());
  return tool;
}

inline Frame make_frame(const OrganShape& shape = {}) {
  Frame frame;
  frame.session = "test";
  frame.step = 1234;
  frame.sim_time_s = 1.234;
  frame.step_wall_time_s = 0.00084;
  frame.camera.eye_world_m = Vec3(0.03, -0.17, 0.19);
  frame.camera.target_world_m = Vec3(0, 0, 0.005);
  frame.bodies.push_back(make_organ(shape));
  return frame;
}

}  // namespace sectio::test
