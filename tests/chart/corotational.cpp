#include <Eigen/SVD>
#include <algorithm>

#include "tests/chart/baselines.h"
#include "tests/chart/plain_model.h"
#include "tests/support/newton.h"

namespace sectio::chart {
namespace {

// f = - sum_e R K (R^T x - X),  K_ab = V [lambda g_a g_b^T + mu (g_b g_a^T + (g_a . g_b) 1)]
// (m (1 + alpha h) + h^2 K') dv = h (f + m g - m alpha v) - h^2 K' v;  K' = R K R^T, in rows of blocks.
class Corotational final : public PlainModel {
 public:
  Corotational(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations)
      : PlainModel(mesh, material, settings), iterations_(iterations) {
    const Lame lame = sectio::lame(material.young_pa, material.poisson);
    for (const TetShape& s : shape_) {
      std::array<Mat3, 16> k;
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < 4; ++b)
          k[4 * a + b] = s.volume_m3 * (lame.lambda_pa * s.gradient[a] * s.gradient[b].transpose() +
                                        lame.mu_pa * (s.gradient[b] * s.gradient[a].transpose() +
                                                      s.gradient[a].dot(s.gradient[b]) * Mat3::Identity()));
      stiffness_.push_back(k);
    }
    make_rows();
  }

 private:
  void make_rows() {
    std::vector<std::vector<VertexId>> near(x_.size());
    for (const Tetrahedron& t : mesh_.tetrahedra)
      for (const VertexId a : t) near[a].insert(near[a].end(), t.begin(), t.end());
    first_.push_back(0);
    for (auto& row : near) {
      std::sort(row.begin(), row.end());
      row.erase(std::unique(row.begin(), row.end()), row.end());
      column_.insert(column_.end(), row.begin(), row.end());
      first_.push_back(column_.size());
    }
    block_.resize(column_.size());
    for (const Tetrahedron& t : mesh_.tetrahedra) {
      std::array<std::size_t, 16> place;
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < 4; ++b)
          place[4 * a + b] = static_cast<std::size_t>(
              std::lower_bound(column_.begin() + static_cast<std::ptrdiff_t>(first_[t[a]]),
                               column_.begin() + static_cast<std::ptrdiff_t>(first_[t[a] + 1]), t[b]) -
              column_.begin());
      place_.push_back(place);
    }
    for (auto* v : {&change_, &residual_, &direction_, &product_, &solved_}) v->resize(x_.size());
    inverse_block_.resize(x_.size());
  }

  Mat3 rotation(std::size_t n, std::span<const Vec3> x) const {
    const Tetrahedron& t = mesh_.tetrahedra[n];
    Mat3 f = Mat3::Zero();
    for (std::size_t a = 0; a < 4; ++a) f += x[t[a]] * shape_[n].gradient[a].transpose();
    const Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 u = svd.matrixU();
    if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;
    return u * svd.matrixV().transpose();
  }

  void forces(std::span<const Vec3> x, std::span<Vec3> force) const override {
    std::fill(force.begin(), force.end(), Vec3::Zero());
    for (std::size_t n = 0; n < shape_.size(); ++n) add_force(n, rotation(n, x), x, force);
  }
  void add_force(std::size_t n, const Mat3& r, std::span<const Vec3> x, std::span<Vec3> force) const {
    const Tetrahedron& t = mesh_.tetrahedra[n];
    std::array<Vec3, 4> u;
    for (std::size_t a = 0; a < 4; ++a) u[a] = r.transpose() * x[t[a]] - mesh_.vertices_body_m[t[a]];
    for (std::size_t a = 0; a < 4; ++a) {
      Vec3 f = Vec3::Zero();
      for (std::size_t b = 0; b < 4; ++b) f += stiffness_[n][4 * a + b] * u[b];
      force[t[a]] -= r * f;
    }
  }

