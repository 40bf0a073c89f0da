#include "tests/support/block_under_blade.h"

#include <gtest/gtest.h>
#include <array>
#include <cmath>

#include "sim_server/prepare/prepare.h"

namespace sectio::test {

Scene block_under_knife(const std::string& model, double collapse_ratio, const std::string& style) {
  Scene scene;
  scene.bodies.emplace_back();
  BodySpec& body = scene.bodies[0];
  body.name = "block";
  body.model = model;
  body.mesh = box(6, 4, 4, Vec3(0.06, 0.04, 0.04));
  body.pose.position_m = Vec3(-0.03, -0.02, 0);
  body.volume.tetrahedra = 800;
  body.volume.least_part_s = 1e-4;
  body.volume.collapse_ratio = collapse_ratio;
  body.cutting.style = style;
  body.cutting.threshold_force_n = 0.05;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.004)};
  return scene;
}

BlockUnderBlade::BlockUnderBlade(const std::string& model, double collapse_ratio, const std::string& style)
    : scene_(prepared(block_under_knife(model, collapse_ratio, style))),
      body_(scene_.bodies[0], scene_, 0, maker(model)) {}

double BlockUnderBlade::walls_m2() const {
  double sum = 0;
  for (const Triangle& t : body_.mesh.triangles()) {
    if (!t.alive() || t.surface != Surface::wall) continue;
    const auto x = [&](std::size_t k) -> const Vec3& { return body_.mesh.rest_body_m(t.v[k]); };
    sum += 0.5 * (x(1) - x(0)).cross(x(2) - x(0)).norm();
  }
  return sum;
}

BladeMotion BlockUnderBlade::motion(std::uint32_t tool, const Vec3& tip_world_m, const Vec3& up_world,
                                    bool lift) const {
  BladeMotion motion{tool, {Blade{tip_world_m, up_world}}, lift};
  motion.path[0].length_m = 0.1;
  motion.frame_world = body_.spec.pose;
  return motion;
}

CutPlan BlockUnderBlade::plan(std::span<const BladeMotion> motions) {
  std::vector<Entry> entries;
  for (const BladeMotion& m : motions)
    if (!body_.engines.cutting->cut_point(body_.shared(), m.edge_id))
      entries.push_back({m.edge_id, nearest(m), Vec3::Constant(1.0 / 3)});
  return body_.engines.cutting->plan(body_.shared(), entries, motions);
}

CutPlan BlockUnderBlade::plan_to(double y_m, double z_m, bool lift) {
  return plan(std::array{motion(7, Vec3(0.0013, y_m, z_m), Vec3::UnitZ(), lift)});
}

CutPlan BlockUnderBlade::cut_to(double y_m, double z_m, bool lift) {
  CutPlan plan = plan_to(y_m, z_m, lift);
  EXPECT_TRUE(body_.apply(cut_as_planned(plan)));
  body_.deform({}, {}, 0.001);
  return plan;
}

void BlockUnderBlade::go(double to_m, double z_m, const std::function<void(const CutPlan&)>& look, double step_m) {
  for (double y_m = -0.025; y_m < to_m; y_m += step_m) {
    const CutPlan plan = cut_to(y_m, z_m);
    if (look && !plan.delta.empty()) look(plan);
  }
  cut_to(to_m, z_m, true);
}

TriangleId BlockUnderBlade::nearest(const BladeMotion& motion) const {
  TriangleId found = kNone;
  double least_m = HUGE_VAL;
  for (TriangleId t = 0; t < body_.mesh.triangle_slots(); ++t) {
    const Triangle& triangle = body_.mesh.triangle(t);
    if (!triangle.alive()) continue;
    const Vec3 at = body_.particles.position_world_m[triangle.v[0]].head<3>().cast<double>();
    const double m = (at - motion.path[0].tip_world_m).norm();
    if (m < least_m) least_m = m, found = t;
  }
  return found;
}

}  // namespace sectio::test
