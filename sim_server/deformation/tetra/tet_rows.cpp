#include "sim_server/deformation/tetra/tet_rows.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "sim_server/deformation/tetra/tet_star.h"

namespace sectio {
namespace {

constexpr std::size_t kWindow = 256;

// Greedy, in the order of the vertices: the smallest colour that no vertex of a common tetrahedron has.
std::vector<std::uint32_t> colours_of(const TetMesh& mesh, const TetStars& stars) {
  std::vector<std::uint32_t> colour(mesh.vertices_body_m.size(), kNone);
  std::vector<std::uint32_t> taken_by;
  for (VertexId v = 0; v < colour.size(); ++v) {
    for (const std::uint32_t t : stars.of(v))
      for (const VertexId w : mesh.tetrahedra[t]) {
        if (colour[w] == kNone) continue;
        if (colour[w] >= taken_by.size()) taken_by.resize(colour[w] + 1, kNone);
        taken_by[colour[w]] = v;
      }
    std::uint32_t free = 0;
    while (free < taken_by.size() && taken_by[free] == v) ++free;
    colour[v] = free;
  }
  return colour;
}

// Rows in the order of the slices: by colour, then by number of faces within windows.
std::vector<VertexId> order_of(const std::vector<std::uint32_t>& colour, const TetStars& stars) {
  std::vector<VertexId> order(colour.size());
  for (VertexId v = 0; v < order.size(); ++v) order[v] = v;
  std::stable_sort(order.begin(), order.end(), [&](VertexId a, VertexId b) { return colour[a] < colour[b]; });
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last < order.size() && last < first + kWindow && colour[order[last]] == colour[order[first]]) ++last;
    std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(first),
                     order.begin() + static_cast<std::ptrdiff_t>(last),
                     [&](VertexId a, VertexId b) { return stars.of(a).size() > stars.of(b).size(); });
    first = last;
  }
  return order;
}

class RowWriter {
 public:
  RowWriter(const TetMesh& mesh, const TetStiffness& stiffness, const TetStars& stars)
      : mesh_(mesh), stiffness_(stiffness), stars_(stars), shape_(mesh.tetrahedra.size()), row_(mesh, stars) {
    for (std::size_t t = 0; t < shape_.size(); ++t) shape_[t] = tet_shape(mesh, mesh.tetrahedra[t]);
  }

  void write(TetSlice& slice, std::span<TetEdgeColumn> edges, std::span<TetFaceColumn> faces,
             std::span<TetBlockColumn> blocks, std::uint32_t lane, VertexId v) {
    slice.offset[lane] = byte_offset(v);
    double volume = 0, bulk = 0;
    std::size_t f = 0;
    row_.begin(v);
    for (const std::uint32_t t : stars_.of(v)) {
      const TetShape& shape = shape_[t];
      const auto corner =
          static_cast<std::size_t>(std::ranges::find(mesh_.tetrahedra[t], v) - mesh_.tetrahedra[t].begin());
      const auto& side = kTetFaces[corner];  // counter-clockwise from outside
      faces[f].a[lane] = byte_offset(mesh_.tetrahedra[t][side[0]]);
      faces[f].b[lane] = byte_offset(mesh_.tetrahedra[t][side[2]]);
      faces[f].c[lane] = byte_offset(mesh_.tetrahedra[t][side[1]]);
      faces[f].shear[lane] = static_cast<float>(stiffness_.shear_pa[t] / 6);
      blocks[f].bulk[lane] = static_cast<float>(stiffness_.bulk_pa[t] / (36 * shape.volume_m3));
      ++f;
      volume += shape.volume_m3;
      bulk += stiffness_.bulk_pa[t] * shape.volume_m3;
      for (std::size_t k = 0; k < 4; ++k) {
        if (k == corner) continue;
        row_.add(mesh_.tetrahedra[t][k],
                 -stiffness_.shear_pa[t] * shape.volume_m3 * shape.gradient[corner].dot(shape.gradient[k]));
      }
    }
    for (; f < faces.size(); ++f) faces[f].a[lane] = faces[f].b[lane] = faces[f].c[lane] = byte_offset(v);
    bulk /= volume;
    double sum = 0;
    std::size_t e = 0;
    for (const auto& [to, weight] : row_.entries()) {
      edges[e].offset[lane] = byte_offset(to);
      edges[e++].weight[lane] = static_cast<float>(weight);
      sum += weight;
    }
    for (; e < edges.size(); ++e) edges[e].offset[lane] = byte_offset(v);
    slice.pressure_scale[lane] = static_cast<float>(bulk / (24 * 6 * volume));
    slice.pressure_shift[lane] = static_cast<float>(bulk / 24);
    slice.weight_sum[lane] = static_cast<float>(sum);
  }

