// Local updates after changes of topology against a rebuild from scratch.
#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::deformation_test {
namespace {

using test::MeshEditor;
using test::Particles;

void expect_rebuilt(const SurfaceSprings& local, const SurfaceSprings& fresh, const TriangleMesh& mesh) {
  ASSERT_EQ(local.rows().row_count(), mesh.vertex_count());
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    ASSERT_EQ(local.rows().contains(v), mesh.vertex_alive(v));
    if (!mesh.vertex_alive(v)) continue;
    ASSERT_EQ(local.rows().row(v), fresh.rows().row(v)) << v;
    ASSERT_EQ(local.rows().degree(v), fresh.rows().degree(v)) << v;
    for (std::uint32_t n = 0; n < local.rows().degree(v); ++n) {
      ASSERT_EQ(local.rows().half_edge(v, n), fresh.rows().half_edge(v, n)) << v;
    }
    ASSERT_EQ(local.mass_kg(v), fresh.mass_kg(v));
  }
}

// A short step, so that no row needs added mass and a rebuilt body is comparable.
SurfaceSpringSettings short_step() {
  SurfaceSpringSettings settings;
  settings.step_s = 1e-5;
  return settings;
}

TEST(SurfaceSpringsUpdate, equals_a_rebuild_after_random_local_changes) {
  test::Random random(5);
  TriangleMesh mesh = test::organ(2);
  MeshEditor editor(mesh);
  SurfaceSprings springs(mesh, {}, {}, short_step());
  std::uniform_real_distribution<double> part(0.3, 0.7);
  for (int n = 0; n < 1200; ++n) {
    std::vector<VertexId> touched;
    if (editor.can_undo() && random() % 3 == 0) {
      touched = editor.undo();
    } else {
      TriangleId t = static_cast<TriangleId>(random() % mesh.triangle_slots());
      while (!mesh.triangle(t).alive()) t = static_cast<TriangleId>(random() % mesh.triangle_slots());
      touched = editor.split_edge(mesh, t, static_cast<int>(random() % 3), part(random));
    }
    mesh = editor.mesh();
    springs.update(mesh, touched);
    if (n % 50 == 0) expect_rebuilt(springs, SurfaceSprings(mesh, {}, {}, short_step()), mesh);
  }
  const SurfaceSprings fresh(mesh, {}, {}, short_step());
  EXPECT_DOUBLE_EQ(springs.largest_stable_step_s(), fresh.largest_stable_step_s());
}

TEST(SurfaceSpringsUpdate, is_undone_exactly) {
  const TriangleMesh before = test::organ(2);
  MeshEditor editor(before);
  SurfaceSprings springs(before, {}, {}, {});
  const SurfaceSprings untouched = springs;
  Particles a(before, {});
  springs.update(editor.mesh(), editor.split_edge(before, 17, 1, 0.1));
  const std::vector<VertexId> touched = editor.undo();
  const TriangleMesh after = editor.mesh();
  springs.update(after, touched);
  expect_rebuilt(springs, untouched, after);
  EXPECT_EQ(springs.diagnostics().added_mass_fraction, 0);
}

// The next step uses the changed rows: edges and home spring pull a displaced new vertex back.
TEST(B_MSM, B_MSM_3_new_vertices_get_edge_springs_and_home_springs_to_their_own_places) {
  const TriangleMesh before = test::organ(2);
  MeshEditor editor(before);
  SurfaceSprings springs(before, {}, {}, test::no_gravity());
  Particles p(before, {});
  p.run(springs, 1000);
  const std::vector<VertexId> touched = editor.split_edge(before, 40, 0, 0.5);
  const TriangleMesh mesh = editor.mesh();
  p.grow(mesh);
  const VertexId m = touched.back();
  springs.update(mesh, touched);
  ASSERT_EQ(springs.rows().degree(m), 4u);
  EXPECT_GT(springs.rows().row(m).k_home, 0);
  EXPECT_LT((springs.rows().row(m).home_world_m - mesh.rest_body_m(m).cast<float>()).norm(), 1e-4f)
      << "but for tension";
  for (std::uint32_t n = 0; n < 4; ++n) {
    const HalfEdge e = springs.rows().half_edge(m, n);
    EXPECT_GT(e.k, 0);
    EXPECT_NEAR(e.k_l0 / e.k, 0.94 * (mesh.rest_body_m(m) - mesh.rest_body_m(e.to)).norm(), 1e-6);
  }
  p.run(springs, 1000);
  const Vec3 rest = p.at(m);
  EXPECT_LT((rest - mesh.rest_body_m(m)).norm(), 0.001);
  p.x[m].head<3>() += Vec3f(0.002f, 0, 0);
  p.run(springs, 1000);
  EXPECT_LT((p.at(m) - rest).norm(), 1e-6);
}

TEST(SurfaceSpringsUpdate, leaves_the_inside_of_a_cut_without_pretension) {
  MeshEditor editor(test::organ(1));
  editor.set_surface(0, Surface::wall);
  for (int i = 0; i < 3; ++i) editor.set_surface(editor.mesh().neighbour(0, i), Surface::wall);
  const TriangleMesh mesh = editor.mesh();
  const SurfaceSprings springs(mesh, {}, {}, {});
  const Triangle& wall = mesh.triangle(0);
  for (std::uint32_t n = 0; n < springs.rows().degree(wall.v[0]); ++n) {
    const HalfEdge e = springs.rows().half_edge(wall.v[0], n);
    const double strain =
        1 - double{e.k_l0} / double{e.k} / (mesh.rest_body_m(wall.v[0]) - mesh.rest_body_m(e.to)).norm();
    if (wall.corner_of(e.to) >= 0) {
      EXPECT_NEAR(strain, 0, 1e-6);
    } else {
      EXPECT_GT(strain, 0.02);
    }
  }
}

TEST(SurfaceSpringsUpdate, compacts_and_goes_on) {
  test::Random random(6);
  TriangleMesh mesh = test::organ(3);
  MeshEditor editor(mesh);
  SurfaceSprings springs(mesh, {}, {}, short_step());
  std::uint32_t most = 0;
  for (int n = 0; n < 400; ++n) {
    const auto t = static_cast<TriangleId>(random() % mesh.triangle_slots());
    const std::vector<VertexId> touched = editor.split_edge(mesh, t, 0, 0.5);
    mesh = editor.mesh();
    springs.update(mesh, touched);
    most = std::max(most, springs.rows().overflow_row_count());
  }
  EXPECT_GT(most, 200u);
  EXPECT_LT(springs.rows().overflow_row_count(), 257u);
  expect_rebuilt(springs, SurfaceSprings(mesh, {}, {}, short_step()), mesh);
}

}  // namespace
}  // namespace sectio::deformation_test
