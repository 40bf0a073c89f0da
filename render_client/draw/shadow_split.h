// Divides triangles by whether a shadow of an instrument can fall on them. A shader without shadows
// draws the others: in software the shadow takes a third of the time of a pixel, and most pixels lie in none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_client/draw/canvas.h"

namespace sectio {

class ShadowSplit {
 public:
  // Finds how far a mesh's vertices are from the shadows of a view's occluders. Its lamps hang at the camera.
  void look(const CanvasView& view, std::span<const CanvasVertex> vertices);

  struct Parts {
    IndexRange lit, shadowed;
  };
  // Appends the triangles of a range of `indices` to indices(), those first that are in the light for certain.
  Parts append(std::span<const std::uint32_t> indices, IndexRange range);
  // All indices appended since look().
  const std::vector<std::uint32_t>& indices() const { return sorted_; }

 private:
  bool is_lit(const std::uint32_t* corners) const;

  std::span<const CanvasVertex> vertices_;
  std::vector<float> clearance_m_;  // from each vertex to the nearest penumbra
  std::vector<std::uint32_t> sorted_, shadowed_;
};

}  // namespace sectio
