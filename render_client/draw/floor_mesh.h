// The plane that parts fall on, as cloth under the bodies. It lies around the point at which the camera looks, passes
// into the backdrop with distance, and is darker beneath bodies that are close above it (ambient occlusion).
#pragma once

#include <cstdint>
#include <vector>

#include "render_client/draw/canvas.h"
#include "render_client/replica/frame.h"

namespace sectio {

class FloorMesh {
 public:
  FloorMesh();

  // Requires a floor in `frame`. O(triangles).
  void move(const Frame& frame, const Camera& camera);

  const std::vector<CanvasVertex>& vertices() const { return vertices_; }
  const std::vector<std::uint32_t>& indices() const { return indices_; }  // never change

 private:
  void place(const Vec3f& middle_m, float half_m);
  void shade(const Frame& frame);

  std::vector<CanvasVertex> vertices_;
  std::vector<std::uint32_t> indices_;
  std::vector<float> height_m_, blurred_;
  Vec3f middle_m_ = Vec3f::Zero();
  float half_m_ = 0;  // half a side; 0: not placed yet
};

}  // namespace sectio
