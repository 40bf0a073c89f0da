#include "sim_server/deformation/hexa/hex_energy.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace sectio {
namespace {

// The twist term's slopes by hourglasses are followed up to this size of them, in cells.
constexpr double kLargestTwist = 1;

}  // namespace

double mode_sign(std::size_t corner, std::size_t mode) {
  return std::popcount(~corner & mode) % 2 == 0 ? 1 : -1;
}

HexModes modes_of(const HexCell& cell, std::span<const Vec3> x) {
  HexModes m;
  for (std::size_t c = 0; c < 8; ++c) m[c] = x[cell.nodes[c]];
  to_modes(m);
  return m;
}

HexEnergy::HexEnergy(const HexCell& cell, const HexMaterial& material, double cell_m)
    : a_(cell.fill * cell.stiffness * material.shear_pa * cell_m / 16),
      b_(cell.fill * cell.stiffness * material.bulk_pa / 64),
      h_(cell_m),
      d_(cell.offset),
      i_(cell.spread) {}

double HexEnergy::swelling(const HexModes& m) const {
  return m[1].dot(m[2].cross(m[4])) / (64 * h_ * h_ * h_) - 1;
}

// 1 at rest; keeps the twist term below its springs however far the cell is stretched or tangled.
double HexEnergy::limit(const HexModes& m) const {
  const double slopes = m[1].squaredNorm() + m[2].squaredNorm() + m[4].squaredNorm();
  const double hourglasses = m[3].squaredNorm() + m[5].squaredNorm() + m[6].squaredNorm();
  return 2 / (1 + (slopes + kTangle * hourglasses) / (48 * h_ * h_));
}

// The stiffness of an hourglass's spring.
double HexEnergy::springs(std::size_t mode) const {
  const double k = 3 * kHourglass * a_;
  if (mode == 3) return k * (i_.x() + i_.y());
  if (mode == 5) return k * (i_.x() + i_.z());
  if (mode == 6) return k * (i_.y() + i_.z());
  return k * (i_.x() * i_.y() + i_.y() * i_.z() + i_.z() * i_.x());
}

// The slopes of D, and D.
HexModes HexEnergy::twist(const HexModes& m, double& value) const {
  const Vec3 x = i_.x() * m[3].cross(m[5]), y = i_.y() * m[6].cross(m[3]), z = i_.z() * m[5].cross(m[6]);
  value = m[1].dot(x) + m[2].dot(y) + m[4].dot(z);
  return {Vec3::Zero(),
          x,
          y,
          i_.x() * m[5].cross(m[1]) + i_.y() * m[2].cross(m[6]),
          z,
          i_.x() * m[1].cross(m[3]) + i_.z() * m[6].cross(m[4]),
          i_.y() * m[3].cross(m[2]) + i_.z() * m[4].cross(m[5]),
          Vec3::Zero()};
}

double HexEnergy::value_j(const HexModes& n) const {
  HexModes m = n;
  to_centroid(d_, m);
  const double j1 = swelling(m);
  double energy = 0.5 * a_ * (m[1].squaredNorm() + m[2].squaredNorm() + m[4].squaredNorm() - 48 * h_ * h_);
  energy += 64 * h_ * h_ * h_ * (0.5 * b_ * j1 * j1 - a_ / (4 * h_) * j1);
  for (const std::size_t k : {3u, 5u, 6u, 7u}) energy += 0.5 * springs(k) * m[k].squaredNorm();
  double d = 0;
  twist(m, d);
  return energy - kTwist * a_ / (4 * h_) * limit(m) * d;
}

HexModes HexEnergy::slope_n(const HexModes& n) const {
  HexModes m = n;
  to_centroid(d_, m);
  const double pressure = b_ * swelling(m) - a_ / (4 * h_), f = limit(m), t = kTwist * a_ / (4 * h_) * f;
  double d = 0;
  HexModes e = twist(m, d);
  const double less = t * d * f / (48 * h_ * h_), held = a_ + less;
  e[1] = held * m[1] + pressure * m[2].cross(m[4]) - t * e[1];
  e[2] = held * m[2] + pressure * m[4].cross(m[1]) - t * e[2];
  e[4] = held * m[4] + pressure * m[1].cross(m[2]) - t * e[4];
  for (const std::size_t k : {3u, 5u, 6u}) e[k] = (springs(k) + kTangle * less) * m[k] - t * e[k];
  e[7] = springs(7) * m[7];
  from_centroid(d_, e);
  return e;
}

