// A camera that a person moves: around its target, across, and nearer. A pure value.
#pragma once

#include "common/math/camera.h"

namespace sectio {

struct Ray {
  Vec3 from_world_m = Vec3::Zero();
  Vec3 along_world = -Vec3::UnitZ();  // unit
};

// The axes of a person who looks through the camera, level with the ground: right, away, up.
Mat3 level_axes(const Camera& camera);

class OrbitCamera {
 public:
  explicit OrbitCamera(const Camera& camera) : camera_(camera) {}

  const Camera& camera() const { return camera_; }

  // Turns about the target: to the right and up, in radians. It stops short of the poles of the up vector.
  void orbit(double right_rad, double up_rad);
  // Moves eye and target across the line of sight, in heights of the largest picture of 4:3 that fits.
  void pan(double right, double up);
  void move(const Vec3& by_world_m);
  // The distance to the target by this factor, within 2 cm to 5 m.
  void zoom(double factor);

  // The line of sight through a place of the picture, -1 to 1, y up.
  Ray ray(double x, double y, double aspect) const;
  // The place in the picture, in x and y, and the distance in front of the eye in z.
  Vec3 project(const Vec3& world_m, double aspect) const;

 private:
  Camera camera_;
};

}  // namespace sectio
