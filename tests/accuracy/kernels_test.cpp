// The elements in double precision that the cases at rest are computed with: consistent by themselves, and the forces
// of the fast kernels are theirs.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/hex_reference.h"
#include "tests/support/static_body.h"
#include "tests/support/tet_reference.h"

namespace sectio {
namespace {

using Points = std::vector<Vec3>;

TetMesh block() {
  TetMesh mesh = test::tet_box(4, 3, 3, Vec3(0.08, 0.06, 0.06));
  test::jitter(mesh, 0.003);
  return mesh;
}
// The positions in single precision.
Points deformed(const Points& rest) {
  Points x;
  for (const Vec3& p : rest)
    x.push_back(Vec3(1.2 * p.x() + 4 * p.y() * p.z(), 0.9 * p.y(), p.z() - 0.3 * p.x()).cast<float>().cast<double>());
  return x;
}

template <class Reference>
void expect_consistent(const Reference& reference, const Points& rest) {
  const Points x = deformed(rest);
  const auto hessian = reference.hessian(x);
  for (std::size_t v = 0; v < x.size(); v += 5)
    for (int k = 0; k < 3; ++k) {
      Points a = x, b = x;
      const double by = 1e-6;
      a[v][k] -= by, b[v][k] += by;
      EXPECT_NEAR(-(reference.energy_j(b) - reference.energy_j(a)) / (2 * by), reference.forces_n(x)[v][k], 1e-6);
      const Points fa = reference.forces_n(a), fb = reference.forces_n(b);
      for (std::size_t w = 0; w < x.size(); ++w)
        for (int m = 0; m < 3; ++m)
          EXPECT_NEAR(hessian.coeff(static_cast<Eigen::Index>(3 * w) + m, static_cast<Eigen::Index>(3 * v) + k),
                      (fa[w][m] - fb[w][m]) / (2 * by), 1e-3);
    }
}

template <class Model, class Reference>
void expect_forces(const Model& model, const Reference& reference, const Points& rest) {
  const Points at = deformed(rest), expected = reference.forces_n(at);
  std::vector<Vec4f> x(at.size(), Vec4f::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = at[i].cast<float>();
  Points force(x.size());
  model.elastic_forces_n(x, force);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((force[i] - expected[i]).norm(), 1e-5 * 6000 * 0.06 * 0.06);
}

TEST(Reference, tetrahedra_are_consistent_and_the_model_s) {
  const TetMesh mesh = block();
  for (const bool nodal : {false, true})
    expect_consistent(test::TetReference(mesh, lame(1e4, 0.45), nodal), mesh.vertices_body_m);
  expect_forces(TetSolid(mesh, {}, {}), test::TetReference(mesh, lame(6000, 0.45)), mesh.vertices_body_m);
}

TEST(Reference, hexahedra_are_consistent_and_the_model_s) {
  const TetMesh mesh = block();
  const HexSolid model(mesh, grid_around(mesh, 0.017), {}, {});
  const test::HexReference reference(model.lattice(), lame(6000, 0.45));
  Points rest;
  for (std::uint32_t n = 0; n < model.lattice().nodes.size(); ++n) rest.push_back(model.lattice().rest_m(n));
  expect_consistent(reference, rest);
  expect_forces(model, reference, rest);
}

TEST(Reference, springs_are_consistent_and_the_model_s) {
  const TetMesh mesh = block();
  const TetSprings model(mesh, {}, {});
  const test::SpringReference reference(model.springs());
  expect_consistent(reference, mesh.vertices_body_m);
  expect_forces(model, reference, mesh.vertices_body_m);
}

}  // namespace
}  // namespace sectio