  // Vertices that are beyond their plane, and are not pulled away from it, are put onto it and held for the step.
  void hold_pressed() {
    free_inverse_mass_ = inverse_mass_;
    for (const PointConstraint& c : pressed_) {
      const VertexId v = c.v[0];
      const double beyond = (x_[v] - c.target_world_m).dot(c.normal);
      if (beyond < -1e-7 || force_[v].dot(c.normal) < 0) continue;
      x_[v] -= beyond * c.normal;
      v_[v].setZero();
      inverse_mass_[v] = 0;
    }
  }
  bool keeps_contact() const override { return true; }

  void move(double step_s) override {
    const double h = step_s;
    hold_pressed();
    std::fill(block_.begin(), block_.end(), Mat3::Zero());
    std::fill(force_.begin(), force_.end(), Vec3::Zero());
    for (std::size_t n = 0; n < shape_.size(); ++n) {
      const Mat3 r = rotation(n, x_);
      add_force(n, r, x_, force_);
      for (std::size_t k = 0; k < 16; ++k) block_[place_[n][k]] += h * h * (r * stiffness_[n][k] * r.transpose());
    }
    multiply(v_, product_);  // h^2 K' v
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (inverse_mass_[i] == 0) continue;
      residual_[i] =
          h * (force_[i] + mass_[i] * (settings_.gravity_m_per_s2 - material_.damping_per_s * v_[i])) - product_[i];
    }
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (inverse_mass_[i] == 0) continue;
      const auto row = column_.begin() + static_cast<std::ptrdiff_t>(first_[i]);
      const auto self = std::lower_bound(row, column_.begin() + static_cast<std::ptrdiff_t>(first_[i + 1]),
                                         static_cast<VertexId>(i)) -
                        column_.begin();
      block_[static_cast<std::size_t>(self)] += mass_[i] * (1 + material_.damping_per_s * h) * Mat3::Identity();
      inverse_block_[i] = block_[static_cast<std::size_t>(self)].inverse();
    }
    conjugate_gradients();
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (inverse_mass_[i] == 0) continue;
      v_[i] += change_[i];
      x_[i] += h * v_[i];
    }
    inverse_mass_ = free_inverse_mass_;
  }

  // Forces on free vertices; held vertices have 0.
  void multiply(const std::vector<Vec3>& in, std::vector<Vec3>& out) const {
    for (std::size_t i = 0; i < x_.size(); ++i) {
      Vec3 sum = Vec3::Zero();
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) sum += block_[k] * in[column_[k]];
      out[i] = inverse_mass_[i] > 0 ? sum : Vec3::Zero();
    }
  }
  static double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
  }
  void conjugate_gradients() {
    const auto precondition = [&] {
      for (std::size_t i = 0; i < x_.size(); ++i)
        solved_[i] = inverse_mass_[i] > 0 ? Vec3(inverse_block_[i] * residual_[i]) : Vec3::Zero();
    };
    for (std::size_t i = 0; i < x_.size(); ++i) {
      change_[i].setZero();
      if (inverse_mass_[i] == 0) residual_[i].setZero();
    }
    precondition();
    direction_ = solved_;
    double rho = dot(residual_, solved_);
    const double enough = 1e-10 * rho;
    for (int n = 0; n < iterations_ && rho > enough; ++n) {
      multiply(direction_, product_);
      const double along = rho / dot(direction_, product_);
      for (std::size_t i = 0; i < x_.size(); ++i) {
        change_[i] += along * direction_[i];
        residual_[i] -= along * product_[i];
      }
      precondition();
      const double next = dot(residual_, solved_);
      for (std::size_t i = 0; i < x_.size(); ++i) direction_[i] = solved_[i] + next / rho * direction_[i];
      rho = next;
    }
  }

  int iterations_;
  std::vector<std::array<Mat3, 16>> stiffness_;
  std::vector<std::size_t> first_;
  std::vector<VertexId> column_;
  std::vector<Mat3> block_, inverse_block_;
  std::vector<std::array<std::size_t, 16>> place_;
  std::vector<double> free_inverse_mass_;
  std::vector<Vec3> change_, residual_, direction_, product_, solved_;
};

}  // namespace

ChartModel corotational(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings,
                        int iterations) {
  return with_forces(std::make_unique<Corotational>(mesh, material, settings, iterations));
}

}  // namespace sectio::chart
