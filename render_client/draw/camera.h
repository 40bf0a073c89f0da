// From a CameraView (eye, target, up, angle) to matrices, and a view that shows everything there is to see.
// OpenGL conventions: the camera looks down -z, clip space is [-1, 1]^3.
#pragma once

#include <Eigen/Core>

#include "render_client/replica/frame.h"

namespace sectio {

// Rigid. An up vector along the line of sight, or an eye on its target, is replaced by a usable one.
Eigen::Matrix4f view_from_world(const CameraView& camera);

// field_of_view_deg is vertical; near and far planes follow the distance from eye to target.
Eigen::Matrix4f projection(const CameraView& camera, double aspect);

// Keeps the direction of sight, moves target and eye so that all finite body vertices in use are in the picture.
// Without any it returns the frame's own camera.
CameraView fit_camera(const Frame& frame, double aspect);

}  // namespace sectio
