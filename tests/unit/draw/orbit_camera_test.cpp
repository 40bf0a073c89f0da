#include "render_client/draw/orbit_camera.h"

#include <gtest/gtest.h>

namespace sectio::draw_test {
namespace {

constexpr double kAspect = 1.6;

Camera some_camera() {
  return {Vec3(0.1, -0.4, 0.3), Vec3(0.02, 0.01, 0.05), Vec3::UnitZ(), 35};
}

TEST(OrbitCamera, a_ray_goes_through_what_is_drawn_at_its_place) {
  OrbitCamera camera(some_camera());
  camera.orbit(0.7, 0.2);
  camera.pan(0.1, -0.2);
  for (const double aspect : {kAspect, 1.0, 0.5})
    for (const double x : {-0.9, 0.0, 0.4})
      for (const double y : {-0.5, 0.8}) {
        const Ray ray = camera.ray(x, y, aspect);
        const Vec3 place = camera.project(ray.from_world_m + 0.3 * ray.along_world, aspect);
        EXPECT_NEAR(place.x(), x, 1e-9);
        EXPECT_NEAR(place.y(), y, 1e-9);
      }
}

TEST(OrbitCamera, an_upright_picture_is_as_wide_as_one_of_4_to_3) {
  const OrbitCamera camera(some_camera());
  const double far_m = (some_camera().target_world_m - some_camera().eye_world_m).norm();
  const auto seen_at = [&](double x, double y, double aspect) {
    return camera.project(some_camera().eye_world_m + far_m * camera.ray(x, y, 4.0 / 3).along_world, aspect);
  };
  EXPECT_NEAR(seen_at(0.9, 0, 0.46).x(), 0.9, 1e-9);
  EXPECT_NEAR(seen_at(0, 0.9, 0.46).y(), 0.9 * 0.46 * 3 / 4, 1e-9);
  EXPECT_NEAR(seen_at(0.9, 0, 2).x(), 0.9 * 2 / 3, 1e-9);
  EXPECT_NEAR(seen_at(0, 0.9, 2).y(), 0.9, 1e-9);
}

TEST(OrbitCamera, turns_about_its_target_and_never_over_the_pole) {
  OrbitCamera camera(some_camera());
  const double distance_m = (some_camera().eye_world_m - some_camera().target_world_m).norm();
  for (int i = 0; i < 200; ++i) {
    camera.orbit(0.1, 0.1);
    const Vec3 arm = camera.camera().eye_world_m - camera.camera().target_world_m;
    EXPECT_NEAR(arm.norm(), distance_m, 1e-9);
    EXPECT_LT(arm.normalized().z(), 0.9999);
  }
  EXPECT_GT((camera.camera().eye_world_m - camera.camera().target_world_m).normalized().z(), 0.99);
}

TEST(OrbitCamera, stays_within_its_distances) {
  OrbitCamera camera(some_camera());
  for (int i = 0; i < 100; ++i) camera.zoom(0.5);
  EXPECT_NEAR((camera.camera().eye_world_m - camera.camera().target_world_m).norm(), 0.02, 1e-9);
  for (int i = 0; i < 100; ++i) camera.zoom(2);
  EXPECT_NEAR((camera.camera().eye_world_m - camera.camera().target_world_m).norm(), 5, 1e-9);
}

TEST(OrbitCamera, panning_moves_what_is_seen_with_the_pointer) {
  OrbitCamera camera(some_camera());
  const Vec3 target = some_camera().target_world_m;
  camera.pan(0.25, 0.1);
  const Vec3 place = camera.project(target, kAspect);
  EXPECT_NEAR(place.x(), 2 * 0.25 / kAspect, 1e-9);
  EXPECT_NEAR(place.y(), 2 * 0.1, 1e-9);
}

}  // namespace
}  // namespace sectio::draw_test
