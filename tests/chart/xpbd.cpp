#include "tests/chart/baselines.h"
#include "tests/chart/plain_model.h"
#include "tests/support/newton.h"

namespace sectio::chart {
namespace {

// C_shape = |F|, compliance 1 / (mu V);  C_volume = det F - 1 - mu / kappa, compliance 1 / (kappa V), kappa = lambda +
// mu: the energies C^2 / (2 compliance) add up to the stable neo-Hookean one.
class Xpbd final : public PlainModel {
 public:
  Xpbd(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations)
      : PlainModel(mesh, material, settings), iterations_(iterations), multiplier_(shape_.size()), before_(x_.size()) {
    const Lame lame = sectio::lame(material.young_pa, material.poisson);
    mu_ = lame.mu_pa;
    kappa_ = lame.lambda_pa + lame.mu_pa;
  }

 private:
  void move(double step_s) override {
    before_ = x_;
    for (std::size_t i = 0; i < x_.size(); ++i)
      if (inverse_mass_[i] > 0)
        x_[i] += step_s * (1 - material_.damping_per_s * step_s) * v_[i] + step_s * step_s * settings_.gravity_m_per_s2;
    std::fill(multiplier_.begin(), multiplier_.end(), std::array<double, 2>{0, 0});
    for (int n = 0; n < iterations_; ++n) {
      for (std::size_t t = 0; t < shape_.size(); ++t) solve(t, step_s);
      for (const PointConstraint& c : pressed_)
        x_[c.v[0]] -= std::max(0.0, (x_[c.v[0]] - c.target_world_m).dot(c.normal)) * c.normal;
    }
    for (std::size_t i = 0; i < x_.size(); ++i) v_[i] = (x_[i] - before_[i]) / step_s;
  }

  bool keeps_contact() const override { return true; }

  Mat3 gradient(std::size_t n, std::span<const Vec3> x) const {
    const Tetrahedron& t = mesh_.tetrahedra[n];
    Mat3 f = Mat3::Zero();
    for (std::size_t a = 0; a < 4; ++a) f += x[t[a]] * shape_[n].gradient[a].transpose();
    return f;
  }

  void solve(std::size_t n, double step_s) {
    const Mat3 f = gradient(n, x_);
    const double norm = f.norm();
    if (norm > 0) correct(n, f / norm, norm, 1 / (mu_ * shape_[n].volume_m3 * step_s * step_s), multiplier_[n][0]);
    const Mat3 g = gradient(n, x_);
    correct(n, test::cofactor(g), g.determinant() - 1 - mu_ / kappa_,
            1 / (kappa_ * shape_[n].volume_m3 * step_s * step_s), multiplier_[n][1]);
  }

  // dC / dx_a = (dC / dF) g_a
  void correct(std::size_t n, const Mat3& slope, double value, double compliance, double& multiplier) {
    const Tetrahedron& t = mesh_.tetrahedra[n];
    std::array<Vec3, 4> gradient;
    double sum = compliance;
    for (std::size_t a = 0; a < 4; ++a) {
      gradient[a] = slope * shape_[n].gradient[a];
      sum += inverse_mass_[t[a]] * gradient[a].squaredNorm();
    }
    const double change = -(value + compliance * multiplier) / sum;
    multiplier += change;
    for (std::size_t a = 0; a < 4; ++a) x_[t[a]] += inverse_mass_[t[a]] * change * gradient[a];
  }

  void forces(std::span<const Vec3> x, std::span<Vec3> force) const override {
    std::fill(force.begin(), force.end(), Vec3::Zero());
    for (std::size_t n = 0; n < shape_.size(); ++n) {
      const Mat3 f = gradient(n, x);
      const Mat3 stress = mu_ * f + (kappa_ * (f.determinant() - 1) - mu_) * test::cofactor(f);
      for (std::size_t a = 0; a < 4; ++a)
        force[mesh_.tetrahedra[n][a]] -= shape_[n].volume_m3 * (stress * shape_[n].gradient[a]);
    }
  }

  int iterations_;
  double mu_ = 0, kappa_ = 0;
  std::vector<std::array<double, 2>> multiplier_;
  std::vector<Vec3> before_;
};

}  // namespace

ChartModel xpbd(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations) {
  return with_forces(std::make_unique<Xpbd>(mesh, material, settings, iterations));
}

}  // namespace sectio::chart
