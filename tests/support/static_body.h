// Bodies at rest for the cases of the accuracy suite: the elements of one model in double precision, which a test of
// its own compares with the fast kernels, loaded and held by their particles (vertices or lattice nodes), asked by the
// vertices of the tetrahedra that these carry.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/hex_reference.h"
#include "tests/support/tet_reference.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {

// The model tetra_springs: E = sum k (l - l0)^2 / 2.
class SpringReference {
 public:
  explicit SpringReference(std::vector<TetSprings::Spring> springs) : springs_(std::move(springs)) {}

  double energy_j(const std::vector<Vec3>& x) const {
    double energy = 0;
    for (const auto& s : springs_)
      energy += 0.5 * s.stiffness_n_per_m * std::pow((x[s.b] - x[s.a]).norm() - s.rest_length_m, 2);
    return energy;
  }
  std::vector<Vec3> forces_n(const std::vector<Vec3>& x) const {
    std::vector<Vec3> force(x.size(), Vec3::Zero());
    for (const auto& s : springs_) {
      const Vec3 d = x[s.b] - x[s.a], f = s.stiffness_n_per_m * (1 - s.rest_length_m / d.norm()) * d;
      force[s.a] += f;
      force[s.b] -= f;
    }
    return force;
  }
  Eigen::SparseMatrix<double> hessian(const std::vector<Vec3>& x) const {
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

 private:
  std::vector<TetSprings::Spring> springs_;
};

struct StaticBody {
  using Points = std::vector<Vec3>;
  struct Share {
    std::size_t particle;
    double weight;
  };

  TetMesh mesh;
  Points rest_m;                           // of the particles
  std::vector<double> volume_m3;           // of each particle, as its mass is
  std::vector<std::vector<Share>> riding;  // of each vertex: on which particles
  std::function<Points(const Points& x, const std::vector<std::uint8_t>& held, const Points& load_n,
                       double tolerance_n)>
      equilibrium;
  std::function<Points(const Points& x)> forces_n;  // of the tissue on its particles

  Vec3 at(VertexId v, const Points& x) const {
    Vec3 sum = Vec3::Zero();
    for (const Share& s : riding[v]) sum += s.weight * x[s.particle];
    return sum;
  }
  Vec3 displacement_m(VertexId v, const Points& x) const { return at(v, x) - mesh.vertices_body_m[v]; }
  Points on_particles(const Points& on_vertices) const {
    Points sum(rest_m.size(), Vec3::Zero());
    for (std::size_t v = 0; v < riding.size(); ++v)
      for (const Share& s : riding[v]) sum[s.particle] += s.weight * on_vertices[v];
    return sum;
  }
};

// Of each vertex, by the triangles of the surface that `on` accepts by their corners; adds up to their area.
template <class On>
std::vector<double> areas_of_vertices_m2(const TetMesh& mesh, const On& on) {
  std::vector<double> area(mesh.vertices_body_m.size(), 0);
  const TetSurface outside = surface_of(mesh);
  const auto& x = outside.soup.vertices_body_m;
  for (const auto& t : outside.soup.triangles) {
    if (!on(x[t[0]]) || !on(x[t[1]]) || !on(x[t[2]])) continue;
    for (const VertexId v : t) area[outside.of_volume[v]] += (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm() / 6;
  }
  return area;
}

template <class Reference>
StaticBody static_body(const TetMesh& mesh, std::vector<Vec3> rest_m, Reference reference) {
  StaticBody body{mesh, std::move(rest_m), masses_by_volume(mesh, 1), {}, {}, {}};
  const auto model = std::make_shared<const Reference>(std::move(reference));
  body.equilibrium = [model](const auto& x, const auto& held, const auto& load, double tolerance_n) {
    return newton_equilibrium(*model, x, held, load, tolerance_n);
  };
  body.forces_n = [model](const auto& x) { return model->forces_n(x); };
  for (std::size_t v = 0; v < mesh.vertices_body_m.size(); ++v) body.riding.push_back({{v, 1}});
  return body;
}

// A model as the cases take it. The mesh is of cubes as large as `cell_m`, and of these the lattice's cells are;
// `whole`: what it was before it was cut.
struct StaticModel {
  const char* name;
  BoxLattice lattice = BoxLattice::five;
  std::function<StaticBody(const TetMesh& whole, const TetMesh& mesh, double cell_m, double young_pa, double poisson)>
      make;
};
inline std::ostream& operator<<(std::ostream& out, const StaticModel& model) {
  return out << model.name;
}

// tetra_springs: its Poisson's ratio is that of springs, whatever is asked for. Calibrated on the whole body.
inline StaticModel tetra_springs() {
  return {"tetra_springs", BoxLattice::five,
          [](const TetMesh& whole, const TetMesh& mesh, double, double young_pa, double) {
            VolumeMaterial material;
            material.young_pa = young_pa;
            VolumeSettings settings;
            settings.step_s = 1e-9;
            TetSpringOptions options = TetSprings(whole, material, settings).options();
            options.calibrate = false;
            return static_body(mesh, mesh.vertices_body_m,
                               SpringReference(TetSprings(mesh, material, settings, options).springs()));
          }};
}
// neo_hookean, and two alternatives: with a pressure of each element, and this on a lattice of six tetrahedra a cube.
inline StaticModel neo_hookean(bool nodal_pressure = true, BoxLattice lattice = BoxLattice::five) {
  return {nodal_pressure ? "neo_hookean" : "element_pressure", lattice,
          [=](const TetMesh&, const TetMesh& mesh, double, double young_pa, double poisson) {
            return static_body(mesh, mesh.vertices_body_m, TetReference(mesh, lame(young_pa, poisson), nodal_pressure));
          }};
}
// neo_hookean_lattice; `beside`: the distance of the cells' faces from the body's, in cells.
inline StaticModel neo_hookean_lattice(double beside = 0) {
  return {"neo_hookean_lattice", BoxLattice::five,
          [=](const TetMesh& whole, const TetMesh& mesh, double cell_m, double young_pa, double poisson) {
            Grid grid = grid_around(whole, cell_m);
            grid.origin_m.array() -= beside * cell_m;
            HexReference reference(lattice_of(mesh, grid), lame(young_pa, poisson));
            const HexLattice lattice = reference.lattice();
            std::vector<Vec3> rest_m;
            for (std::uint32_t n = 0; n < lattice.nodes.size(); ++n) rest_m.push_back(lattice.rest_m(n));
            StaticBody body = static_body(mesh, std::move(rest_m), std::move(reference));
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
