// The matrices of a camera, and a camera that shows all bodies.
// OpenGL conventions: the camera looks down -z, clip space is [-1, 1]^3.
#pragma once

#include <Eigen/Core>

#include "render_client/replica/frame.h"

namespace sectio {

// Rows: right, up and backward in the world; usable ones for an up vector along the line of sight and for an eye on its
// target.
Mat3 view_axes(const Camera& camera);

// Tangent of half the field of view, which is vertical and held between 1 and 150 degrees.
double tangent_of_half_angle(const Camera& camera);
// The tangents from the middle of a picture to its right and to its upper border. aspect: width over height.
Eigen::Vector2d half_slopes(const Camera& camera, double aspect);

// A rigid transform.
Eigen::Matrix4f view_from_world(const Camera& camera);

// Near and far planes follow the distance from eye to target.
Eigen::Matrix4f projection(const Camera& camera, double aspect);

// A plane in the world; the tissue on the normal's side is left out of a picture.
struct SectionPlane {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit
};
// The plane through the camera's target, facing its eye.
SectionPlane section_at_target(const Camera& camera);

// Two eyes side by side that look in parallel, each through a frustum that is shifted so that both meet at the
// convergence distance. A point at that distance has no disparity. No eye is turned inwards, so that the heights in
// both pictures are the same.
struct Stereo {
  double eye_separation_m = 0;  // 0: a thirtieth of the convergence distance, which is easy on the eyes
  double convergence_m = 0;     // along the line of sight; 0: where the target is
};

struct EyeView {
  Eigen::Matrix4f view_from_world, projection;
};
// side: -1 the left eye, 1 the right one. aspect: width over height of the picture of one eye.
EyeView eye_view(const Camera& camera, double aspect, const Stereo& stereo, int side);

// Keeps the direction of sight and moves target and eye so that all finite vertices of bodies are in the picture.
// Without such a vertex it returns the frame's own camera.
Camera fit_camera(const Frame& frame, double aspect);

}  // namespace sectio
