// Blood along the lips of cuts: a ribbon on the skin beside each lip, so that a cut which lies closed is seen, too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_client/draw/canvas.h"
#include "render_client/replica/frame.h"

namespace sectio {

class LipLines {
 public:
  static constexpr float kWidth_m = 0.0002f;

  // For a new revision: finds the lips. O(triangles).
  void arrange(const BodyFrame& body);
  // For every frame on the same triangles; all positions in use are finite. O(lips).
  void move(const BodyFrame& body);

  bool empty() const { return indices_.empty(); }
  std::span<const CanvasVertex> vertices() const { return vertices_; }
  std::span<const std::uint32_t> indices() const { return indices_; }

 private:
  // An edge between two lip vertices, with skin to its left, and the third corner of its triangle.
  struct Lip {
    std::uint32_t a, b;
    VertexId across;
  };
  struct LipVertex {
    VertexId slot;
    Vec3f inward = Vec3f::Zero(), normal = Vec3f::Zero();  // sums over the lips here: to the inside of the skin
  };

  std::vector<Lip> lips_;
  std::vector<LipVertex> at_lips_;
  std::vector<CanvasVertex> vertices_;  // four a lip: a, b, and their places beside it
  std::vector<std::uint32_t> indices_;
};

}  // namespace sectio
