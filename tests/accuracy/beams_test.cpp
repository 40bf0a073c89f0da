// Bars at rest, bent a little and twisted, volume near incompressibility, and the order of convergence: the elements of
// each model in double precision (static_body.h, kernels_test.cpp) against closed forms and the bricks.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/tetra/tet_star.h"
#include "tests/support/brick_reference.h"
#include "tests/support/static_body.h"

namespace sectio::beams_test {
namespace {

using test::BoxLattice;
using test::StaticBody;
using test::StaticModel;
using Points = std::vector<Vec3>;

constexpr double kYoung = 1e4, kSide = 0.02;

struct Bar {
  StaticBody body;
  double length_m;
  std::vector<double> end_m2;  // the end x = L
  bool at(const Vec3& p, double x_m) const { return std::abs(p.x() - x_m) < 1e-9; }
};
Bar bar(const StaticModel& model, int across, int slenderness, double poisson) {
  const double length = slenderness * kSide;
  const TetMesh mesh = test::tet_box(slenderness * across, across, across, Vec3(length, kSide, kSide), model.lattice);
  return {model.make(mesh, mesh, kSide / across, kYoung, poisson), length,
          test::areas_of_vertices_m2(mesh, [&](const Vec3& p) { return p.x() > length - 1e-9; })};
}

// By how much the end of a bar held at x = 0 sinks under a load spread over it.
constexpr double kEndLoad = 1e-6;
double drop_m(const Bar& b) {
  Points load(b.end_m2.size(), Vec3::Zero());
  for (std::size_t v = 0; v < load.size(); ++v) load[v].z() = -kEndLoad * b.end_m2[v] / (kSide * kSide);
  std::vector<std::uint8_t> held;
  for (const Vec3& p : b.body.rest_m) held.push_back(test::held_if(b.at(p, 0)));
  const Points x = b.body.equilibrium(b.body.rest_m, held, b.body.on_particles(load), 1e-12);
  double drop = 0;
  for (VertexId v = 0; v < load.size(); ++v) drop -= b.end_m2[v] / (kSide * kSide) * b.body.displacement_m(v, x).z();
  return drop;
}
// The deflection over Timoshenko's P L^3 / 3 E I + P L / (kappa G A), L / h = 8.
double cantilever_ratio(const StaticModel& model, int across, double poisson) {
  const Bar b = bar(model, across, 8, poisson);
  const double area = kSide * kSide, inertia = area * area / 12, shear = kYoung / (2 * (1 + poisson));
  const double kappa = 10 * (1 + poisson) / (12 + 11 * poisson), l = b.length_m;
  return drop_m(b) / (kEndLoad * l * l * l / (3 * kYoung * inertia) + kEndLoad * l / (kappa * shear * area));
}

struct Case {
  StaticModel model;
  int across;
  double poisson, ratio, within;
};

TEST(Accuracy, A_5_cantilever) {
  for (const Case& c : {Case{test::neo_hookean_lattice(), 2, 0.3, 1, 0.03},
                        {test::neo_hookean_lattice(), 2, 0.45, 1, 0.03},
                        {test::neo_hookean_lattice(), 4, 0.3, 1, 0.03},
                        {test::neo_hookean_lattice(), 4, 0.45, 1, 0.03},
                        {test::neo_hookean(), 4, 0.45, 0.876, 0.02},
                        {test::neo_hookean(), 4, 0.49, 0.850, 0.02},
                        {test::neo_hookean(false), 4, 0.45, 0.852, 0.02},
                        {test::tetra_springs(), 4, 0.25, 0.83, 0.03}})
    EXPECT_NEAR(cantilever_ratio(c.model, c.across, c.poisson), c.ratio, c.within) << c.model << " " << c.poisson;
}

TEST(Accuracy, A_5_known_failure_six_tetrahedra_to_a_cube_lock) {
  const StaticModel six = test::neo_hookean(false, BoxLattice::kuhn);
  for (const auto& [poisson, ratio] : {std::pair{0.3, 0.786}, {0.45, 0.595}, {0.49, 0.288}, {0.499, 0.058}})
    EXPECT_NEAR(cantilever_ratio(six, 4, poisson), ratio, 0.02) << poisson;
}

// Compared with the bricks, which know the effect of a clamped end.
TEST(Accuracy, A_5_cantilever_of_eight_cells_across) {
  const double poisson = 0.49;
  const Bar b = bar(test::neo_hookean(), 8, 2, poisson);
  const test::BrickReference bricks({4, 2, 2}, Vec3(b.length_m, kSide, kSide), lame(kYoung, poisson));
  // Simpson's rule over the end's nodes.
  const auto weight = [&](double s) {
    const auto k = std::lround(4 * s / kSide);
    return k == 0 || k == 4 ? 1.0 / 12 : k % 2 == 1 ? 4.0 / 12 : 2.0 / 12;
  };
  std::vector<std::uint8_t> held;
  Points load;
  for (const Vec3& p : bricks.nodes_m()) {
    held.push_back(test::held_if(p.x() == 0));
    load.push_back(b.at(p, b.length_m) ? Vec3(0, 0, -kEndLoad * weight(p.y()) * weight(p.z())) : Vec3(0, 0, 0));
  }
  const Points y = bricks.equilibrium(bricks.nodes_m(), held, load, 1e-12);
  const Vec3 end(b.length_m, kSide / 2, kSide / 2);
  EXPECT_NEAR(drop_m(b) / (end.z() - bricks.at(end, y).z()), 1, 0.08);
}

// T / T_ref of a square bar whose ends turn in their planes and may warp: T = G J phi / L, J = 0.140577 a^4.
double torsion_ratio(const StaticModel& model, int across, double poisson) {
  const Bar b = bar(model, across, 1, poisson);
  const double phi = 1e-3;
  Points x = b.body.rest_m;
  std::vector<std::uint8_t> held(x.size(), 0);
  const auto from_axis = [&](std::size_t i) -> Vec3 { return b.body.rest_m[i] - Vec3(x[i].x(), kSide / 2, kSide / 2); };
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool turned = b.at(x[i], b.length_m);
    if (!turned && !b.at(x[i], 0)) continue;
    held[i] = test::kHeldY | test::kHeldZ;
    if (turned) x[i] += phi * Vec3::UnitX().cross(from_axis(i));
    if (!turned && from_axis(i).norm() < 1e-9) held[i] = test::kHeldAll;
  }
  x = b.body.equilibrium(x, held, Points(x.size(), Vec3::Zero()), 1e-9);
  const Points force = b.body.forces_n(x);
  double torque = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (b.at(b.body.rest_m[i], b.length_m)) torque -= from_axis(i).cross(force[i]).x();
  return torque / (kYoung / (2 * (1 + poisson)) * 0.140577 * std::pow(kSide, 4) * phi / b.length_m);
}

TEST(Accuracy, A_8_torsion) {
  for (const Case& c : {Case{test::neo_hookean_lattice(), 4, 0.45, 1, 0.16},
                        {test::neo_hookean_lattice(), 4, 0.3, 1, 0.16},
                        {test::neo_hookean(), 4, 0.45, 1.33, 0.05},
                        {test::tetra_springs(), 4, 0.25, 1.1, 0.05}})
    EXPECT_NEAR(torsion_ratio(c.model, c.across, c.poisson), c.ratio, c.within) << c.model << " " << c.poisson;
}

TEST(Accuracy, A_8_torsion_falls_with_the_square_of_the_cell) {
  struct Refined {
    StaticModel model;
    double poisson, within, order;  // within: with 8 cells; order: from 4 to 8
  };
  for (const Refined& c :
       {Refined{test::neo_hookean_lattice(), 0.45, 0.04, 1.8}, {test::neo_hookean(), 0.45, 0.1, 1.8}}) {
    const double four = torsion_ratio(c.model, 4, c.poisson), eight = torsion_ratio(c.model, 8, c.poisson);
    EXPECT_NEAR(eight, 1, c.within) << c.model;
    EXPECT_GT(std::log2((four - 1) / (eight - 1)), c.order) << c.model;
  }
}

// A cube between plates that it slides on, 20 % shorter: J = 1 + (1 - 2 nu)(1 - 1 / l).
TEST(Accuracy, A_16_volume_and_deflection_hold_as_poisson_nears_a_half) {
  const TetMesh mesh = test::tet_box(4, 4, 4, Vec3::Constant(0.1));
  for (const StaticModel& model : {test::neo_hookean(), test::neo_hookean_lattice()})
    for (const double poisson : {0.49, 0.499}) {
      const StaticBody body = model.make(mesh, mesh, 0.025, kYoung, poisson);
      std::vector<std::uint8_t> held;
      for (const Vec3& p : body.rest_m)
        held.push_back(static_cast<std::uint8_t>((p.z() < 1e-9 || p.z() > 0.1 - 1e-9 ? test::kHeldZ : 0) +
                                                 (p.x() < 1e-9 ? test::kHeldX : 0) +
                                                 (p.y() < 1e-9 ? test::kHeldY : 0)));
      Points x = body.rest_m;
      for (int n = 1; n <= 4; ++n) {
        for (std::size_t i = 0; i < x.size(); ++i)
          if (body.rest_m[i].z() > 0.1 - 1e-9) x[i].z() = 0.1 - 0.005 * n;
        x = body.equilibrium(x, held, Points(x.size(), Vec3::Zero()), 1e-8);
      }
      double volume = 0;
      for (const Tetrahedron& t : mesh.tetrahedra)
        volume += tet_volume_m3(body.at(t[0], x), body.at(t[1], x), body.at(t[2], x), body.at(t[3], x));
      EXPECT_LT(std::abs(volume / 1e-3 - 1), 2 * (1 - 2 * poisson) * 0.2) << model << " " << poisson;
      EXPECT_NEAR(volume / 1e-3, 1 - (1 - 2 * poisson) * 0.25, 1e-6) << model << " " << poisson;
    }
  for (const double poisson : {0.49, 0.499}) EXPECT_GT(cantilever_ratio(test::neo_hookean_lattice(), 4, poisson), 0.93);
  EXPECT_GT(cantilever_ratio(test::neo_hookean(), 4, 0.499), 0.8);
}

// u = A sin(pi x) sin(pi y) sin(pi z) e on a unit cube held all around, small: f = - (lambda + mu) grad div u - mu lap
// u.
struct Manufactured {
  static constexpr double kAmplitude = 1e-6;
  Lame material = lame(1, 0.3);
  Vec3 e{1, 0.5, -0.7};

