#include "tests/support/brick_reference.h"

#include <algorithm>
#include <cmath>

namespace sectio::test {

BrickReference::BrickReference(std::array<int, 3> bricks, const Vec3& size_m, const Lame& material,
                               const std::optional<Slit>& slit)
    : count_(bricks), size_(size_m), mu_(material.mu_pa), kappa_(material.lambda_pa + material.mu_pa) {
  make_nodes(slit);
  make_gauss_points();
}

double BrickReference::energy_j(const Points& x) const {
  double energy = 0;
  for (const Brick& brick : bricks_)
    for (const GaussPoint& q : gauss_) {
      const Mat3 f = gradient(brick, q, x);
      const double j = f.determinant();
      energy += q.volume_m3 * (mu_ * (0.5 * (f.squaredNorm() - 3) - (j - 1)) + 0.5 * kappa_ * (j - 1) * (j - 1));
    }
  return energy;
}

BrickReference::Points BrickReference::forces_n(const Points& x) const {
  Points force(x.size(), Vec3::Zero());
  for (const Brick& brick : bricks_)
    for (const GaussPoint& q : gauss_) {
      const Mat3 f = gradient(brick, q, x);
      const Mat3 stress = mu_ * f + (kappa_ * (f.determinant() - 1) - mu_) * cofactor(f);
      for (std::size_t a = 0; a < 27; ++a) force[brick[a]] -= q.volume_m3 * (stress * q.slope[a]);
    }
  return force;
}

BrickReference::Sparse BrickReference::hessian(const Points& x) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(bricks_.size() * 27 * 27 * 9);
  Eigen::Matrix<double, 81, 81> k;
  for (const Brick& brick : bricks_) {
    k.setZero();
    for (const GaussPoint& q : gauss_) {
      const Mat3 f = gradient(brick, q, x);
      const Mat3 c = cofactor(f);
      const double pressure = kappa_ * (f.determinant() - 1) - mu_;
      for (std::size_t a = 0; a < 27; ++a)
        for (std::size_t b = 0; b < 27; ++b) {
          const Vec3 w = f * q.slope[b].cross(q.slope[a]);
          Mat3 turn;
          turn << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
          k.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b)) +=
              q.volume_m3 * (mu_ * q.slope[a].dot(q.slope[b]) * Mat3::Identity() +
                             kappa_ * (c * q.slope[a]) * (c * q.slope[b]).transpose() + pressure * turn);
        }
    }
    for (std::size_t a = 0; a < 27; ++a)
      for (std::size_t b = 0; b < 27; ++b)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
            entries.emplace_back(3 * brick[a] + i, 3 * brick[b] + j,
                                 k(3 * static_cast<Eigen::Index>(a) + i, 3 * static_cast<Eigen::Index>(b) + j));
  }
  const auto n = static_cast<Eigen::Index>(3 * x.size());
  Sparse h(n, n);
  h.setFromTriplets(entries.begin(), entries.end());
  return h;
}

BrickReference::Points BrickReference::equilibrium(const Points& x, const std::vector<std::uint8_t>& held,
                                                   const Points& load, double tolerance_n) const {
  return newton_equilibrium(*this, x, held, load, tolerance_n);
}

BrickReference::Points BrickReference::body_load_n(const Vec3& per_volume) const {
  Points load(nodes_.size(), Vec3::Zero());
  for (const Brick& brick : bricks_)
    for (const GaussPoint& q : gauss_)
      for (std::size_t a = 0; a < 27; ++a) load[brick[a]] += q.volume_m3 * q.value[a] * per_volume;
  return load;
}

Vec3 BrickReference::at(const Vec3& rest_m, const Points& x) const {
  std::array<int, 3> cell;
  Vec3 local;
  for (int k = 0; k < 3; ++k) {
    const double s = rest_m[k] / size_[k] * count_[static_cast<std::size_t>(k)];
    cell[static_cast<std::size_t>(k)] =
        std::clamp(static_cast<int>(std::ceil(s - 1e-9)) - 1, 0, count_[static_cast<std::size_t>(k)] - 1);
    local[k] = 2 * (s - cell[static_cast<std::size_t>(k)]) - 1;
  }
  const Brick& brick = bricks_[static_cast<std::size_t>((cell[0] * count_[1] + cell[1]) * count_[2] + cell[2])];
  const GaussPoint shape = shape_at(local);
  Vec3 sum = Vec3::Zero();
  for (std::size_t a = 0; a < 27; ++a) sum += shape.value[a] * x[brick[a]];
  return sum;
}