HexModes HexEnergy::product(const HexModes& n, const HexModes& at) const {
  HexModes m = n, p = at;
  to_centroid(d_, m);
  to_centroid(d_, p);
  const Vec3 yz = m[2].cross(m[4]), zx = m[4].cross(m[1]), xy = m[1].cross(m[2]);
  const double most = a_ / (4 * h_);
  const double pressure = std::clamp(b_ * swelling(m) - most, -most, most);
  const double more = b_ / (64 * h_ * h_ * h_) * (yz.dot(p[1]) + zx.dot(p[2]) + xy.dot(p[4]));
  HexModes e{Vec3::Zero(),
             a_ * p[1] + more * yz + pressure * (p[2].cross(m[4]) + m[2].cross(p[4])),
             a_ * p[2] + more * zx + pressure * (p[4].cross(m[1]) + m[4].cross(p[1])),
             springs(3) * p[3],
             a_ * p[4] + more * xy + pressure * (p[1].cross(m[2]) + m[1].cross(p[2])),
             springs(5) * p[5],
             springs(6) * p[6],
             springs(7) * p[7]};
  // - t (f D'' p + (f'.p) D' + (D'.p) f' + D f'' p), of which the part between slopes and hourglasses goes by `s`. D is
  // linear in each of M, b_3, b_5, b_6.
  const double f = limit(m), scale = 1 / (48 * h_ * h_), t = kTwist * most;
  const double size = std::sqrt(m[3].squaredNorm() + m[5].squaredNorm() + m[6].squaredNorm()) / h_;
  const double s = t * std::min(1.0, kLargestTwist / std::max(size, 1e-9));
  const double x = i_.x(), y = i_.y(), z = i_.z();
  e[1] -= s * f * x * (p[3].cross(m[5]) + m[3].cross(p[5]));
  e[2] -= s * f * y * (p[6].cross(m[3]) + m[6].cross(p[3]));
  e[4] -= s * f * z * (p[5].cross(m[6]) + m[5].cross(p[6]));
  e[3] -= f * (t * (x * p[5].cross(m[1]) + y * m[2].cross(p[6])) + s * (x * m[5].cross(p[1]) + y * p[2].cross(m[6])));
  e[5] -= f * (t * (x * m[1].cross(p[3]) + z * p[6].cross(m[4])) + s * (x * p[1].cross(m[3]) + z * m[6].cross(p[4])));
  e[6] -= f * (t * (y * p[3].cross(m[2]) + z * m[4].cross(p[5])) + s * (y * m[3].cross(p[2]) + z * p[4].cross(m[5])));
  double d = 0, along_d = 0;
  const HexModes slope = twist(m, d);
  for (const std::size_t k : {1u, 2u, 3u, 4u, 5u, 6u}) along_d += slope[k].dot(p[k]);
  const auto c = [](std::size_t k) { return k == 1 || k == 2 || k == 4 ? 1 : kTangle; };
  double along_m = 0;
  for (const std::size_t k : {1u, 2u, 3u, 4u, 5u, 6u}) along_m += c(k) * m[k].dot(p[k]);
  const double by_m = -f * f * scale, twice = 2 * f * f * f * scale * scale * d * along_m;
  for (const std::size_t k : {1u, 2u, 3u, 4u, 5u, 6u})
    e[k] -= s * (by_m * (along_m * slope[k] + c(k) * (along_d * m[k] + d * p[k])) + twice * c(k) * m[k]);
  from_centroid(d_, e);
  return e;
}

HexEnergy::Block HexEnergy::block(const HexModes& n, std::size_t corner) const {
  HexModes m = n;
  to_centroid(d_, m);
  std::array<double, 8> s{};
  for (std::size_t k = 1; k < 8; ++k) s[k] = mode_sign(corner, k);
  to_centroid(d_, s);
  const double pressure = b_ * swelling(m) - a_ / (4 * h_);
  // 64 h^3 dJ / dx
  const Vec3 growth = s[1] * m[2].cross(m[4]) + s[2] * m[4].cross(m[1]) + s[4] * m[1].cross(m[2]);
  const double t = kTwist * a_ / (4 * h_) * limit(m);
  double d = 0;
  const HexModes e = twist(m, d);
  Block block;
  block.force_n = -a_ * (s[1] * m[1] + s[2] * m[2] + s[4] * m[4]) - pressure * growth;
  for (std::size_t k = 1; k < 8; ++k) block.force_n += t * s[k] * e[k];
  double k_n_per_m = a_ * (s[1] * s[1] + s[2] * s[2] + s[4] * s[4]);
  for (const std::size_t k : {3u, 5u, 6u, 7u}) {
    block.force_n -= springs(k) * s[k] * m[k];
    k_n_per_m += springs(k) * s[k] * s[k];
  }
  block.stiffness_n_per_m = k_n_per_m * Mat3::Identity() + b_ / (64 * h_ * h_ * h_) * growth * growth.transpose();
  return block;
}

}  // namespace sectio
