// A body's triangles arranged for drawing: skin first, then walls, with a normal for each (vertex, surface). So the
// lip between skin and wall is a crisp crease while both sides are smooth. Faces that meet in a vertex with a crease
// at rest have a normal each: those of a box at its edges, the two sides of a cut at its bottom and its ends.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_client/draw/canvas.h"
#include "render_client/replica/frame.h"

namespace sectio {

class BodyMesh {
 public:
  // For a new revision: takes the vertices and triangles. O(triangles).
  void arrange(const BodyFrame& body);
  // For every frame on the same triangles: takes positions and computes normals. False, and nothing to draw, when a
  // position in use is missing or not finite.
  [[nodiscard]] bool move(const BodyFrame& body);
  // After move(): takes the values of a field as shares of the range from `least` to `most`; without a field, zeros.
  void set_scalars(const ScalarField* field, float least = 0, float most = 1);
  // The box around all vertices that are drawn, at rest.
  Eigen::AlignedBox3d rest_box() const;
  // True when the skin's edges are too long for its vertices to carry the broad pattern (tissue_noise.h).
  bool is_coarse() const { return is_coarse_; }

  std::span<const CanvasVertex> vertices() const { return vertices_; }
  std::span<const std::uint32_t> indices() const { return indices_; }
  IndexRange skin() const { return {0, skin_index_count_}; }
  IndexRange walls() const {
    return {skin_index_count_, static_cast<std::uint32_t>(indices_.size()) - skin_index_count_};
  }

 private:
  template <class Belongs>
  void add_triangles(const BodyFrame& body, const Belongs& belongs);
  void measure_depth(std::size_t end, std::vector<float>& depth_m) const;
  float mean_skin_edge_m() const;

  std::vector<CanvasVertex> vertices_;
  std::vector<VertexId> source_;  // slot of each drawn vertex
  std::vector<std::uint32_t> indices_;
  std::uint32_t skin_index_count_ = 0;
  bool is_coarse_ = false;
};

// Area-weighted unit normals of the triangles.
void compute_normals(std::span<CanvasVertex> vertices, std::span<const std::uint32_t> indices);

}  // namespace sectio
