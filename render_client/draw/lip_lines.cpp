#include "render_client/draw/lip_lines.h"

#include <algorithm>
#include <utility>

#include "render_client/draw/tissue_noise.h"

namespace sectio {
namespace {

constexpr float kLift_m = 0.00004f;  // above the skin
constexpr float kSmooth = 0.9f;      // cosine between the normals of lips without an edge of the body between them

using HalfEdge = std::pair<VertexId, VertexId>;

}  // namespace

void LipLines::arrange(const BodyFrame& body) {
  lips_.clear();
  at_lips_.clear();
  vertices_.clear();
  indices_.clear();
  std::vector<HalfEdge> beside_walls;  // edges of walls, seen from their other side
  std::vector<std::uint8_t> on_wall(body.rest_body_m.size(), 0);
  for (const Triangle& t : body.triangles) {
    if (!t.alive() || t.surface != Surface::wall) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      beside_walls.emplace_back(t.v[(i + 1) % 3], t.v[i]);
      on_wall[t.v[i]] = 1;
    }
  }
  std::sort(beside_walls.begin(), beside_walls.end());
  std::vector<std::uint32_t> place(body.rest_body_m.size(), kNone);
  const auto place_of = [&](VertexId v) {
    if (place[v] == kNone) {
      place[v] = static_cast<std::uint32_t>(at_lips_.size());
      at_lips_.push_back({v});
    }
    return place[v];
  };
  for (const Triangle& t : body.triangles) {
    if (!t.alive() || t.surface != Surface::skin) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId a = t.v[i], b = t.v[(i + 1) % 3];
      if (!on_wall[a] || !on_wall[b]) continue;
      if (!std::binary_search(beside_walls.begin(), beside_walls.end(), HalfEdge(a, b))) continue;
      lips_.push_back({place_of(a), place_of(b), t.v[(i + 2) % 3]});
      const auto first = static_cast<std::uint32_t>(vertices_.size());
      for (const std::uint32_t corner : {0, 1, 2, 0, 2, 3}) indices_.push_back(first + corner);
      for (const VertexId v : {a, b, b, a}) {
        CanvasVertex& vertex = vertices_.emplace_back();
        vertex.rest_m = body.rest_body_m[v];
        vertex.pattern = broad_pattern_at(vertex.rest_m);
      }
    }
  }
}

void LipLines::move(const BodyFrame& body) {
  const auto& x = body.positions_world_m;
  for (LipVertex& v : at_lips_) v.inward = v.normal = Vec3f::Zero();
  for (std::size_t i = 0; i < lips_.size(); ++i) {
    LipVertex &a = at_lips_[lips_[i].a], &b = at_lips_[lips_[i].b];
    const Vec3f along = (x[b.slot] - x[a.slot]).stableNormalized(), to = x[lips_[i].across] - x[a.slot];
    const Vec3f inward = (to - to.dot(along) * along).stableNormalized(), normal = along.cross(inward);
    for (LipVertex* v : {&a, &b}) {
      v->inward += inward;
      v->normal += normal;
    }
    vertices_[4 * i].normal = normal;
  }
  for (LipVertex& v : at_lips_) v.inward.stableNormalize(), v.normal.stableNormalize();
  for (std::size_t i = 0; i < lips_.size(); ++i) {
    const LipVertex &a = at_lips_[lips_[i].a], &b = at_lips_[lips_[i].b];
    CanvasVertex* const corner = &vertices_[4 * i];
    const Vec3f flat = corner[0].normal;
    corner[0].normal = corner[3].normal = a.normal.dot(flat) > kSmooth ? a.normal : flat;
    corner[1].normal = corner[2].normal = b.normal.dot(flat) > kSmooth ? b.normal : flat;
    corner[0].position_m = x[a.slot] + kLift_m * a.normal;
    corner[1].position_m = x[b.slot] + kLift_m * b.normal;
    corner[2].position_m = corner[1].position_m + kWidth_m * b.inward;
    corner[3].position_m = corner[0].position_m + kWidth_m * a.inward;
  }
}

}  // namespace sectio