void BrickReference::make_nodes(const std::optional<Slit>& slit) {
  std::array<int, 3> n;
  for (std::size_t k = 0; k < 3; ++k) n[k] = 2 * count_[k] + 1;
  std::vector<std::uint32_t> twin;
  for (int i = 0; i < n[0]; ++i)
    for (int j = 0; j < n[1]; ++j)
      for (int k = 0; k < n[2]; ++k)
        nodes_.push_back(
            Vec3(double(i) / (n[0] - 1), double(j) / (n[1] - 1), double(k) / (n[2] - 1)).cwiseProduct(size_));
  const auto grid = nodes_.size();
  const auto is_open = [&](const Vec3& p) {
    return slit && std::abs(p.x() - slit->at_x_m) < 1e-9 && p.z() > slit->from_z_m + 1e-9;
  };
  for (std::size_t v = 0; v < grid; ++v) {
    twin.push_back(static_cast<std::uint32_t>(v));
    if (!is_open(nodes_[v])) continue;
    twin.back() = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back(Vec3(nodes_[v]));
  }
  for (int i = 0; i < count_[0]; ++i)
    for (int j = 0; j < count_[1]; ++j)
      for (int k = 0; k < count_[2]; ++k) {
        Brick brick;
        for (int a = 0; a < 27; ++a) {
          const auto v = static_cast<std::size_t>(((2 * i + a / 9) * n[1] + 2 * j + a / 3 % 3) * n[2] + 2 * k + a % 3);
          const bool right = slit && (i + 0.5) * size_.x() / count_[0] > slit->at_x_m;
          brick[static_cast<std::size_t>(a)] = right ? twin[v] : static_cast<std::uint32_t>(v);
        }
        bricks_.push_back(brick);
      }
}

BrickReference::GaussPoint BrickReference::shape_at(const Vec3& local) const {
  std::array<Vec3, 3> value, slope;  // [direction][node]
  for (std::size_t k = 0; k < 3; ++k) {
    const double s = local[static_cast<int>(k)];
    value[k] = {0.5 * s * (s - 1), 1 - s * s, 0.5 * s * (s + 1)};
    slope[k] = Vec3(s - 0.5, -2 * s, s + 0.5) * 2 * count_[k] / size_[static_cast<int>(k)];
  }
  GaussPoint q;
  for (int a = 0; a < 27; ++a) {
    const int i = a / 9, j = a / 3 % 3, k = a % 3;
    q.value[static_cast<std::size_t>(a)] = value[0][i] * value[1][j] * value[2][k];
    q.slope[static_cast<std::size_t>(a)] = {slope[0][i] * value[1][j] * value[2][k],
                                            value[0][i] * slope[1][j] * value[2][k],
                                            value[0][i] * value[1][j] * slope[2][k]};
  }
  return q;
}

void BrickReference::make_gauss_points() {
  const double at = std::sqrt(0.6);
  const double volume = size_.prod() / (double(count_[0]) * count_[1] * count_[2]);
  const auto weight = [](int i) { return i == 1 ? 4.0 / 9 : 5.0 / 18; };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        GaussPoint q = shape_at(at * Vec3(i - 1, j - 1, k - 1));
        q.volume_m3 = volume * weight(i) * weight(j) * weight(k);
        gauss_.push_back(q);
      }
}

Mat3 BrickReference::gradient(const Brick& brick, const GaussPoint& q, const Points& x) const {
  Mat3 f = Mat3::Zero();
  for (std::size_t a = 0; a < 27; ++a) f += x[brick[a]] * q.slope[a].transpose();
  return f;
}

}  // namespace sectio::test
