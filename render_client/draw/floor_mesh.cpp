#include "render_client/draw/floor_mesh.h"

#include <algorithm>
#include <cmath>

#include "render_client/draw/tissue_noise.h"

namespace sectio {
namespace {

constexpr int kSide = 97;            // heights and shades along a side
constexpr int kStride = 2;           // between vertices that are drawn: finer triangles take longer than their pixels
constexpr float kSizeOfView = 1.3f;  // half the side over the distance from eye to target
constexpr float kShadeReach_m = 0.02f;  // a body this far above throws half of the shade
constexpr float kPlain = 0.3f;          // share of half the side from which on the cloth passes into the backdrop
constexpr float kDarkest = 0.75f;
constexpr int kBlurs = 3;

std::size_t at(int x, int y) {
  return static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x);
}

// Takes the mean of the 3 by 3 values around each value; the rim stays as it is.
void blur(std::vector<float>& values, std::vector<float>& scratch) {
  scratch = values;
  for (int y = 1; y + 1 < kSide; ++y)
    for (int x = 1; x + 1 < kSide; ++x) {
      float sum = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) sum += scratch[at(x + dx, y + dy)];
      values[at(x, y)] = sum / 9;
    }
}

}  // namespace

FloorMesh::FloorMesh() : vertices_(kSide * kSide) {
  for (int y = 0; y + kStride < kSide; y += kStride)
    for (int x = 0; x + kStride < kSide; x += kStride) {
      const auto corner = [&](int right, int up) {
        return static_cast<std::uint32_t>(at(x + right * kStride, y + up * kStride));
      };
      indices_.insert(indices_.end(), {corner(0, 0), corner(1, 0), corner(1, 1)});
      indices_.insert(indices_.end(), {corner(0, 0), corner(1, 1), corner(0, 1)});
    }
}

void FloorMesh::move(const Frame& frame, const Camera& camera) {
  const auto z = static_cast<float>(*frame.floor_z_m);
  const Vec3f middle_m(static_cast<float>(camera.target_world_m.x()), static_cast<float>(camera.target_world_m.y()), z);
  const float half_m = kSizeOfView * static_cast<float>((camera.eye_world_m - camera.target_world_m).norm());
  if (middle_m != middle_m_ || half_m != half_m_) place(middle_m, half_m);
  shade(frame);
}

void FloorMesh::place(const Vec3f& middle_m, float half_m) {
  middle_m_ = middle_m;
  half_m_ = half_m;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const Vec3f on_square(2.0f * static_cast<float>(x) / (kSide - 1) - 1,
                            2.0f * static_cast<float>(y) / (kSide - 1) - 1, 0);
      CanvasVertex& v = vertices_[at(x, y)];
      v.position_m = middle_m + half_m * on_square;
      const float rim = std::clamp((on_square.norm() - kPlain) / (0.98f - kPlain), 0.0f, 1.0f);
      v.rest_m = Vec3f(v.position_m.x(), v.position_m.y(), 1e-3f * rim * rim * (3 - 2 * rim));
      v.pattern = noise_at(5.0f * v.rest_m + Vec3f::Constant(0.21f));
    }
}

void FloorMesh::shade(const Frame& frame) {
  constexpr float kNothing_m = 1e3f;
  height_m_.assign(vertices_.size(), kNothing_m);
  const Vec3f first = vertices_.front().position_m;
  const float cells_per_m = (kSide - 1) / (vertices_.back().position_m.x() - first.x());
  for (const BodyFrame& body : frame.bodies)
    for (const Triangle& t : body.triangles) {
      if (!t.alive() || t.v[0] >= body.positions_world_m.size()) continue;
      const Vec3f cell = cells_per_m * (body.positions_world_m[t.v[0]] - first);
      if (!(cell.head<2>().minCoeff() >= 0) || !(cell.head<2>().maxCoeff() < kSide - 1)) continue;
      float& height = height_m_[at(static_cast<int>(cell.x() + 0.5f), static_cast<int>(cell.y() + 0.5f))];
      height = std::min(height, std::max(0.0f, cell.z() / cells_per_m));
    }
  for (float& h : height_m_) h = kDarkest * std::exp2(-h / kShadeReach_m);
  for (int i = 0; i < kBlurs; ++i) blur(height_m_, blurred_);
  for (std::size_t i = 0; i < vertices_.size(); ++i) vertices_[i].depth_m = height_m_[i];
}

}  // namespace sectio
