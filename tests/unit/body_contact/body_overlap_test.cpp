#include "sim_server/body_contact/body_overlap.h"

#include <gtest/gtest.h>

#include "sim_server/collision/surface_tree.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

// A cube of 6 mm, loose or a cavity, in the mesh of one of 30 mm, at a place.
std::size_t sunken_at(const Vec3& place_m, bool is_cavity = false) {
  TriangleSoup small = moved(box(3, 3, 3, Vec3::Constant(0.006)), place_m);
  for (auto& t : small.triangles)
    if (is_cavity) std::swap(t[1], t[2]);
  const TriangleMesh mesh(joined(box(6, 6, 6, Vec3::Constant(0.03)), small));
  std::vector<Vec3f> now;
  for (const Vec3& x : mesh.rest_body_m()) now.push_back(x.cast<float>());
  const SurfaceView view{mesh, now};
  const SurfaceTree tree(view);
  return sunken_skin({view, tree});
}

TEST(BodyOverlap, skin_of_a_loose_part_that_has_sunk_into_tissue_is_counted) {
  EXPECT_EQ(sunken_at({0.0101, 0.0102, 0.0103}), 56u) << "all of it";
  EXPECT_GT(sunken_at({0.0101, 0.0102, 0.027}), 20u) << "its half";
  EXPECT_EQ(sunken_at({0.0101, 0.0102, 0.0299}), 0u) << "it lies on the skin, and dents it";
  EXPECT_EQ(sunken_at({0.0101, 0.0102, 0.04}), 0u);
}

TEST(BodyOverlap, the_wall_of_a_cavity_has_sunk_into_nothing) {
  EXPECT_EQ(sunken_at({0.0101, 0.0102, 0.0103}, true), 0u);
}

}  // namespace
}  // namespace sectio::test
