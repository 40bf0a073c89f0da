// Bending, compression and order of convergence: the discrete model at rest, by Newton's method on the reference, and
// the fast kernels in balance at the same place.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/tetra/tet_solid.h"
#include "tests/support/brick_reference.h"
#include "tests/support/tet_reference.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

using test::BoxLattice;
using test::TetReference;
using Points = std::vector<Vec3>;

struct Beam {
  TetMesh mesh;
  std::vector<std::uint8_t> held;  // the end at x = 0
  double length_m, height_m;
};

Beam beam(int across, double slenderness, BoxLattice lattice = BoxLattice::five) {
  Beam b;
  b.height_m = 0.02;
  b.length_m = slenderness * b.height_m;
  b.mesh = test::tet_box(static_cast<int>(slenderness) * across, across, across,
                         Vec3(b.length_m, b.height_m, b.height_m), lattice);
  for (const Vec3& p : b.mesh.vertices_body_m) b.held.push_back(test::held_if(p.x() == 0));
  return b;
}

// -1 in z in all, spread over the end x = L by area.
Points end_load(const Beam& b, double newton) {
  Points load(b.mesh.vertices_body_m.size(), Vec3::Zero());
  const TetSurface outside = surface_of(b.mesh);
  for (const auto& t : outside.soup.triangles) {
    const auto& x = outside.soup.vertices_body_m;
    if (!(x[t[0]].x() == b.length_m && x[t[1]].x() == b.length_m && x[t[2]].x() == b.length_m)) continue;
    const double area = 0.5 * (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm();
    for (const VertexId v : t) load[outside.of_volume[v]].z() -= newton * area / (3 * b.height_m * b.height_m);
  }
  return load;
}

double tip_drop_m(const Beam& b, const Points& x) {
  double drop = 0;
  int count = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (b.mesh.vertices_body_m[i].x() == b.length_m) drop += b.mesh.vertices_body_m[i].z() - x[i].z(), ++count;
  return drop / count;
}

// Deflection over that of Timoshenko's beam.
double cantilever_ratio(int across, double poisson, BoxLattice lattice, bool nodal) {
  const Beam b = beam(across, 8, lattice);
  const double young = 1e4, load = 1e-6;
  const TetReference reference(b.mesh, test::lame(young, poisson), nodal);
  const Points x = reference.equilibrium(b.mesh.vertices_body_m, b.held, end_load(b, load), 1e-12);
  const double area = b.height_m * b.height_m, inertia = area * area / 12, shear = young / (2 * (1 + poisson));
  const double kappa = 10 * (1 + poisson) / (12 + 11 * poisson);
  const double l = b.length_m;
  return tip_drop_m(b, x) / (load * l * l * l / (3 * young * inertia) + load * l / (kappa * shear * area));
}

TEST(A_accuracy, A_5_cantilever_on_the_lattice_of_five_with_nodal_pressure_and_kuhns_shown_failing) {
  EXPECT_NEAR(cantilever_ratio(4, 0.45, BoxLattice::five, true), 0.876, 0.02);
  EXPECT_NEAR(cantilever_ratio(4, 0.49, BoxLattice::five, true), 0.850, 0.02);
  EXPECT_NEAR(cantilever_ratio(4, 0.45, BoxLattice::five, false), 0.852, 0.02);
  EXPECT_NEAR(cantilever_ratio(4, 0.45, BoxLattice::kuhn, false), 0.595, 0.02);
  EXPECT_NEAR(cantilever_ratio(4, 0.49, BoxLattice::kuhn, false), 0.288, 0.02);
}

// Against the bricks, which know what a clamped end does.
TEST(A_accuracy, A_5_cantilever_of_eight_cells_across) {
  for (const double poisson : {0.49}) {
    const Beam b = beam(8, 4);
    const double young = 1e4, load_n = 1e-6;
    const TetReference reference(b.mesh, test::lame(young, poisson));
    const Points x = reference.equilibrium(b.mesh.vertices_body_m, b.held, end_load(b, load_n), 1e-12);
    const test::BrickReference bricks({12, 3, 3}, Vec3(b.length_m, b.height_m, b.height_m), test::lame(young, poisson));
    std::vector<std::uint8_t> held;
    for (const Vec3& p : bricks.nodes_m()) held.push_back(test::held_if(p.x() == 0));
    // Simpson's rule over the end's nodes.
    const auto weight = [&](double s) {
      const auto k = std::lround(6 * s / b.height_m);
      return k == 0 || k == 6 ? 1.0 / 18 : k % 2 == 1 ? 4.0 / 18 : 2.0 / 18;
    };
    Points load(held.size(), Vec3::Zero());
    for (std::size_t i = 0; i < load.size(); ++i)
      if (const Vec3& p = bricks.nodes_m()[i]; p.x() > b.length_m - 1e-9)
        load[i].z() = -load_n * weight(p.y()) * weight(p.z());
    const Points y = bricks.equilibrium(bricks.nodes_m(), held, load, 1e-12);
    const Vec3 end(b.length_m, b.height_m / 2, b.height_m / 2);
    EXPECT_NEAR(tip_drop_m(b, x) / (end.z() - bricks.at(end, y).z()), 1, 0.08) << poisson;
  }
}

// The sag of a bar under its own weight, w L^3 / (E I) = 1, 2, 4, 8: large deflection. Ten times as long as thick,
// shear adds (1 + nu) 4 / (5 kappa) (h / L)^2 = 1.2 % to a small one.
TEST(A_accuracy, A_7_elastica_under_its_own_weight) {
  struct Case {
    double beta, sag;
  };
  const Beam b = beam(5, 10);
  const double young = 1e4, area = b.height_m * b.height_m, inertia = area * area / 12;
  const TetReference reference(b.mesh, test::lame(young, 0.3));
  Points x = b.mesh.vertices_body_m;
  for (const Case& c : {Case{1, 0.123471}, Case{2, 0.238507}, Case{4, 0.425159}, Case{8, 0.640631}}) {
    const double weight_n_per_m3 = c.beta * young * inertia / std::pow(b.length_m, 3) / area;
    const std::vector<double> weight = masses_by_volume(b.mesh, weight_n_per_m3);
    Points load(x.size(), Vec3::Zero());
    for (std::size_t i = 0; i < x.size(); ++i) load[i].z() = -weight[i];
    x = reference.equilibrium(x, b.held, load, 1e-8);
    EXPECT_NEAR(tip_drop_m(b, x) / b.length_m / c.sag, 1, 0.05) << c.beta;
  }
  // The fast kernels are in balance where the reference is.
  VolumeMaterial material;
  material.young_pa = young;
  material.poisson = 0.3;
  const TetSolid solid(b.mesh, material, {});
  std::vector<Vec4f> at(x.size(), Vec4f::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) at[i].head<3>() = x[i].cast<float>();
  std::vector<Vec3> force(x.size());
  solid.elastic_forces_n(at, force);
  const Points expected = reference.forces_n(x);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((force[i] - expected[i]).norm(), 1e-4 * young * area);
}

// Between plates that it slides on, 20 % shorter.
TEST(A_accuracy, A_16_volume_and_deflection_hold_as_poisson_nears_a_half) {
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.1, 0.1, 0.1));
  for (const double poisson : {0.49, 0.499}) {
    const TetReference reference(mesh, test::lame(1e4, poisson));
    std::vector<std::uint8_t> held;
    for (const Vec3& p : mesh.vertices_body_m)
      held.push_back(static_cast<std::uint8_t>((p.z() == 0 || p.z() == 0.1 ? test::kHeldZ : 0) +
                                               (p.x() == 0 ? test::kHeldX : 0) + (p.y() == 0 ? test::kHeldY : 0)));
    Points x = mesh.vertices_body_m;
    for (int n = 1; n <= 4; ++n) {
      for (std::size_t i = 0; i < x.size(); ++i)
        if (mesh.vertices_body_m[i].z() == 0.1) x[i].z() = 0.1 - 0.005 * n;
      x = reference.equilibrium(x, held, Points(x.size(), Vec3::Zero()), 1e-8);
    }
    double volume = 0;
    for (const Tetrahedron& t : mesh.tetrahedra) volume += tet_volume_m3(x[t[0]], x[t[1]], x[t[2]], x[t[3]]);
    EXPECT_LT(std::abs(volume / 1e-3 - 1), 2 * (1 - 2 * poisson) * 0.2) << poisson;
    // J = 1 + (1 - 2 nu)(1 - 1 / l)
    EXPECT_NEAR(volume / 1e-3, 1 - (1 - 2 * poisson) * 0.25, 1e-6) << poisson;
  }
  EXPECT_GT(cantilever_ratio(4, 0.499, BoxLattice::five, true), 0.8);
  EXPECT_LT(cantilever_ratio(4, 0.499, BoxLattice::kuhn, false), 0.1) << "locks";
}

