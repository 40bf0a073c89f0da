#include "sim_server/meshing/stable_step.h"

#include <algorithm>
#include <cmath>

#include "common/math/lame.h"
#include "common/math/power_iteration.h"

namespace sectio {

double explicit_step_limit_s(const TetMesh& mesh, const ElasticMaterial& material, int iterations) {
  const auto [mu, lambda] = lame(material.young_pa, material.poisson);
  std::vector<TetShape> shapes;
  std::vector<double> mass(mesh.vertices_body_m.size(), 0), inverse_mass;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    shapes.push_back(tet_shape(mesh, t));
    for (const VertexId v : t) mass[v] += 0.25 * material.density_kg_per_m3 * shapes.back().volume_m3;
  }
  for (const double m : mass) inverse_mass.push_back(m > 0 ? 1 / m : 0);
  const auto stiffness_times = [&, mu = mu, lambda = lambda](std::span<const Vec3> u, std::span<Vec3> force) {
    std::ranges::fill(force, Vec3::Zero());
    for (std::size_t e = 0; e < shapes.size(); ++e) {
      const Tetrahedron& t = mesh.tetrahedra[e];
      Mat3 grad = Mat3::Zero();
      for (std::size_t i = 0; i < 4; ++i) grad += u[t[i]] * shapes[e].gradient[i].transpose();
      const Mat3 stress = mu * (grad + grad.transpose()) + lambda * grad.trace() * Mat3::Identity();
      for (std::size_t i = 0; i < 4; ++i) force[t[i]] += shapes[e].volume_m3 * (stress * shapes[e].gradient[i]);
    }
  };
  return 2 / std::sqrt(largest_eigenvalue(inverse_mass, iterations, stiffness_times));
}

}  // namespace sectio
