#include "tests/support/explicit_limit.h"

#include <algorithm>
#include <cmath>

#include "common/math/fixed_sequence.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/shapes.h"

namespace sectio::test {

namespace {

template <class Model>
Oscillator on_vertices(const std::shared_ptr<Model>& model) {
  Oscillator body;
  body.rest = at_rest(model->mesh());
  for (VertexId v = 0; v < body.rest.size(); ++v) body.inverse_mass.push_back(model->inverse_mass_per_kg(v));
  body.forces_n = [model](const Points& x, std::span<Vec3> force) { model->elastic_forces_n(x, force); };
  return body;
}

}  // namespace

double growth_decades_per_step(const Oscillator& body, double step_s, int steps) {
  constexpr double kGrown = 300, kMostDecades = 300;
  const std::size_t size = body.rest.size();
  std::vector<Vec3> u(size), velocity(size, Vec3::Zero()), ahead(size), behind(size);
  for (std::size_t i = 0; i < size; ++i) u[i] = body.inverse_mass[i] > 0 ? fixed_vector(i) : Vec3::Zero();
  Points x = body.rest, y = x;
  double most = 1;
  for (int n = 1; n <= steps; ++n) {
    const double scale = body.small_m / most;
    for (std::size_t i = 0; i < size; ++i) {
      const Vec3f by = (scale * u[i]).cast<float>();
      x[i].head<3>() = body.rest[i].head<3>() + by;
      y[i].head<3>() = body.rest[i].head<3>() - by;
    }
    body.forces_n(x, ahead);
    body.forces_n(y, behind);
    most = 0;
    for (std::size_t i = 0; i < size; ++i) {
      velocity[i] += step_s * body.inverse_mass[i] / (2 * scale) * (ahead[i] - behind[i]);
      u[i] += step_s * velocity[i];
      most = std::max(most, u[i].norm());
    }
    if (!(most < kGrown)) return std::min(std::log10(most), kMostDecades) / n;
  }
  return 0;
}

double measured_limit_s(const Oscillator& body, double guess_s) {
  double low = guess_s, high = guess_s;
  while (growth_decades_per_step(body, low) > 0) high = low, low *= 0.7;
  while (high <= low || growth_decades_per_step(body, high) == 0) low = std::max(low, high), high = 1.4 * low;
  while (high > 1.01 * low) {
    const double middle = std::sqrt(low * high);
    (growth_decades_per_step(body, middle) > 0 ? high : low) = middle;
  }
  return std::sqrt(low * high);
}

double measured_limit_s(const Oscillator& body) {
  return measured_limit_s(body, body.predicted_s);
}

VolumeSettings undisturbed(double least_substep_s) {
  VolumeSettings settings;
  settings.step_s = 1e-6;
  settings.gravity_m_per_s2.setZero();
  settings.least_substep_s = least_substep_s;
  return settings;
}

VolumeMaterial undamped(double young_pa, double poisson) {
  VolumeMaterial material;
  material.young_pa = young_pa;
  material.poisson = poisson;
  material.damping_per_s = 0;
  return material;
}

Oscillator springs_of(const TetMesh& mesh, const VolumeMaterial& material, double least_substep_s) {
  const auto model = std::make_shared<TetSprings>(mesh, material, undisturbed(least_substep_s));
  Oscillator body = on_vertices(model);
  body.predicted_s = model->substep_limit_s() / 0.8;
  return body;
}

TetStiffness stiffness_of(const TetMesh& mesh, const VolumeMaterial& material) {
  const double mu = material.young_pa / (2 * (1 + material.poisson)),
               lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
  TetStiffness stiffness;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const double factor = material.stiffness_factor.empty() ? 1 : material.stiffness_factor[t];
    stiffness.shear_pa.push_back(factor * mu);
    stiffness.bulk_pa.push_back(factor * (lambda + mu));
  }
  return stiffness;
}

Oscillator solid_of(const TetMesh& mesh, const VolumeMaterial& material, double least_substep_s) {
  const auto model = std::make_shared<TetSolid>(mesh, material, undisturbed(least_substep_s));
  Oscillator body = on_vertices(model);
  body.predicted_s =
      0.95 * 2 / std::sqrt(largest_omega2_at_rest(mesh, stiffness_of(mesh, material), body.inverse_mass));
  return body;
}

