#include "render_client/draw/shadow_split.h"

#include <algorithm>
#include <cmath>

namespace sectio {

namespace {

const Vec3f kKeyLamp_view(-0.4082f, 0.8165f, 0.4082f);  // kKey of shaders.h

// How far a point is outside the penumbra: key_light_at() of shaders.h, with the same names.
float clearance_m(const Occluder& o, const Vec3f& lamp, const Vec3f& p) {
  const Vec3f ab = o.to_world_m - o.from_world_m, ap = p - o.from_world_m;
  const float along = ab.dot(lamp), height = ap.dot(lamp);
  const float s =
      std::clamp((ap.dot(ab) - height * along) / std::max(ab.squaredNorm() - along * along, 1e-10f), 0.0f, 1.0f);
  const float t = std::max(s * along - height, 0.0f);
  const float gap = (ap + t * lamp - s * ab).norm();
  return gap - (o.from_radius_m + s * (o.to_radius_m - o.from_radius_m)) - (0.0006f + 0.07f * t);
}

}  // namespace

void ShadowSplit::look(const CanvasView& view, std::span<const CanvasVertex> vertices) {
  vertices_ = vertices;
  sorted_.clear();
  const Vec3f lamp = view.view_from_world.topLeftCorner<3, 3>().transpose() * kKeyLamp_view;
  clearance_m_.resize(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    float least_m = 1e3f;
    for (int o = 0; o < view.occluder_count; ++o)
      least_m =
          std::min(least_m, clearance_m(view.occluders[static_cast<std::size_t>(o)], lamp, vertices[v].position_m));
    clearance_m_[v] = least_m;
  }
}

// Within a triangle the clearance falls by little more than the way from a corner.
bool ShadowSplit::is_lit(const std::uint32_t* corners) const {
  constexpr float kSteepest = 1.5f;
  const Vec3f& a = vertices_[corners[0]].position_m;
  const float way_m = std::sqrt(std::max((vertices_[corners[1]].position_m - a).squaredNorm(),
                                         (vertices_[corners[2]].position_m - a).squaredNorm()));
  return clearance_m_[corners[0]] > kSteepest * way_m;
}

ShadowSplit::Parts ShadowSplit::append(std::span<const std::uint32_t> indices, IndexRange range) {
  Parts parts;
  parts.lit.first = static_cast<std::uint32_t>(sorted_.size());
  shadowed_.clear();
  for (std::uint32_t i = range.first; i < range.first + range.count; i += 3) {
    std::vector<std::uint32_t>& to = is_lit(&indices[i]) ? sorted_ : shadowed_;
    to.insert(to.end(), {indices[i], indices[i + 1], indices[i + 2]});
  }
  parts.shadowed.first = static_cast<std::uint32_t>(sorted_.size());
  parts.lit.count = parts.shadowed.first - parts.lit.first;
  parts.shadowed.count = range.count - parts.lit.count;
  sorted_.insert(sorted_.end(), shadowed_.begin(), shadowed_.end());
  return parts;
}

}  // namespace sectio
