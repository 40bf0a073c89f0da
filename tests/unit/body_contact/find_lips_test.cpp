#include "sim_server/body_contact/find_lips.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

// A slab on a bed that a cut has freed: two boxes in one mesh, whose walls touch at rest and hang together nowhere.
struct SlabOnItsBed {
  static constexpr double kLong_m = 0.06, kWide_m = 0.02, kThick_m = 0.005;

  SlabOnItsBed() {
    const TriangleSoup bed = box(24, 8, 2, Vec3(kLong_m, kWide_m, kThick_m));
    const TriangleSoup slab = moved(box(22, 9, 2, Vec3(kLong_m, kWide_m, kThick_m)), Vec3(0, 0, kThick_m));
    const TriangleSoup both = joined(bed, slab);
    const TriangleMesh skin(both);
    std::vector<Triangle> triangles(skin.triangles().begin(), skin.triangles().end());
    for (Triangle& t : triangles)
      if (std::ranges::all_of(t.v, [&](VertexId v) { return is_between(skin.rest_body_m(v)); }))
        t.surface = Surface::wall;
    mesh = TriangleMesh(both.vertices_body_m, std::vector<std::uint8_t>(both.vertices_body_m.size(), 1), triangles, 0);
    particles = particles_at_rest(mesh.rest_body_m(), {});
    first_of_slab = static_cast<VertexId>(bed.vertices_body_m.size());
  }
  static bool is_between(const Vec3& rest_body_m) { return std::abs(rest_body_m.z() - kThick_m) < 1e-9; }

  void move_slab(const Vec3& way_m) {
    for (VertexId v = first_of_slab; v < mesh.vertex_slots(); ++v) particles.place(v, mesh.rest_body_m(v) + way_m);
  }
  std::vector<VertexId> vertices() const {
    std::vector<VertexId> all(mesh.vertex_slots());
    std::iota(all.begin(), all.end(), VertexId{0});
    return all;
  }
  std::vector<BodyContact> contacts(LipFinder& finder) {
    std::vector<BodyContact> found;
    finder.find({0, mesh, particles}, 0.001, found);
    return found;
  }

  TriangleMesh mesh;
  ParticleState particles;
  VertexId first_of_slab = 0;
};

TEST(Lips, are_found_where_their_walls_hang_together_nowhere) {
  SlabOnItsBed tissue;
  LipFinder finder;
  const std::vector<VertexId> all = tissue.vertices();
  finder.follow(tissue.mesh, all);
  const auto walls = static_cast<std::size_t>(
      std::ranges::count_if(all, [&](VertexId v) { return SlabOnItsBed::is_between(tissue.mesh.rest_body_m(v)); }));
  for (std::size_t step = 0; step * LipFinder::kSearches < walls; ++step) tissue.contacts(finder);

  constexpr double kSunk_m = 3e-4;
  tissue.move_slab({0.001, 0, -kSunk_m});  // it has slid aside, too
  std::size_t most = 0;
  for (int step = 0; step < 8; ++step) {  // vertices that were apart are looked at again after a pause
    const std::vector<BodyContact> found = tissue.contacts(finder);
    most = std::max(most, found.size());
    for (const BodyContact& c : found) EXPECT_NEAR(c.depth_m, kSunk_m, 1e-6);
  }
  EXPECT_GT(most, walls * 8 / 10) << "but for those that have slid off an edge";

  tissue.move_slab({0, 0, 0.002});
  EXPECT_TRUE(tissue.contacts(finder).empty()) << "apart";
}

TEST(Lips, are_pushed_apart_in_each_step_that_they_are_in_each_other) {
  SlabOnItsBed tissue;
  LipFinder finder;
  finder.follow(tissue.mesh, tissue.vertices());
  for (std::size_t step = 0; step < tissue.mesh.vertex_slots(); ++step) tissue.contacts(finder);
  tissue.move_slab({0, 0, -0.002});
  for (int step = 0; step < 8; ++step) tissue.contacts(finder);  // none pauses still
  const std::size_t deep = tissue.contacts(finder).size();
  ASSERT_GT(deep, 0);
  for (int step = 0; step < 8; ++step) EXPECT_EQ(tissue.contacts(finder).size(), deep);
}

TEST(Lips, keep_the_walls_to_which_they_have_slid) {
  SlabOnItsBed tissue;
  LipFinder finder;
  finder.follow(tissue.mesh, tissue.vertices());
  const auto rest = [&] {  // so long that each vertex is searched for once more
    for (std::size_t step = 0; step < tissue.mesh.vertex_slots(); ++step) tissue.contacts(finder);
    return tissue.contacts(finder).size();
  };
  rest();
  constexpr double kSunk_m = 3e-4;
  tissue.move_slab({0, 0, -kSunk_m});
  const std::size_t before = rest();
  for (double slid_m = 0; slid_m < 0.012; slid_m += 2e-4) {
    tissue.move_slab({slid_m, 0, -kSunk_m});
    tissue.contacts(finder);
  }
  EXPECT_GT(rest(), before * 7 / 10) << "a fifth of the slab is beyond its bed";
}

TEST(Lips, follow_walls_that_change) {
  SlabOnItsBed tissue;
  LipFinder finder;
  const std::vector<VertexId> all = tissue.vertices();
  finder.follow(tissue.mesh, all);
  for (std::size_t step = 0; step < all.size(); ++step) tissue.contacts(finder);
  tissue.move_slab({0, 0, -3e-4});
  ASSERT_FALSE(tissue.contacts(finder).empty());
  // The walls become skin, as they are for a mesh in which the cut was never made.
  std::vector<Triangle> triangles(tissue.mesh.triangles().begin(), tissue.mesh.triangles().end());
  for (Triangle& t : triangles) t.surface = Surface::skin;
  tissue.mesh = TriangleMesh(std::vector<Vec3>(tissue.mesh.rest_body_m().begin(), tissue.mesh.rest_body_m().end()),
                             std::vector<std::uint8_t>(all.size(), 1), triangles, 1);
  finder.follow(tissue.mesh, all);
  EXPECT_TRUE(tissue.contacts(finder).empty());
}

}  // namespace
}  // namespace sectio::test