 private:
  const TetMesh& mesh_;
  const TetStiffness& stiffness_;
  const TetStars& stars_;
  std::vector<TetShape> shape_;
  NeighbourRow row_;
};

}  // namespace

void TetRows::build(const TetMesh& mesh, const TetStiffness& stiffness) {
  *this = TetRows();
  const TetStars stars(mesh);
  const std::vector<std::uint32_t> colour = colours_of(mesh, stars);
  const std::vector<VertexId> order = order_of(colour, stars);
  NeighbourRow row(mesh, stars);
  for (std::size_t n = 0; n < order.size();) {
    TetSlice slice;
    slice.colour = colour[order[n]];
    slice.first_edge = static_cast<std::uint32_t>(edges_.size());
    slice.first_face = static_cast<std::uint32_t>(faces_.size());
    while (slice.count < kLanes && n < order.size() && colour[order[n]] == slice.colour) {
      const VertexId v = order[n++];
      slice.offset[slice.count++] = byte_offset(v);
      slice.faces = std::max(slice.faces, static_cast<std::uint32_t>(stars.of(v).size()));
      row.begin(v);
      slice.edges = std::max(slice.edges, static_cast<std::uint32_t>(row.entries().size()));
    }
    // Lanes without a row gather some vertex; what they compute is not stored.
    for (std::uint32_t lane = slice.count; lane < kLanes; ++lane) slice.offset[lane] = slice.offset[0];
    most_faces_ = std::max(most_faces_, slice.faces);
    edges_.resize(edges_.size() + slice.edges);
    faces_.resize(faces_.size() + slice.faces);
    slices_.push_back(slice);
  }
  blocks_.resize(faces_.size());
  pressure_scale_.resize(mesh.vertices_body_m.size());
  RowWriter writer(mesh, stiffness, stars);
  for (TetSlice& slice : slices_) {
    const std::span edges(edges_.data() + slice.first_edge, slice.edges);
    const std::span faces(faces_.data() + slice.first_face, slice.faces);
    for (std::uint32_t lane = 0; lane < slice.count; ++lane) {
      const VertexId v = vertex_at(slice.offset[lane]);
      writer.write(slice, edges, faces, {blocks_.data() + slice.first_face, slice.faces}, lane, v);
      pressure_scale_[v] = slice.pressure_scale[lane];
    }
    for (std::uint32_t lane = slice.count; lane < kLanes; ++lane) {
      for (TetEdgeColumn& column : edges) column.offset[lane] = slice.offset[0];
      for (TetFaceColumn& column : faces) column.a[lane] = column.b[lane] = column.c[lane] = slice.offset[0];
      slice.weight_sum[lane] = 1;
    }
  }
}

void TetRows::set(std::span<const TetVertex> vertices, double step_s) {
  step_s_ = static_cast<float>(step_s);
  for (TetSlice& slice : slices_)
    for (std::uint32_t lane = 0; lane < slice.count; ++lane) {
      const TetVertex& vertex = vertices[vertex_at(slice.offset[lane])];
      slice.step_over_mass[lane] = static_cast<float>(step_s * vertex.inverse_mass);
      slice.gravity_share[lane] = static_cast<float>(vertex.gravity_share);
      double weights = 0;
      for (std::uint32_t e = 0; e < slice.edges; ++e)
        weights += std::abs(double{edges_[slice.first_edge + e].weight[lane]});
      slice.bound[lane] = static_cast<float>(2 * weights * vertex.inverse_mass);
    }
}

double TetRows::padding() const {
  double lanes = 0, used = 0;
  for (const TetSlice& slice : slices_) {
    lanes += kLanes * slice.faces;
    for (std::uint32_t lane = 0; lane < slice.count; ++lane)
      for (std::uint32_t f = 0; f < slice.faces; ++f)
        used += faces_[slice.first_face + f].a[lane] != slice.offset[lane];
  }
  return 1 - used / lanes;
}

}  // namespace sectio
