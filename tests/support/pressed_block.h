// A block that stands on its lower face, with a patch of its top pressed in by 3 mm and let go again: what a volume
// model makes of constraints that push and never pull.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "sim_server/deformation/tetra/volume_model.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {

// make(mesh, material, settings): a VolumeModel. The force at rest, N.
template <class Make>
double force_on_pressed_block_n(const Make& make) {
  const TetMesh mesh = tet_box(4, 4, 4, Vec3(0.05, 0.05, 0.05));
  VolumeMaterial material;
  material.damping_per_s = 60;
  VolumeSettings settings;
  settings.gravity_m_per_s2.setZero();
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.z() == 0);
  const std::unique_ptr<VolumeModel> model = make(mesh, material, settings);
  Points x = at_rest(mesh), v = still(x);
  std::vector<PointConstraint> press;
  for (VertexId i = 0; i < x.size(); ++i) {
    const Vec3& p = mesh.vertices_body_m[i];
    if (p.z() < 0.05 || std::abs(p.x() - 0.025) > 0.015 || std::abs(p.y() - 0.025) > 0.015) continue;
    press.push_back(hold(i, p - Vec3(0, 0, 0.003)));
    press.back().unilateral = true;
  }
  EXPECT_EQ(press.size(), 9u);
  std::vector<Reaction> reactions(press.size());
  double work_j = 0;
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < 600; ++n) {
    model->step(x, v, press, reactions);
    sum.setZero();
    for (const Reaction& r : reactions) {
      work_j += r.work_j;
      sum += r.force_on_tool_n;
    }
  }
  for (const Reaction& r : reactions) EXPECT_GE(r.force_on_tool_n.z(), 0);
  for (const PointConstraint& c : press) EXPECT_NEAR(double{x[c.v[0]].z()}, 0.047, 1e-5);
  EXPECT_GT(work_j, 0.4 * sum.z() * 0.003) << "it has been pressed in";
  for (PointConstraint& c : press) c.target_world_m.z() = 0.06;
  for (int n = 0; n < 400; ++n) model->step(x, v, press, reactions);
  for (const Reaction& r : reactions) EXPECT_EQ(r.force_on_tool_n, Vec3(0, 0, 0));
  EXPECT_NEAR(double{x[press[0].v[0]].z()}, 0.05, 1e-4);
  return sum.z();
}

}  // namespace sectio::test
