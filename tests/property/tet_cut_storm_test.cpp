// A storm of random cuts of volumes, in deformed states, into each other: rectangles of all sizes.
#include <gtest/gtest.h>

#include <random>

#include "sim_server/tet_cutting/tet_cut.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

class TetStorm : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, TetStorm, testing::Range(0u, 50u));

TEST_P(TetStorm, every_cut_leaves_a_conforming_volume_of_the_same_size_and_can_be_undone) {
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.08, 0.08, 0.08));
  test::jitter(mesh, 0.003);
  TetTopology volume(mesh);
  // A shear, a stretch and a bend, so that places at rest and in the world differ.
  const Vec3 bend = 3 * vector();
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3 p = mesh.vertices_body_m[v] - Vec3(0.04, 0.04, 0.04);
    volume.set_state(
        v, Vec3(1.2 * p.x() + bend.x() * p.y() * p.z(), 0.9 * p.y() + 0.2 * p.x(), p.z() + bend.y() * p.x() * p.x()),
        vector());
  }
  const double whole_m3 = check(mesh).volume_m3;
  const TetCutSettings settings{GetParam() % 3 == 0 ? 0.1 : 0.05, GetParam() % 5 == 4};
  for (int n = 0; n < 20; ++n) {
    const Vec3 at = 0.035 * vector(), normal = vector().normalized();
    const double size = n % 4 == 0 ? 1 : 0.005 + 0.03 * std::abs(uniform(random));
    const Vec3 u = size * normal.unitOrthogonal(), w = size * normal.cross(normal.unitOrthogonal());
    const CutSheet sheet{{at - u - w, at + u - w, at + u + w, at - u + w}};
    const std::size_t mark = volume.mark(), tets = volume.tetrahedra().size(), vertices = volume.vertex_count();
    const TetMesh before = volume.mesh();
    cut(volume, sheet, settings);
    const TetReport report = check(volume.mesh());
    ASSERT_TRUE(report.conforming) << "cut " << n << ": " << report.first_defect;
    ASSERT_NEAR(report.volume_m3, whole_m3, 1e-12 * whole_m3) << n;
    if (n % 5 != 2) continue;
    volume.undo_to(mark);
    ASSERT_EQ(volume.tetrahedra().size(), tets);
    ASSERT_EQ(volume.vertex_count(), vertices);
    ASSERT_EQ(volume.mesh().tetrahedra, before.tetrahedra);
    cut(volume, sheet, settings);
    if (volume.tetrahedra().size() > 20000) break;
  }
}

}  // namespace
}  // namespace sectio
