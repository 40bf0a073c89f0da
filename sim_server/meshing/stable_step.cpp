#include "sim_server/meshing/stable_step.h"

#include <cmath>

#include "common/math/fixed_sequence.h"
#include "common/math/lame.h"

namespace sectio {
namespace {

struct Element {
  std::array<Vec3, 4> gradient;  // of the four shape functions
  double volume_m3;
};

Element element(const TetMesh& mesh, const Tetrahedron& t) {
  Element e;
  e.volume_m3 = tet_volume_m3(mesh, t);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3& p = mesh.vertices_body_m[t[kTetFaces[i][0]]];
    const Vec3& q = mesh.vertices_body_m[t[kTetFaces[i][1]]];
    const Vec3& r = mesh.vertices_body_m[t[kTetFaces[i][2]]];
    e.gradient[i] = (r - p).cross(q - p) / (6 * e.volume_m3);
  }
  return e;
}

}  // namespace

double explicit_step_limit_s(const TetMesh& mesh, const ElasticConstants& constants, int iterations) {
  const auto [mu, lambda] = lame(constants.young_pa, constants.poisson);
  std::vector<Element> elements;
  std::vector<double> mass(mesh.vertices_body_m.size(), 0);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    elements.push_back(element(mesh, t));
    for (const VertexId v : t) mass[v] += 0.25 * constants.density_kg_per_m3 * elements.back().volume_m3;
  }
  std::vector<Vec3> u(mass.size()), next(mass.size());
  for (std::size_t v = 0; v < u.size(); ++v) u[v] = fixed_vector(v);

  double eigenvalue = 0;
  for (int n = 0; n < iterations; ++n) {
    std::fill(next.begin(), next.end(), Vec3::Zero());
    for (std::size_t e = 0; e < elements.size(); ++e) {
      const Tetrahedron& t = mesh.tetrahedra[e];
      Mat3 grad = Mat3::Zero();
      for (std::size_t i = 0; i < 4; ++i) grad += u[t[i]] * elements[e].gradient[i].transpose();
      const Mat3 stress = mu * (grad + grad.transpose()) + lambda * grad.trace() * Mat3::Identity();
      for (std::size_t i = 0; i < 4; ++i) next[t[i]] += elements[e].volume_m3 * (stress * elements[e].gradient[i]);
    }
    double moved2 = 0, size2 = 0;
    for (std::size_t v = 0; v < u.size(); ++v) {
      moved2 += next[v].dot(u[v]);
      size2 += mass[v] * u[v].squaredNorm();
      next[v] /= mass[v];
    }
    eigenvalue = moved2 / size2;  // Rayleigh's quotient: never above the largest
    double scale2 = 0;
    for (const Vec3& x : next) scale2 += x.squaredNorm();
    for (std::size_t v = 0; v < u.size(); ++v) u[v] = next[v] / std::sqrt(scale2);
  }
  return 2 / std::sqrt(eigenvalue);
}

}  // namespace sectio
