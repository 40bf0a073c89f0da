#include "tests/support/tet_reference.h"

namespace sectio::test {

TetReference::TetReference(const TetMesh& mesh, const Lame& material, bool nodal_pressure)
    : mesh_(mesh),
      mu_(material.mu_pa),
      kappa_(material.lambda_pa + material.mu_pa),
      nodal_(nodal_pressure),
      rest_volume_(mesh.vertices_body_m.size(), 0) {
  for (const Tetrahedron& t : mesh.tetrahedra) {
    shape_.push_back(tet_shape(mesh, t));
    for (const VertexId v : t) rest_volume_[v] += shape_.back().volume_m3;
  }
}

Mat3 TetReference::gradient(std::size_t t, const Points& x) const {
  Mat3 f = Mat3::Zero();
  for (std::size_t k = 0; k < 4; ++k) f += x[mesh_.tetrahedra[t][k]] * shape_[t].gradient[k].transpose();
  return f;
}

double TetReference::energy_j(const Points& x) const {
  double energy = 0;
  std::vector<double> volume(x.size(), 0);
  for (std::size_t t = 0; t < shape_.size(); ++t) {
    const Mat3 f = gradient(t, x);
    const double j = f.determinant(), v = shape_[t].volume_m3;
    energy += v * mu_ * (0.5 * (f.squaredNorm() - 3) - (j - 1));
    if (!nodal_) energy += 0.5 * v * kappa_ * (j - 1) * (j - 1);
    for (const VertexId i : mesh_.tetrahedra[t]) volume[i] += j * v;
  }
  if (nodal_)
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double strain = volume[i] / rest_volume_[i] - 1;
      energy += 0.125 * rest_volume_[i] * kappa_ * strain * strain;
    }
  return energy;
}

TetReference::Points TetReference::forces_n(const Points& x) const {
  Points force(x.size(), Vec3::Zero());
  const std::vector<double> pressure = pressures(x);
  for (std::size_t t = 0; t < shape_.size(); ++t) {
    const Mat3 f = gradient(t, x);
    const Mat3 p = mu_ * f + (pressure[t] - mu_) * cofactor(f);
    for (std::size_t k = 0; k < 4; ++k)
      force[mesh_.tetrahedra[t][k]] -= shape_[t].volume_m3 * (p * shape_[t].gradient[k]);
  }
  return force;
}

std::vector<double> TetReference::pressures(const Points& x) const {
  std::vector<double> volume(x.size(), 0), pressure(shape_.size());
  for (std::size_t t = 0; t < shape_.size(); ++t) {
    pressure[t] = kappa_ * (gradient(t, x).determinant() - 1);
    for (const VertexId i : mesh_.tetrahedra[t]) volume[i] += (pressure[t] / kappa_ + 1) * shape_[t].volume_m3;
  }
  if (!nodal_) return pressure;
  for (std::size_t t = 0; t < shape_.size(); ++t) {
    double sum = 0;
    for (const VertexId i : mesh_.tetrahedra[t]) sum += volume[i] / rest_volume_[i] - 1;
    pressure[t] = 0.25 * kappa_ * sum;
  }
  return pressure;
}

TetReference::Sparse TetReference::hessian(const Points& x) const {
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](VertexId a, VertexId b, const Mat3& k) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) entries.emplace_back(3 * a + i, 3 * b + j, k(i, j));
  };
  const std::vector<double> pressure = pressures(x);
  // dJ_i / dx of every node: sum over its tetrahedra of cof(F) g V / sum V
  std::vector<Change> change(x.size());
  for (std::size_t t = 0; t < shape_.size(); ++t) {
    const Tetrahedron& c = mesh_.tetrahedra[t];
    const double v = shape_[t].volume_m3;
    const Mat3 cof = cofactor(gradient(t, x));
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = 0; b < 4; ++b) {
        add(c[a], c[b], mu_ * v * shape_[t].gradient[a].dot(shape_[t].gradient[b]) * Mat3::Identity());
        if (!nodal_)
          add(c[a], c[b], kappa_ * v * (cof * shape_[t].gradient[a]) * (cof * shape_[t].gradient[b]).transpose());
        if (nodal_) change[c[a]].add(c[b], v / rest_volume_[c[a]] * (cof * shape_[t].gradient[b]));
        if (a == b) continue;
        // d^2 v / dx_a dx_b = +- [x_c - x_d] / 6 with c, d the other two
        std::size_t p = 0;
        while (p == a || p == b) ++p;
        std::size_t q = p + 1;
        while (q == a || q == b) ++q;
        const Vec3 w = (x[c[q]] - x[c[p]]) / 6;
        Mat3 skew;
        skew << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
        add(c[a], c[b], (pressure[t] - mu_) * sign(a, b, p, q) * skew);
      }
  }
  for (std::size_t i = 0; i < change.size(); ++i)
    for (const auto& [a, ga] : change[i].by_vertex)
      for (const auto& [b, gb] : change[i].by_vertex) add(a, b, 0.25 * rest_volume_[i] * kappa_ * ga * gb.transpose());
  const auto n = static_cast<Eigen::Index>(3 * x.size());
  Sparse h(n, n);
  h.setFromTriplets(entries.begin(), entries.end());
  return h;
}

TetReference::Points TetReference::equilibrium(const Points& x, const std::vector<std::uint8_t>& held,
                                               const Points& load, double tolerance_n) const {
  return newton_equilibrium(*this, x, held, load, tolerance_n);
}

void TetReference::Change::add(VertexId v, const Vec3& g) {
  for (auto& [at, sum] : by_vertex)
    if (at == v) {
      sum += g;
      return;
    }
  by_vertex.emplace_back(v, g);
}

double TetReference::sign(std::size_t a, std::size_t b, std::size_t p, std::size_t q) {
  // The sign of the permutation (a b p q): d^2 v / dx_a dx_b = sign [x_q - x_p] / 6.
  const std::array<std::size_t, 4> order{a, b, p, q};
  int inversions = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) inversions += order[i] > order[j];
  return inversions % 2 == 0 ? -1 : 1;
}

}  // namespace sectio::test
