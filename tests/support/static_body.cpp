#include "tests/support/static_body.h"

#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

#include "tests/support/hex_reference.h"
#include "tests/support/tet_reference.h"

namespace sectio::test {

double SpringReference::energy_j(const std::vector<Vec3>& x) const {
  double energy = 0;
  for (const auto& s : springs_)
    energy += 0.5 * s.stiffness_n_per_m * std::pow((x[s.b] - x[s.a]).norm() - s.rest_length_m, 2);
  return energy;
}

std::vector<Vec3> SpringReference::forces_n(const std::vector<Vec3>& x) const {
  std::vector<Vec3> force(x.size(), Vec3::Zero());
  for (const auto& s : springs_) {
    const Vec3 d = x[s.b] - x[s.a], f = s.stiffness_n_per_m * (1 - s.rest_length_m / d.norm()) * d;
    force[s.a] += f;
    force[s.b] -= f;
  }
  return force;
}

Eigen::SparseMatrix<double> SpringReference::hessian(const std::vector<Vec3>& x) const {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& s : springs_) {
    const Vec3 d = x[s.b] - x[s.a], n = d.normalized();
    const double slack = 1 - s.rest_length_m / d.norm();
    const Mat3 k = s.stiffness_n_per_m * (slack * Mat3::Identity() + (1 - slack) * n * n.transpose());
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (const auto& [a, b, w] : {std::tuple{s.a, s.a, 1.0}, {s.b, s.b, 1.0}, {s.a, s.b, -1.0}, {s.b, s.a, -1.0}})
          entries.emplace_back(3 * a + i, 3 * b + j, w * k(i, j));
  }
  const auto n = static_cast<Eigen::Index>(3 * x.size());
  Eigen::SparseMatrix<double> h(n, n);
  h.setFromTriplets(entries.begin(), entries.end());
  return h;
}

Vec3 StaticBody::at(VertexId v, const Points& x) const {
  Vec3 sum = Vec3::Zero();
  for (const Share& s : riding[v]) sum += s.weight * x[s.particle];
  return sum;
}

StaticBody::Points StaticBody::on_particles(const Points& on_vertices) const {
  Points sum(rest_m.size(), Vec3::Zero());
  for (std::size_t v = 0; v < riding.size(); ++v)
    for (const Share& s : riding[v]) sum[s.particle] += s.weight * on_vertices[v];
  return sum;
}

std::vector<double> areas_of_vertices_m2(const TetMesh& mesh, const std::function<bool(const Vec3&)>& on) {
  std::vector<double> area(mesh.vertices_body_m.size(), 0);
  const TetSurface outside = surface_of(mesh);
  const auto& x = outside.soup.vertices_body_m;
  for (const auto& t : outside.soup.triangles) {
    if (!on(x[t[0]]) || !on(x[t[1]]) || !on(x[t[2]])) continue;
    for (const VertexId v : t) area[outside.of_volume[v]] += (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm() / 6;
  }
  return area;
}

namespace {

StaticBody static_body(const TetMesh& mesh, std::vector<Vec3> rest_m, std::shared_ptr<const ElasticReference> model) {
  StaticBody body{mesh, std::move(rest_m), masses_by_volume(mesh, 1), {}, {}, {}};
  body.equilibrium = [model](const auto& x, const auto& held, const auto& load, double tolerance_n) {
    return newton_equilibrium(*model, x, held, load, tolerance_n);
  };
  body.forces_n = [model](const auto& x) { return model->forces_n(x); };
  for (std::size_t v = 0; v < mesh.vertices_body_m.size(); ++v) body.riding.push_back({{v, 1}});
  return body;
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const StaticModel& model) {
  return out << model.name;
}

StaticModel tetra_springs() {
  return {"tetra_springs", BoxLattice::five,
          [](const TetMesh& whole, const TetMesh& mesh, double, double young_pa, double) {
            VolumeMaterial material;
            material.young_pa = young_pa;
            VolumeSettings settings;
            settings.step_s = 1e-9;
            TetSpringOptions options = TetSprings(whole, material, settings).options();
            options.calibrate = false;
            return static_body(
                mesh, mesh.vertices_body_m,
                std::make_shared<SpringReference>(TetSprings(mesh, material, settings, options).springs()));
          }};
}

StaticModel neo_hookean(bool nodal_pressure, BoxLattice lattice) {
  return {nodal_pressure ? "neo_hookean" : "element_pressure", lattice,
          [=](const TetMesh&, const TetMesh& mesh, double, double young_pa, double poisson) {
            return static_body(mesh, mesh.vertices_body_m,
                               std::make_shared<TetReference>(mesh, lame(young_pa, poisson), nodal_pressure));
          }};
}

StaticModel neo_hookean_lattice(double beside) {
  return {"neo_hookean_lattice", BoxLattice::five,
          [=](const TetMesh& whole, const TetMesh& mesh, double cell_m, double young_pa, double poisson) {
            Grid grid = grid_around(whole, cell_m);
            grid.origin_m.array() -= beside * cell_m;
            const auto reference = std::make_shared<HexReference>(lattice_of(mesh, grid), lame(young_pa, poisson));
            const HexLattice lattice = reference->lattice();
            std::vector<Vec3> rest_m;
            for (std::uint32_t n = 0; n < lattice.nodes.size(); ++n) rest_m.push_back(lattice.rest_m(n));
            StaticBody body = static_body(mesh, std::move(rest_m), reference);
            body.volume_m3.assign(lattice.nodes.size(), 0);
            for (const HexCell& cell : lattice.cells)
              for (const std::uint32_t n : cell.nodes) body.volume_m3[n] += cell.fill * std::pow(cell_m, 3) / 8;
            for (std::size_t v = 0; v < body.riding.size(); ++v) {
              body.riding[v].clear();
              for (std::size_t c = 0; c < 8; ++c)
                body.riding[v].push_back({lattice.cells[lattice.points[v].cell].nodes[c], lattice.points[v].weight(c)});
            }
            return body;
          }};
}

}  // namespace sectio::test
