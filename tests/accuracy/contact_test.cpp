// Indenters, out of which the tissue is held as by the simulator's instruments.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/surface_springs.h"
#include "tests/support/ball_on_block.h"
#include "tests/support/contact_reference.h"
#include "tests/support/gripper.h"
#include "tests/support/moving_body.h"

namespace sectio::contact_test {
namespace {

using test::MovingModel;

// A ball of 10 mm radius, 2 mm deep in a block of 48 x 48 x 16 mm that is held from below: in the simulation itself, by
// an instrument with a ball at its tip. The force that it reports.
struct Pressed {
  std::string model;
  double poisson = 0.45;
  double cell_m = 0;        // cell of the lattice
  double tetrahedra = 800;  // tetrahedra of a volume
  int across = 24;          // squares of the surface
  double step_s = 0.001;
};
double ball_force_ratio(const Pressed& p) {
  const double radius_m = 0.01, depth_m = 0.002, side_m = 0.048, height_m = 0.016;
  Scene scene = test::ball_on_block({.model = p.model,
                                     .size_m = Vec3(side_m, side_m, height_m),
                                     .squares = {p.across, p.across, p.across / 3},
                                     .young_pa = 10000,
                                     .poisson = p.poisson,
                                     .radius_m = radius_m,
                                     .depth_m = depth_m,
                                     .step_s = p.step_s,
                                     .tetrahedra = p.tetrahedra,
                                     .cell_m = p.cell_m});
  scene.bodies[0].material.damping_per_s = 150;
  test::Operation op(scene);
  op.place(Vec3(0, 0, height_m + radius_m + 0.001));
  op.move(Vec3(0, 0, height_m + radius_m - depth_m), 0.05);
  for (int n = 0; n < 0.1 / p.step_s; ++n) op.step({{0, op.hand()}});
  double force_n = 0;
  constexpr int kMean = 20;
  for (int n = 0; n < kMean; ++n) {
    op.step({{0, op.hand()}});
    force_n += op.force_n().z() / kMean;
  }
  EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
  return force_n / test::ball_on_layer_n(10000, p.poisson, radius_m, depth_m, height_m);
}

TEST(Accuracy, A_9_hertz) {
  for (const Pressed& p :
       {Pressed{"neo_hookean_lattice", 0.45, 0.0015, 20000, 32}, {"neo_hookean", 0.45, 0, 20000, 32}})
    EXPECT_NEAR(ball_force_ratio(p), 1, 0.1) << p.model;
}

TEST(Accuracy, A_9_hertz_on_springs) {
  EXPECT_NEAR(ball_force_ratio({"tetra_springs", 0.25, 0, 8000, 24}), 1, 0.2);
  for (const int across : {12, 24, 72}) {
    Pressed p{"surface_springs"};
    p.across = across;
    p.step_s = 2.5e-4;
    EXPECT_NEAR(ball_force_ratio(p), 1, 0.1) << across;
  }
}

// A punch without friction; its radius is that of the furthest vertex that it presses.
double flat_punch_ratio(const MovingModel& model, double poisson, int cells_high) {
  const double height_m = 0.02, cell_m = height_m / cells_high, side_m = 4 * height_m, depth_m = 2e-4;
  const double nominal_m = 0.805 * height_m, young_pa = 10000;
  const TetMesh mesh = test::tet_box(4 * cells_high, 4 * cells_high, cells_high, Vec3(side_m, side_m, height_m));
  VolumeSettings settings;
  settings.step_s = 5e-4;
  settings.gravity_m_per_s2.setZero();
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.z() < 1e-9);
  test::MovingBody body = model.make(mesh, cell_m, {{young_pa, poisson, 1000}, 150, {}}, settings);
  std::vector<PointConstraint> punch;
  double radius_m = 0;
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3& p = mesh.vertices_body_m[v];
    if (p.z() < height_m - 1e-9 || (p - Vec3(side_m / 2, side_m / 2, height_m)).norm() > nominal_m) continue;
    punch.push_back(hold(v, p - Vec3(0, 0, depth_m)));
    punch.back().unilateral = true;
    radius_m = std::max(radius_m, (p - Vec3(side_m / 2, side_m / 2, height_m)).norm());
  }
  body.step(300, punch);
  double force_n = 0;
  for (const Reaction& r : body.reactions) force_n += r.force_on_tool_n.z();
  return force_n / (2 * radius_m * test::contact_modulus_pa(young_pa, poisson) * depth_m *
                    test::punch_on_layer_factor(radius_m / height_m, poisson));
}

