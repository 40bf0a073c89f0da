// Bounds on the stable step of TetSolid, from its stiffness at rest.
#include <algorithm>
#include <cmath>

#include "common/math/power_iteration.h"
#include "sim_server/deformation/spring_star.h"
#include "sim_server/deformation/tetra/tet_solid.h"

namespace sectio {
namespace {

using Block = std::array<Eigen::Array4d, 3>;  // nine entries, column after column, and three that are 0

Eigen::Matrix4d transposed(const Eigen::Array4d& a, const Eigen::Array4d& b, const Eigen::Array4d& c,
                           const Eigen::Array4d& d) {
  Eigen::Matrix4d m;
  m << a.matrix(), b.matrix(), c.matrix(), d.matrix();
  m.transposeInPlace();
  return m;
}

}  // namespace

// K_ib = sum_e V (lambda g_i g_b^T + mu g_b g_i^T + mu g_i . g_b), computed for four b at a time, column by column.
double stiffness_bound_n_per_m(const VertexStar& star, const TetStiffness& stiffness) {
  using Four = Eigen::Array4d;
  const Block none{Four::Zero(), Four::Zero(), Four::Zero()};
  std::vector<Block> blocks((star.vertices().size() + 3) / 4 * 4, none);
  for (const auto& [t, corner, at, shape] : star.corners()) {
    const double mu = stiffness.shear_pa[t], lambda = stiffness.bulk_pa[t] - mu;
    const Vec3& g = shape.gradient[corner];
    const Eigen::Map<const Eigen::Matrix<double, 3, 4>> gradients(shape.gradient[0].data());
    const Four x = gradients.row(0), y = gradients.row(1), z = gradients.row(2);
    const Four even = mu * (g.x() * x + g.y() * y + g.z() * z);
    const std::array<Four, 3> h{x, y, z};
    std::array<Four, 12> of;
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
        const Four both = lambda * g[a] * h[j] + mu * h[i] * g[b];
        of[3 * j + i] = shape.volume_m3 * (i == j ? both + even : both);
      }
    of[9] = of[10] = of[11] = Four::Zero();
    for (std::size_t n = 0; n < 3; ++n) {
      const Eigen::Matrix4d by_corner = transposed(of[4 * n], of[4 * n + 1], of[4 * n + 2], of[4 * n + 3]);
      for (std::size_t k = 0; k < 4; ++k) blocks[at[k]][n] += by_corner.col(static_cast<Eigen::Index>(k)).array();
    }
  }
  double bound = 0;
  for (std::size_t b = 0; b < star.vertices().size(); b += 4) {
    std::array<Eigen::Matrix4d, 3> k;
    for (std::size_t n = 0; n < 3; ++n)
      k[n] = transposed(blocks[b][n], blocks[b + 1][n], blocks[b + 2][n], blocks[b + 3][n]);
    const auto entry = [&](std::size_t i, std::size_t j) -> Four {
      return k[(3 * j + i) / 4].col(static_cast<Eigen::Index>((3 * j + i) % 4)).array();
    };
    const auto product = [&](std::size_t i, std::size_t j) -> Four {
      return entry(0, i) * entry(0, j) + entry(1, i) * entry(1, j) + entry(2, i) * entry(2, j);
    };
    const Four sizes = largest_eigenvalue_bounds(
                           {product(0, 0), product(0, 1), product(0, 2), product(1, 1), product(1, 2), product(2, 2)})
                           .sqrt();
    for (std::size_t n = 0; n < 4 && b + n < star.vertices().size(); ++n) bound += sizes[static_cast<Eigen::Index>(n)];
  }
  return bound;
}

double largest_omega2_at_rest(const TetMesh& mesh, const TetStiffness& stiffness, std::span<const double> inverse_mass,
                              int iterations) {
  const std::size_t n = mesh.vertices_body_m.size();
  std::vector<TetShape> shapes;
  std::vector<double> volume(n, 0), bulk(n, 0);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    shapes.push_back(tet_shape(mesh, mesh.tetrahedra[t]));
    for (const VertexId v : mesh.tetrahedra[t]) {
      volume[v] += shapes[t].volume_m3;
      bulk[v] += shapes[t].volume_m3 * stiffness.bulk_pa[t];
    }
  }
  std::vector<Mat3> gradient(shapes.size());
  std::vector<double> pressure(n);
  const auto stiffness_times = [&](std::span<const Vec3> u, std::span<Vec3> force) {
    std::ranges::fill(pressure, 0.0);
    for (std::size_t t = 0; t < shapes.size(); ++t) {
      gradient[t].setZero();
      for (std::size_t k = 0; k < 4; ++k) gradient[t] += u[mesh.tetrahedra[t][k]] * shapes[t].gradient[k].transpose();
      for (const VertexId v : mesh.tetrahedra[t]) pressure[v] += shapes[t].volume_m3 * gradient[t].trace();
    }
    for (std::size_t v = 0; v < n; ++v) pressure[v] *= bulk[v] / (volume[v] * volume[v]);
    std::ranges::fill(force, Vec3::Zero());
    for (std::size_t t = 0; t < shapes.size(); ++t) {
      const auto& c = mesh.tetrahedra[t];
      const double mean = 0.25 * (pressure[c[0]] + pressure[c[1]] + pressure[c[2]] + pressure[c[3]]);
      const Mat3& g = gradient[t];
      const Mat3 stress =
          stiffness.shear_pa[t] * (g + g.transpose()) + (mean - stiffness.shear_pa[t] * g.trace()) * Mat3::Identity();
      for (std::size_t k = 0; k < 4; ++k) force[c[k]] += shapes[t].volume_m3 * (stress * shapes[t].gradient[k]);
    }
  };
  return largest_eigenvalue(inverse_mass, iterations, stiffness_times);
}

}  // namespace sectio
