// The surface of a volume in slots, after any cuts: always a closed manifold, also where it touches itself in a vertex.
#include "sim_server/volume/surface_map.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "common/mesh/check.h"
#include "sim_server/volume/tets/collapse.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/random.h"
#include "tests/support/tet_shapes.h"

namespace sectio::volume_test {
namespace {

// A volume, its surface in slots, and what it would be to cut them together.
struct Cut {
  Cut() : volume(test::tet_box(4, 4, 4, Vec3::Constant(0.08))), surface(first_slots(), volume.vertex_count()) {
    const TetSurface whole = surface_of(volume.mesh());
    mesh = TriangleMesh(whole.soup);
  }
  static std::vector<VertexId> first_slots() {
    return surface_of(test::tet_box(4, 4, 4, Vec3::Constant(0.08))).of_volume;
  }

  // False when edges are pinched, and nothing has changed.
  bool along(const CutSheet& sheet) {
    cut(volume, sheet, {});
    const BoundaryChange change = boundary_change(volume.change().tetrahedra);
    pinched += surface.pinched_edges(mesh, change).size();
    if (!surface.pinched_edges(mesh, change).empty()) {
      volume.undo_to(0);
      return false;
    }
    const std::vector<Vec4f> nothing(mesh.vertex_slots(), Vec4f::Zero());
    MeshDraft draft(mesh, {nothing, nothing});
    SurfaceMap::Change slots;
    const auto state = [&](VertexId v) { return VertexState{volume.vertex(v).rest_body_m, {}, {}}; };
    EXPECT_TRUE(surface.plan(
        mesh, change, {}, state, [](const Corners3&) { return Surface::wall; }, draft, slots));
    EXPECT_EQ(apply(draft.delta(), mesh), draft.delta().empty() ? ApplyStatus::malformed : ApplyStatus::applied);
    volume.forget();
    surface.accept(slots);
    return true;
  }
  // All that can. How many have been on the surface.
  int collapse() {
    int on_surface = 0;
    for (VertexId v = 0; v < volume.vertex_count(); ++v) {
      const auto onto = collapse_onto(volume, v, 0.3);
      if (!onto) continue;
      const BoundaryChange change = boundary_change(volume.collapse_change(v, *onto).tetrahedra);
      on_surface += !change.removed.empty();
      const std::vector<Vec4f> nothing(mesh.vertex_slots(), Vec4f::Zero());
      MeshDraft draft(mesh, {nothing, nothing});
      SurfaceMap::Change slots;
      EXPECT_TRUE(surface.plan(
          mesh, change, {}, [](VertexId) { return VertexState(); }, [](const Corners3&) { return Surface::wall; },
          draft, slots));
      EXPECT_EQ(draft.delta().empty(), change.removed.empty());
      EXPECT_TRUE(slots.taken.empty()) << "no new slots";
      EXPECT_EQ(slots.freed.size(), change.removed.empty() ? 0u : 1u);
      EXPECT_TRUE(draft.delta().empty() || apply(draft.delta(), mesh) == ApplyStatus::applied);
      volume.collapse(v, *onto);
      surface.accept(slots);
    }
    return on_surface;
  }
  // Vertices that have more than one slot.
  std::size_t shared() const {
    std::size_t n = 0;
    for (VertexId v = 0; v < volume.vertex_count(); ++v) n += surface.slots_of(v).size() > 1;
    return n;
  }

  TetTopology volume;
  SurfaceMap surface;
  TriangleMesh mesh;
  std::size_t pinched = 0;
};

TEST(SurfaceMap, is_a_closed_manifold_of_the_same_volume_after_any_cuts_and_collapses) {
  std::size_t shared = 0, pinched = 0, cuts = 0;
  int collapsed = 0;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    test::Random random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
    Cut block;
    const double volume_m3 = check(block.mesh).volume_m3;
    for (int n = 0; n < 12; ++n) {
      const Vec3 at = Vec3::Constant(0.04) + 0.035 * vector(), normal = vector().normalized();
      const Vec3 u = 0.03 * normal.unitOrthogonal(), w = 0.03 * normal.cross(normal.unitOrthogonal());
      cuts += block.along({{at - u - w, at + u - w, at + u + w, at - u + w}, {}});
      if (seed >= 6) collapsed += block.collapse();
      const SurfaceReport report = check(block.mesh);
      ASSERT_TRUE(report.valid()) << report.first_defect;
      ASSERT_NEAR(report.volume_m3, volume_m3, (seed < 6 ? 1e-9 : 1e-4) * volume_m3);
      // Slots and vertices name each other.
      for (VertexId slot = 0; slot < block.mesh.vertex_slots(); ++slot) {
        if (!block.mesh.vertex_alive(slot)) continue;
        const VertexId v = block.surface.vertex_of(slot);
        ASSERT_EQ(block.mesh.rest_body_m(slot), block.volume.vertex(v).rest_body_m);
        ASSERT_EQ(std::ranges::count(block.surface.slots_of(v), slot), 1);
      }
    }
    shared += block.shared();
    pinched += block.pinched;
  }
  EXPECT_GT(cuts, 100u);
  EXPECT_GT(collapsed, 100);
  EXPECT_GT(shared, 0u) << "no surface touches itself: the case is not tested";
  EXPECT_GT(pinched, 0u) << "no edge is pinched: the case is not tested";
}

}  // namespace
}  // namespace sectio::volume_test
