// Divides triangles by whether a shadow of an instrument can fall on them. Those it can't reach are drawn by a shader
// without shadows: in software the shadow takes a third of the time of a pixel, and most pixels lie in none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_client/draw/canvas.h"

namespace sectio {

class ShadowSplit {
 public:
  // Where the occluders of a view, whose lamps hang at the camera, leave the vertices of a mesh in the light.
  void look(const CanvasView& view, std::span<const CanvasVertex> vertices);

  struct Parts {
    IndexRange lit, shadowed;
  };
  // Appends the triangles of a range of `indices` to indices(), those first that are in the light for certain.
  Parts append(std::span<const std::uint32_t> indices, IndexRange range);
  // Since look().
  const std::vector<std::uint32_t>& indices() const { return sorted_; }

 private:
  bool is_lit(const std::uint32_t* corners) const;

  std::span<const CanvasVertex> vertices_;
  std::vector<float> clearance_m_;  // of each vertex from the nearest penumbra
  std::vector<std::uint32_t> sorted_, shadowed_;
};

}  // namespace sectio