double row_bound_s(const TetMesh& mesh, const VolumeMaterial& material, std::span<const double> inverse_mass) {
  const TetStiffness stiffness = stiffness_of(mesh, material);
  const TetStars stars(mesh);
  VertexStar star;
  double omega2 = 0;
  for (VertexId v = 0; v < inverse_mass.size(); ++v) {
    star.begin(mesh, stars, v);
    star.measure(mesh);
    omega2 = std::max(omega2, inverse_mass[v] * stiffness_bound_n_per_m(star, stiffness));
  }
  return 2 / std::sqrt(omega2);
}

Oscillator lattice_of(const TetMesh& mesh, const VolumeMaterial& material, double cell_m) {
  const auto model = std::make_shared<HexSolid>(mesh, grid_around(mesh, cell_m), material, undisturbed());
  Oscillator body;
  for (std::uint32_t n = 0; n < model->lattice().nodes.size(); ++n) {
    body.rest.push_back(Vec4f::Zero());
    body.rest[n].head<3>() = model->lattice().rest_m(n).cast<float>();
    body.inverse_mass.push_back(1 / model->node_mass_kg()[n]);
  }
  body.forces_n = [model](const Points& x, std::span<Vec3> force) { model->elastic_forces_n(x, force); };
  body.predicted_s = model->explicit_limit_s() / 0.8;
  return body;
}

Oscillator surface_of(double young_pa, double poisson) {
  SurfaceSpringMaterial material;
  material.young_pa = young_pa;
  material.poisson = poisson;
  material.pretension = 0;
  material.damping_per_s = 0;
  SurfaceSpringSettings settings;
  settings.gravity_m_per_s2.setZero();
  settings.step_s = 1e-6;
  const TriangleMesh mesh(ellipsoid(2, Vec3(0.05, 0.04, 0.03)));
  const auto model = std::make_shared<SurfaceSprings>(mesh, Pose{}, material, settings);
  Oscillator body;
  for (const Vec3& x : mesh.rest_body_m()) {
    body.inverse_mass.push_back(model->inverse_mass_per_kg(static_cast<VertexId>(body.rest.size())));
    body.rest.push_back(Vec4f::Zero());
    body.rest.back().head<3>() = x.cast<float>();
  }
  body.forces_n = [model](const Points& x, std::span<Vec3> force) {
    Points at = x, v = still(x);
    model->step(at, v);
    for (VertexId i = 0; i < v.size(); ++i)
      force[i] = v[i].head<3>().cast<double>() / (1e-6 * model->inverse_mass_per_kg(i));
  };
  body.predicted_s = model->largest_stable_step_s();
  return body;
}

TetMesh bar_for_limits() {
  TetMesh mesh = tet_box(8, 4, 4, Vec3(0.1, 0.05, 0.05));
  jitter(mesh, 0.0006);
  return mesh;
}

std::string name_of(Model model) {
  static const std::string kNames[] = {"surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"};
  return kNames[static_cast<std::size_t>(model)];
}

Oscillator oscillator(Model model, double young_pa, double poisson) {
  const VolumeMaterial material = undamped(young_pa, poisson);
  switch (model) {
    case Model::surface_springs:
      return surface_of(young_pa, poisson);
    case Model::tetra_springs:
      return springs_of(bar_for_limits(), material);
    case Model::neo_hookean:
      return solid_of(bar_for_limits(), material);
    case Model::neo_hookean_lattice:
      break;
  }
  return lattice_of(bar_for_limits(), material, kCell_m);
}

TetMesh bar_with_slivers(double sliver) {
  const TetMesh mesh = tet_box(8, 4, 4, Vec3(0.1, 0.05, 0.05));
  TetTopology volume(mesh);
  const double x = (4 + sliver) * kCell_m;
  TetCutSettings settings;
  settings.snap = 0;
  cut(volume, {{Vec3(x, -1, -1), Vec3(x, 1, -1), Vec3(x, 1, 1), Vec3(x, -1, 1)}}, settings);
  return volume.mesh();
}

}  // namespace sectio::test