// u = A sin(pi x) sin(pi y) sin(pi z) e on a unit cube held all around, small: f = - (lambda + mu) grad div u - mu lap
// u.
struct Errors {
  double l2, energy;
};
Errors manufactured(int n) {
  const double amplitude = 1e-6;
  const Vec3 e = Vec3(1, 0.5, -0.7);
  const auto [mu, lambda] = test::lame(1, 0.3);
  TetMesh mesh = test::tet_box(n, n, n, Vec3(1, 1, 1));
  const TetReference reference(mesh, {mu, lambda});
  const auto s = [](double t) { return std::sin(M_PI * t); };
  const auto c = [](double t) { return std::cos(M_PI * t); };
  const auto exact = [&](const Vec3& p) -> Vec3 { return amplitude * s(p.x()) * s(p.y()) * s(p.z()) * e; };
  const auto body_force = [&](const Vec3& p) -> Vec3 {
    const double sx = s(p.x()), sy = s(p.y()), sz = s(p.z()), cx = c(p.x()), cy = c(p.y()), cz = c(p.z());
    Mat3 second;  // d^2 (sin sin sin) / dx_i dx_j over pi^2
    second << -sx * sy * sz, cx * cy * sz, cx * sy * cz, cx * cy * sz, -sx * sy * sz, sx * cy * cz, cx * sy * cz,
        sx * cy * cz, -sx * sy * sz;
    return -amplitude * M_PI * M_PI * ((lambda + mu) * second * e - 3 * mu * sx * sy * sz * e);
  };
  Points load(mesh.vertices_body_m.size(), Vec3::Zero());
  std::vector<std::uint8_t> held;
  for (const Vec3& p : mesh.vertices_body_m)
    held.push_back(test::held_if(p.minCoeff() < 1e-12 || p.maxCoeff() > 1 - 1e-12));
  // Four points a tetrahedron, exact to second order.
  const double a = 0.5854101966249685, b = 0.1381966011250105;
  const auto points = [&](const Tetrahedron& t, auto visit) {
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<double, 4> w{b, b, b, b};
      w[k] = a;
      Vec3 p = Vec3::Zero();
      for (std::size_t i = 0; i < 4; ++i) p += w[i] * mesh.vertices_body_m[t[i]];
      visit(w, p);
    }
  };
  for (const Tetrahedron& t : mesh.tetrahedra)
    points(t, [&](const std::array<double, 4>& w, const Vec3& p) {
      for (std::size_t i = 0; i < 4; ++i) load[t[i]] += 0.25 * tet_volume_m3(mesh, t) * w[i] * body_force(p);
    });
  const Points x = reference.equilibrium(mesh.vertices_body_m, held, load, 1e-16);
  Errors errors{0, 0};
  double size = 0;
  for (std::size_t n_t = 0; n_t < mesh.tetrahedra.size(); ++n_t) {
    const Tetrahedron& t = mesh.tetrahedra[n_t];
    const double v = tet_volume_m3(mesh, t);
    const Mat3 found = reference.gradient(n_t, x) - Mat3::Identity();
    points(t, [&](const std::array<double, 4>& w, const Vec3& p) {
      Vec3 u = Vec3::Zero();
      for (std::size_t i = 0; i < 4; ++i) u += w[i] * (x[t[i]] - mesh.vertices_body_m[t[i]]);
      errors.l2 += 0.25 * v * (u - exact(p)).squaredNorm();
      size += 0.25 * v * exact(p).squaredNorm();
      const Vec3 g =
          amplitude * M_PI *
          Vec3(c(p.x()) * s(p.y()) * s(p.z()), s(p.x()) * c(p.y()) * s(p.z()), s(p.x()) * s(p.y()) * c(p.z()));
      errors.energy += 0.25 * v * (found - e * g.transpose()).squaredNorm();
    });
  }
  return {std::sqrt(errors.l2 / size), std::sqrt(errors.energy / size)};
}

TEST(A_accuracy, A_17_errors_fall_with_the_square_of_the_cell_and_of_strain_with_the_cell) {
  const Errors coarse = manufactured(5), fine = manufactured(10);
  EXPECT_GT(std::log2(coarse.l2 / fine.l2), 1.8);
  EXPECT_GT(std::log2(coarse.energy / fine.energy), 0.9);
}

}  // namespace
}  // namespace sectio