  static double s(double t) { return std::sin(M_PI * t); }
  static double c(double t) { return std::cos(M_PI * t); }
  Vec3 displacement(const Vec3& p) const { return kAmplitude * s(p.x()) * s(p.y()) * s(p.z()) * e; }
  Mat3 gradient(const Vec3& p) const {
    return kAmplitude * M_PI * e *
           Vec3(c(p.x()) * s(p.y()) * s(p.z()), s(p.x()) * c(p.y()) * s(p.z()), s(p.x()) * s(p.y()) * c(p.z()))
               .transpose();
  }
  Vec3 body_force(const Vec3& p) const {
    const double sx = s(p.x()), sy = s(p.y()), sz = s(p.z()), cx = c(p.x()), cy = c(p.y()), cz = c(p.z());
    Mat3 second;  // d^2 (sin sin sin) / dx_i dx_j over pi^2
    second << -sx * sy * sz, cx * cy * sz, cx * sy * cz, cx * cy * sz, -sx * sy * sz, sx * cy * cz, cx * sy * cz,
        sx * cy * cz, -sx * sy * sz;
    return -kAmplitude * M_PI * M_PI *
           ((material.lambda_pa + material.mu_pa) * second * e - 3 * material.mu_pa * sx * sy * sz * e);
  }
};

// Four points a tetrahedron, exact to second order.
template <class Visit>
void quadrature(const TetMesh& mesh, const Tetrahedron& t, const Visit& visit) {
  for (std::size_t k = 0; k < 4; ++k) {
    std::array<double, 4> w;
    w.fill(0.1381966011250105);
    w[k] = 0.5854101966249685;
    Vec3 p = Vec3::Zero();
    for (std::size_t i = 0; i < 4; ++i) p += w[i] * mesh.vertices_body_m[t[i]];
    visit(w, p, 0.25 * tet_volume_m3(mesh, t));
  }
}

struct Errors {
  double l2, energy;
};
Errors manufactured(const StaticModel& model, int n) {
  const Manufactured exact;
  const TetMesh mesh = test::tet_box(n, n, n, Vec3(1, 1, 1));
  const StaticBody body = model.make(mesh, mesh, 1.0 / n, 1, 0.3);
  Points load;
  std::vector<std::uint8_t> held;
  for (std::size_t i = 0; i < body.rest_m.size(); ++i) {
    const Vec3& p = body.rest_m[i];
    held.push_back(test::held_if(p.minCoeff() < 1e-9 || p.maxCoeff() > 1 - 1e-9));
    load.push_back(body.volume_m3[i] * exact.body_force(p));
  }
  const Points x = body.equilibrium(body.rest_m, held, load, 1e-16);
  Errors errors{0, 0};
  double size = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const TetShape shape = tet_shape(mesh, t);
    Mat3 found = Mat3::Zero();
    for (std::size_t k = 0; k < 4; ++k) found += body.displacement_m(t[k], x) * shape.gradient[k].transpose();
    quadrature(mesh, t, [&](const std::array<double, 4>& w, const Vec3& p, double volume) {
      Vec3 u = Vec3::Zero();
      for (std::size_t i = 0; i < 4; ++i) u += w[i] * body.displacement_m(t[i], x);
      errors.l2 += volume * (u - exact.displacement(p)).squaredNorm();
      errors.energy += volume * (found - exact.gradient(p)).squaredNorm();
      size += volume * exact.displacement(p).squaredNorm();
    });
  }
  return {std::sqrt(errors.l2 / size), std::sqrt(errors.energy / size)};
}

TEST(Accuracy, A_17_errors_fall_with_the_square_of_the_cell_and_of_strain_with_the_cell) {
  for (const StaticModel& model : {test::neo_hookean(), test::neo_hookean_lattice()}) {
    const Errors coarse = manufactured(model, 5), fine = manufactured(model, 10);
    EXPECT_GT(std::log2(coarse.l2 / fine.l2), 1.8) << model;
    EXPECT_GT(std::log2(coarse.energy / fine.energy), 0.9) << model;
  }
}

}  // namespace
}  // namespace sectio::beams_test
