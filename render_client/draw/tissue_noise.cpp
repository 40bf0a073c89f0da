#include "render_client/draw/tissue_noise.h"

#include <algorithm>
#include <cmath>

#include "common/math/hash.h"
#include "common/math/types.h"

namespace sectio {

namespace {

// In [0, 1), a function of the lattice point modulo the period.
float lattice_value(int x, int y, int z, int period, std::uint64_t seed) {
  const auto wrap = [period](int i) { return static_cast<std::uint64_t>((i % period + period) % period); };
  const std::uint64_t bits = hash_combine(hash_combine(hash_combine(seed, wrap(x)), wrap(y)), wrap(z));
  return static_cast<float>(bits >> 40) * 0x1p-24f;
}

// Value noise with smooth interpolation, `period` lattice cells along the unit cube.
float value_noise(const Vec3f& p, int period, std::uint64_t seed) {
  const Vec3f scaled = p * static_cast<float>(period);
  const Vec3f base = scaled.array().floor();
  Vec3f f = scaled - base;
  f = f.array() * f.array() * (3.0f - 2.0f * f.array());
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
    const float weight = (i ? f.x() : 1 - f.x()) * (j ? f.y() : 1 - f.y()) * (k ? f.z() : 1 - f.z());
    sum += weight * lattice_value(static_cast<int>(base.x()) + i, static_cast<int>(base.y()) + j,
                                  static_cast<int>(base.z()) + k, period, seed);
  }
  return sum;
}

float clouds(const Vec3f& p, int period, std::uint64_t seed) {
  return (4 * value_noise(p, period, seed) + 2 * value_noise(p, 2 * period, seed + 1) +
          value_noise(p, 4 * period, seed + 2)) /
         7;
}

// Distance to the nearest point, in cells; each cell of the lattice has one point at a random place.
float cell_distance(const Vec3f& p, int period, std::uint64_t seed) {
  const Vec3f scaled = p * static_cast<float>(period);
  const Eigen::Vector3i base = scaled.array().floor().cast<int>();
  float nearest2 = 9;
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i c = base + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const Vec3f centre = c.cast<float>() + Vec3f(lattice_value(c.x(), c.y(), c.z(), period, seed),
                                                 lattice_value(c.x(), c.y(), c.z(), period, seed + 1),
                                                 lattice_value(c.x(), c.y(), c.z(), period, seed + 2));
    nearest2 = std::min(nearest2, (centre - scaled).squaredNorm());
  }
  return std::sqrt(nearest2);
}

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f);
}

float bump_height(const Vec3f& p) {
  return 0.65f * value_noise(p, 5, 60) + 0.35f * value_noise(p, 13, 61);
}

TissueNoise make_tissue_noise() {
  constexpr int kSize = kTissueNoiseSize;
  constexpr float kStep = 1.0f / kSize;
  constexpr float kSteepest = 10;  // the few steeper slopes are clamped
  TissueNoise volumes;
  volumes.noise.reserve(4 * kSize * kSize * kSize);
  volumes.relief.reserve(4 * kSize * kSize * kSize);
  for (int i = 0; i < kSize * kSize * kSize; ++i) {
    const Vec3f p = kStep * Eigen::Vector3i(i % kSize, i / kSize % kSize, i / (kSize * kSize)).cast<float>();
    // Vessels are thin tubes: they lie where two independent fields are both near their mean.
    const float u = clouds(p, 3, 40) - 0.5f, v = clouds(p, 3, 50) - 0.5f;
    const float grain = 0.5f * value_noise(p, 16, 30) + 0.5f * value_noise(p, 28, 31);
    const float cell = cell_distance(p, 10, 20);
    volumes.noise.push_back(to_byte(clouds(p, 4, 10)));
    volumes.noise.push_back(to_byte(cell));
    volumes.noise.push_back(to_byte(grain));
    volumes.noise.push_back(to_byte(1 - 9 * std::sqrt(u * u + v * v)));
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3f step = kStep * Vec3f::Unit(axis);
      const float slope = (bump_height(p + step) - bump_height(p - step)) / (2 * kStep);
      volumes.relief.push_back(to_byte(0.5f + 0.5f * slope / kSteepest));
    }
    volumes.relief.push_back(to_byte(0.7f * (1 - cell * cell) + 0.3f * grain));
  }
  return volumes;
}

}  // namespace

const TissueNoise& tissue_noise() {
  static const TissueNoise volumes = make_tissue_noise();
  return volumes;
}

// Trilinear between texels, whose centres lie at (i + 1/2) / size, as in the shader.
std::array<std::uint8_t, 4> noise_at(const Vec3f& coordinates) {
  constexpr int kSize = kTissueNoiseSize;
  static_assert((kSize & (kSize - 1)) == 0, "the period is taken by a mask");
  const std::vector<std::uint8_t>& texels = tissue_noise().noise;
  const Vec3f at = static_cast<float>(kSize) * coordinates - Vec3f::Constant(0.5f);
  const Vec3f base = at.array().floor();
  const Vec3f f = at - base;
  const Eigen::Vector3i cell = base.cast<int>();
  std::array<float, 4> sum{};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    float weight = 1;
    std::size_t texel = 0;
    for (int axis = 2; axis >= 0; --axis) {
      weight *= d[axis] ? f[axis] : 1 - f[axis];
      texel = texel * kSize + static_cast<std::size_t>((cell[axis] + d[axis]) & (kSize - 1));
    }
    for (std::size_t k = 0; k < 4; ++k) sum[k] += weight * static_cast<float>(texels[4 * texel + k]);
  }
  std::array<std::uint8_t, 4> pattern;
  for (std::size_t k = 0; k < 4; ++k) pattern[k] = static_cast<std::uint8_t>(sum[k] + 0.5f);
  return pattern;
}

}  // namespace sectio
