#include "tests/support/moving_world.h"

#include <stdexcept>

#include "common/math/hash.h"

namespace sectio::test {

TopologyDelta split_triangle(const TriangleMesh& mesh, TriangleId t) {
  const Triangle old = mesh.triangle(t);
  const VertexId v = mesh.vertex_slots();
  const TriangleId first = mesh.triangle_slots();
  const auto [a, b, c] = old.v;
  TopologyDelta delta;
  delta.base_revision = mesh.revision();
  delta.revision = mesh.revision() + 1;
  delta.vertex_slots_after = v + 1;
  delta.triangle_slots_after = first + 2;
  delta.vertices = {{v, true, (mesh.rest_body_m(a) + mesh.rest_body_m(b) + mesh.rest_body_m(c)) / 3}};
  delta.triangles = {
      {t, {{a, b, v}, Surface::wall}}, {first, {{b, c, v}, Surface::wall}}, {first + 1, {{c, a, v}, Surface::skin}}};
  delta.hash_after = mesh.hash() - slots_hash(v, first) + slots_hash(v + 1, first + 2) - triangle_hash(t, old) +
                     vertex_hash(v, delta.vertices[0].rest_body_m);
  for (const TriangleEdit& edit : delta.triangles) delta.hash_after += triangle_hash(edit.id, edit.triangle);
  return delta;
}

MovingWorld::MovingWorld(int levels, unsigned seed) : mesh_(ellipsoid(levels, Vec3(0.1, 0.07, 0.05))), random_(seed) {
  move();
}

StepOutput MovingWorld::step(bool cut) {
  ++step_;
  StepOutput output;
  output.step = step_;
  output.sim_time_s = static_cast<double>(step_) * kStep_s;
  if (cut) output.deltas.push_back({0, change()});
  move();
  return output;
}

SceneInfo MovingWorld::scene(const std::string& session) const {
  SceneInfo scene;
  scene.session = session;
  scene.step_s = kStep_s;
  scene.bodies = {{"liver", Vec3(0.6, 0.2, 0.2), Vec3(0.8, 0.3, 0.3)}};
  scene.tools.resize(1);
  scene.tools[0].name = "scalpel";
  return scene;
}

TopologyDelta MovingWorld::change() {
  TopologyDelta delta;
  if (undo_ && random_() % 3 == 0) {
    delta = *undo_;
    undo_.reset();
  } else {
    TriangleId t = static_cast<TriangleId>(random_() % mesh_.triangle_slots());
    while (!mesh_.triangle(t).alive()) t = (t + 1) % mesh_.triangle_slots();
    delta = split_triangle(mesh_, t);
    undo_ = inverse(delta, mesh_);
  }
  if (apply(delta, mesh_) != ApplyStatus::applied) throw std::logic_error("the world made a delta that doesn't fit");
  return delta;
}

void MovingWorld::move() {
  positions_.resize(mesh_.vertex_slots());
  for (VertexId v = 0; v < mesh_.vertex_slots(); ++v)
    positions_[v] = mesh_.rest_body_m(v).cast<float>() + Vec3f(0, 0, static_cast<float>(step_) * kRise_m);
}

double MovingWorld::step_of(const Vec3f& position_m, const Vec3f& rest_m) {
  return static_cast<double>((position_m.z() - rest_m.z()) / kRise_m);
}

}  // namespace sectio::test
