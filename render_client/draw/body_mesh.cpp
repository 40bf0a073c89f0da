#include "render_client/draw/body_mesh.h"

#include <algorithm>
#include <limits>

#include "render_client/draw/tissue_noise.h"

namespace sectio {

void compute_normals(std::span<CanvasVertex> vertices, std::span<const std::uint32_t> indices) {
  for (CanvasVertex& vertex : vertices) vertex.normal.setZero();
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    CanvasVertex &a = vertices[indices[i]], &b = vertices[indices[i + 1]], &c = vertices[indices[i + 2]];
    const Vec3f n = (b.position_m - a.position_m).cross(c.position_m - a.position_m);
    a.normal += n;
    b.normal += n;
    c.normal += n;
  }
  for (CanvasVertex& vertex : vertices) {
    const float length = vertex.normal.norm();
    constexpr float kHuge = std::numeric_limits<float>::max();
    if (length > 1e-30f && length < kHuge) {
      vertex.normal /= length;
    } else {
      vertex.normal = Vec3f::UnitZ();
    }
  }
}

namespace {

constexpr float kDeep_m = 0.03f;     // a wall vertex below the lips, until it is measured
constexpr float kAcross_m = 0.002f;  // a wall that goes from lip to lip and has no vertex below them
constexpr float kCrease = 0.25f;     // cosine between the normals, at rest, of triangles that are smooth at a vertex

}  // namespace

template <class Belongs>
void BodyMesh::add_triangles(const BodyFrame& body, const Belongs& belongs) {
  const std::size_t first = source_.size();
  std::vector<std::uint32_t> drawn_vertex(body.rest_body_m.size(), kNone);  // the first copy of each vertex
  std::vector<std::uint32_t> next_copy;
  std::vector<Vec3f> normal;  // the copy's first triangle has it, at rest
  for (const Triangle& triangle : body.triangles) {
    if (!triangle.alive() || !belongs(triangle)) continue;
    const auto& x = body.rest_body_m;
    const Vec3f a = x[triangle.v[0]], b = x[triangle.v[1]], c = x[triangle.v[2]];
    const Vec3f n = (b - a).cross(c - a).stableNormalized();
    for (const VertexId v : triangle.v) {
      std::uint32_t copy = drawn_vertex[v];
      while (copy != kNone && !n.isZero() && normal[copy - first].dot(n) < kCrease) copy = next_copy[copy - first];
      if (copy == kNone) {
        copy = static_cast<std::uint32_t>(source_.size());
        source_.push_back(v);
        next_copy.push_back(drawn_vertex[v]);
        normal.push_back(n);
        drawn_vertex[v] = copy;
      }
      indices_.push_back(copy);
    }
  }
}

void BodyMesh::arrange(const BodyFrame& body) {
  indices_.clear();
  source_.clear();
  add_triangles(body, [](const Triangle& t) { return t.surface == Surface::skin; });
  skin_index_count_ = static_cast<std::uint32_t>(indices_.size());
  std::vector<std::uint8_t> on_skin(body.rest_body_m.size(), 0);
  for (const VertexId v : source_) on_skin[v] = 1;
  const auto from_lip_to_lip = [&](const Triangle& t) { return on_skin[t.v[0]] && on_skin[t.v[1]] && on_skin[t.v[2]]; };
  const auto first_wall = source_.size();
  add_triangles(body, [&](const Triangle& t) { return t.surface == Surface::wall && !from_lip_to_lip(t); });
  const auto first_across = source_.size();
  add_triangles(body, [&](const Triangle& t) { return t.surface == Surface::wall && from_lip_to_lip(t); });
  vertices_.assign(source_.size(), {});
  for (std::size_t i = 0; i < source_.size(); ++i) vertices_[i].rest_m = body.rest_body_m[source_[i]];
  std::vector<float> depth_m(body.rest_body_m.size(), kDeep_m);
  for (std::size_t i = first_wall; i < first_across; ++i)
    if (on_skin[source_[i]]) depth_m[source_[i]] = 0;
  measure_depth(first_across, depth_m);
  for (std::size_t i = first_wall; i < source_.size(); ++i)
    vertices_[i].depth_m = i < first_across ? depth_m[source_[i]] : kAcross_m;
  for (std::size_t i = 0; i < first_wall; ++i) vertices_[i].pattern = broad_pattern_at(vertices_[i].rest_m);
  is_coarse_ = mean_skin_edge_m() > kCoarseSkin_m;
}

float BodyMesh::mean_skin_edge_m() const {
  double sum_m = 0;
  for (std::size_t i = 0; i < skin_index_count_; i += 3)
    for (std::size_t k = 0; k < 3; ++k)
      sum_m += (vertices_[indices_[i + k]].rest_m - vertices_[indices_[i + (k + 1) % 3]].rest_m).norm();
  return static_cast<float>(sum_m / std::max(skin_index_count_, 1u));
}

// The shortest way along wall edges to the skin, at rest, by relaxation until nothing changes. Walls are a few
// triangles deep, so that a few sweeps do; the limit only bounds the work on a strange mesh.
void BodyMesh::measure_depth(std::size_t end, std::vector<float>& depth_m) const {
  constexpr int kMaxSweeps = 24;
  bool changed = true;
  for (int sweep = 0; changed && sweep < kMaxSweeps; ++sweep) {
    changed = false;
    for (std::size_t i = skin_index_count_; i + 2 < indices_.size(); i += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = indices_[i + k], b = indices_[i + (k + 1) % 3];
        if (a >= end || b >= end) continue;
        const float length_m = (vertices_[a].rest_m - vertices_[b].rest_m).norm();
        float &depth_a = depth_m[source_[a]], &depth_b = depth_m[source_[b]];
        if (depth_a + length_m < depth_b) depth_b = depth_a + length_m, changed = true;
        if (depth_b + length_m < depth_a) depth_a = depth_b + length_m, changed = true;
      }
    }
  }
}

Eigen::AlignedBox3d BodyMesh::rest_box() const {
  Eigen::AlignedBox3d box;
  for (const CanvasVertex& vertex : vertices_) box.extend(vertex.rest_m.cast<double>());
  return box;
}

bool BodyMesh::move(const BodyFrame& body) {
  if (body.positions_world_m.size() < body.rest_body_m.size()) return false;
  bool finite = true;
  for (std::size_t i = 0; i < source_.size(); ++i) {
    const Vec3f& p = body.positions_world_m[source_[i]];
    finite = finite && p.allFinite();
    vertices_[i].position_m = p;
  }
  if (!finite) return false;
  compute_normals(vertices_, indices_);
  return true;
}

void BodyMesh::set_scalars(const ScalarField* field, float least, float most) {
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const float value = field && source_[i] < field->values.size() ? field->values[source_[i]] : least;
    const float share = (value - least) / (most - least);
    vertices_[i].scalar = share > 0 ? std::min(share, 1.0f) : 0;
  }
}

}  // namespace sectio