TEST(Accuracy, A_10_flat_punch) {
  struct Case {
    MovingModel model;
    double poisson, within;
  };
  for (const Case& c : {Case{test::moving_tetrahedra(), 0.45, 0.08},
                        {test::moving_hexahedra(), 0.45, 0.08},
                        {test::moving_springs(), 0.25, 0.15}})
    EXPECT_NEAR(flat_punch_ratio(c.model, c.poisson, 8), 1, c.within) << c.model;
}

// The factors that Hayes et al. tabulate.
TEST(Reference, a_flat_punch_on_a_layer) {
  EXPECT_NEAR(test::punch_on_layer_factor(0.2, 0.3), 1.207, 0.002);
  EXPECT_NEAR(test::punch_on_layer_factor(0.2, 0.45), 1.252, 0.002);
  EXPECT_NEAR(test::punch_on_layer_factor(1, 0.45), 3.085, 0.01);
  EXPECT_NEAR(test::punch_on_layer_factor(1, 0.5), 3.609, 0.015);
}

// The stiffness of surface springs under a punch: a membrane with tension T on a bed of springs,
//   F / d = K_w pi a^2 (1 + 2 (l / a) K_1(a / l) / K_0(a / l)),  l = sqrt(T / K_w), K_w = 2 E* / (pi a_ref)
// A net of triangles with k = E t (A_1 + A_2) / l^2 that is longer by the share p than without tension has
// T = 3 / 2 E t p.
TEST(Accuracy, A_11_a_punch_on_a_membrane_on_a_bed) {
  const double h = 0.0005, a = 0.005;
  const int n = 100;
  SurfaceSpringMaterial material;
  material.foundation_radius_m = 0.005;
  const double bed =
      2 * test::contact_modulus_pa(material.young_pa, material.poisson) / (M_PI * material.foundation_radius_m);
  material.skin_thickness_m = 0.01;
  material.pretension = bed * a * a / (1.5 * material.young_pa * material.skin_thickness_m);  // l = a
  material.damping_per_s = 400;
  const double top_m = 0.01;
  const TriangleMesh mesh(surface_of(test::tet_box(n, n, 1, Vec3(n * h, n * h, top_m))).soup);
  SurfaceSpringSettings settings;
  settings.step_s = 1e-4;
  settings.gravity_m_per_s2.setZero();
  settings.fixed = [&](const Vec3& p) {
    return p.z() < top_m - 1e-9 || p.head<2>().minCoeff() < 1e-9 || p.head<2>().maxCoeff() > n * h - 1e-9;
  };
  SurfaceSprings springs(mesh, {}, material, settings);
  EXPECT_GT(springs.largest_stable_step_s(), settings.step_s);
  test::Points x;
  std::vector<PointConstraint> punch;
  const double depth_m = 1e-4;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    const Vec3 p = mesh.rest_body_m(v);
    x.push_back(Vec4f::Zero());
    x.back().head<3>() = p.cast<float>();
    if (p.z() < top_m - 1e-9 || (p - Vec3(n * h / 2, n * h / 2, top_m)).norm() > a) continue;
    punch.push_back(hold(v, p - Vec3(0, 0, depth_m)));
    punch.back().unilateral = true;
  }
  test::Points velocity = test::still(x);
  std::vector<Reaction> reactions(punch.size());
  for (int i = 0; i < 500; ++i) springs.step(x, velocity, punch, reactions);
  double force_n = 0;
  for (const Reaction& r : reactions) force_n += r.force_on_tool_n.z();
  const double radius_m = h * std::sqrt(double(punch.size()) / M_PI), at = radius_m / a;
  const double expected =
      bed * M_PI * radius_m * radius_m * (1 + 2 / at * std::cyl_bessel_k(1, at) / std::cyl_bessel_k(0, at));
  EXPECT_NEAR(force_n / depth_m / expected, 1, 0.05);
  // K_w = 1e6 N/m^3, a = l = 5 mm
  EXPECT_NEAR(1e6 * M_PI * 2.5e-5 * (1 + 2 * std::cyl_bessel_k(1, 1) / std::cyl_bessel_k(0, 1)), 303.1, 0.5);
}

}  // namespace
}  // namespace sectio::contact_test
