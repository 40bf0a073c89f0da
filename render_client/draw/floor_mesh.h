// The plane that things fall on, as cloth under the bodies: around where the camera looks, passing into the backdrop
// with distance, and darker beneath what is close above it, as light from all sides leaves it.
#pragma once

#include <cstdint>
#include <vector>

#include "render_client/draw/canvas.h"
#include "render_client/replica/frame.h"

namespace sectio {

class FloorMesh {
 public:
  FloorMesh();

  // `frame` has a floor.
  void move(const Frame& frame, const Camera& camera);

  const std::vector<CanvasVertex>& vertices() const { return vertices_; }
  const std::vector<std::uint32_t>& indices() const { return indices_; }  // never change

 private:
  void shade(const Frame& frame);

  std::vector<CanvasVertex> vertices_;
  std::vector<std::uint32_t> indices_;
  std::vector<float> height_m_, blurred_;
};

}  // namespace sectio
