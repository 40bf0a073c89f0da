#include "sim_server/prepare/calibration_block.h"

#include <array>

#include "sim_server/prepare/fill_volumes.h"

namespace sectio {
namespace {

Box lower_face() {
  return {Vec3(-1, -1, -1), Vec3(1, 1, 0.001)};
}

// Its surface, with n squares to 10 mm, facing outwards.
TriangleSoup block(int n) {
  TriangleSoup soup;
  const std::array<int, 3> count{6 * n, 6 * n, 4 * n};
  std::vector<VertexId> known(static_cast<std::size_t>((count[0] + 1) * (count[1] + 1) * (count[2] + 1)), kNone);
  const auto vertex = [&](const std::array<int, 3>& at) {
    const int place = (at[0] * (count[1] + 1) + at[1]) * (count[2] + 1) + at[2];
    VertexId& id = known[static_cast<std::size_t>(place)];
    if (id == kNone) {
      id = static_cast<VertexId>(soup.vertices_body_m.size());
      soup.vertices_body_m.push_back(Vec3(at[0], at[1], at[2]) * 0.01 / n);
    }
    return id;
  };
  for (std::size_t k = 0; k < 3; ++k)
    for (const int side : {0, count[k]}) {
      const std::size_t u = (k + 1) % 3, w = (k + 2) % 3;
      for (int i = 0; i < count[u]; ++i)
        for (int j = 0; j < count[w]; ++j) {
          std::array<std::array<int, 3>, 4> c;
          for (std::size_t n_corner = 0; n_corner < 4; ++n_corner) {
            c[n_corner][k] = side;
            c[n_corner][u] = i + (n_corner == 1 || n_corner == 2);
            c[n_corner][w] = j + (n_corner >= 2);
          }
          if (side == 0) std::swap(c[1], c[3]);
          soup.triangles.push_back({vertex(c[0]), vertex(c[1]), vertex(c[2])});
          soup.triangles.push_back({vertex(c[0]), vertex(c[2]), vertex(c[3])});
        }
    }
  return soup;
}

}  // namespace

Scene filled_block(double tetrahedra) {
  Scene scene;
  scene.file = "calibration";
  BodySpec body;
  body.name = "block";
  body.mesh = block(1);
  body.volume.tetrahedra = tetrahedra;
  body.fixed = lower_face();
  fill_volume(body);
  scene.bodies.push_back(std::move(body));
  return scene;
}
Scene with_model(Scene scene, const planning::Method& method, double young_pa, double cell_m) {
  BodySpec& body = scene.bodies[0];
  body.model = method.model;
  body.material.young_pa = young_pa;
  if (method.embeds()) body.volume.cell_m = cell_m;
  if (method.is_implicit) body.volume.driver = "implicit";
  return scene;
}
Scene surface_block() {
  Scene scene;
  scene.file = "calibration";
  scene.step_s = 1e-4;  // stable, whatever its springs are; a step costs the same
  scene.bodies.emplace_back();
  scene.bodies[0].mesh = block(3);
  scene.bodies[0].fixed = lower_face();
  return scene;
}

}  // namespace sectio
