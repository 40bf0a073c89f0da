#include <algorithm>
#include <limits>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/planning/resolution.h"
#include "tests/chart/baselines.h"
#include "tests/chart/surface_specimen.h"
#include "tests/chart/tet_specimen.h"
#include "tests/support/shapes.h"

namespace sectio::chart {
namespace {

constexpr double kStep = 1e-3;  // of the scenes; explicit models divide it

std::string steps_text(double step_s, const std::string& with) {
  char text[60];
  std::snprintf(text, sizeof text, "%.3g ms%s%s", 1000 * step_s, with.empty() ? "" : " ", with.c_str());
  return text;
}

Method on_tets(const std::string& model, const std::string& driver, double step_s, bool is_ours,
               const MakeVolume& make) {
  return {model, driver, [=](const ChartScene& scene, int across) { return tet_specimen(scene, across, step_s, make); },
          is_ours};
}

using Mesh = TetMesh;
using Material = VolumeMaterial;
using Settings = VolumeSettings;

Method surface_springs() {
  return {"surface springs", "explicit", [](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
            return scene.ball ? surface_specimen(scene, across, kStep) : nullptr;
          }};
}
Method tetra_springs() {
  return on_tets("tetra springs", "explicit", kStep, true, [](const Mesh& m, const Material& t, const Settings& s) {
    return with_forces(std::make_unique<TetSprings>(m, t, s));
  });
}
Method neo_hookean() {
  return on_tets("neo-Hookean tetra", "explicit", kStep, true, [](const Mesh& m, const Material& t, const Settings& s) {
    return with_forces(std::make_unique<TetSolid>(m, t, s));
  });
}
// The simulator's own way with `driver: implicit`: as many iterations as it takes, up to its own limit.
Method implicit_neo_hookean() {
  return on_tets("neo-Hookean tetra", "implicit", kStep, true, [](const Mesh& m, const Material& t, const Settings& s) {
    return with_forces(std::make_unique<TetSolid>(m, t, s, VolumeIntegrator::implicit_only));
  });
}
// On the tetrahedra that a scene's body gets, from the lattice mesher; as many cubes of its lattice across, two or
// more: what a single one gets right it gets right by accident.
Method in_a_scene(const std::string& model, bool rides, const MakeVolume& make) {
  return {model, "as in a scene", [=](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
            if (across < 2) return nullptr;
            const double volume_m3 = scene.size_m.prod(), cell_m = scene.across_m() / across;
            FillSettings settings;
            settings.tetrahedra = rides ? planning::embedded_for(volume_m3, cell_m)
                                        : std::max(12.0, planning::tetrahedra_for(volume_m3, cell_m));
            settings.material = {scene.young_pa, scene.poisson, scene.density_kg_per_m3};
            return tet_specimen(scene, fill(test::box(4, 4, 4, scene.size_m), settings).mesh, kStep, make);
          }};
}
Method lattice_in_a_scene() {
  return {"hexahedra", "as in a scene", [](const ChartScene& scene, int across) {
            const double cell_m = scene.across_m() / across;
            return in_a_scene("", true,
                              [cell_m](const Mesh& m, const Material& t, const Settings& s) {
                                auto solid = std::make_unique<HexSolid>(m, grid_around(m, cell_m), t, s);
                                const std::size_t cells = solid->lattice().cells.size();
                                return ChartModel{std::move(solid), nullptr, true, cells};
                              })
                .make(scene, across);
          }};
}
// Cells as large as those of the tetrahedra that they carry; `offset`: by how much of a cell they lie beside them.
Method lattice(const std::string& name, double offset) {
  return on_tets(name, "explicit", kStep, true, [offset](const Mesh& m, const Material& t, const Settings& s) {
    const double bottom = std::ranges::min(m.vertices_body_m, {}, [](const Vec3& p) { return p.z(); }).z();
    double cell_m = std::numeric_limits<double>::infinity();
    for (const Vec3& p : m.vertices_body_m)
      if (p.z() > bottom + 1e-9) cell_m = std::min(cell_m, p.z() - bottom);
    Grid grid = grid_around(m, cell_m);
    grid.origin_m.array() -= offset * cell_m;
    auto solid = std::make_unique<HexSolid>(m, grid, t, s);
    const std::size_t cells = solid->lattice().cells.size();
    return ChartModel{std::move(solid), nullptr, offset > 0, cells};
  });
}
Method implicit_at(double step_s) {
  return on_tets("neo-Hookean tetra", steps_text(step_s, "implicit"), step_s, true,
                 [](const Mesh& m, const Material& t, const Settings& s) {
                   return with_forces(std::make_unique<TetSolid>(m, t, s, VolumeIntegrator::implicit_only));
                 });
}

}  // namespace

std::vector<Method> methods(bool quick) {
  std::vector<Method> all{surface_springs(), tetra_springs(), neo_hookean(), lattice("hexahedra", 0),
                          lattice("hexahedra beside faces", 0.37)};
  if (!quick) {
    all.push_back(implicit_neo_hookean());
    all.push_back(in_a_scene("tetra springs", false, [](const Mesh& m, const Material& t, const Settings& s) {
      return with_forces(std::make_unique<TetSprings>(m, t, s));
    }));
    all.push_back(in_a_scene("neo-Hookean tetra", false, [](const Mesh& m, const Material& t, const Settings& s) {
      return with_forces(std::make_unique<TetSolid>(m, t, s));
    }));
    all.push_back(lattice_in_a_scene());
  }
  for (const double step_s : quick ? std::vector{0.0167} : std::vector{0.004, 0.0167, 0.0333})
    all.push_back(implicit_at(step_s));
  // Steps and iterations.
  using Drivers = std::vector<std::pair<double, int>>;
  for (const auto& [step_s, n] : quick ? Drivers{{5e-4, 1}} : Drivers{{1e-3, 1}, {5e-4, 1}, {2.5e-4, 1}, {1e-3, 4}})
    all.push_back(on_tets("XPBD", steps_text(step_s, std::to_string(n) + " iterations"), step_s, false,
                          [n = n](const Mesh& m, const Material& t, const Settings& s) { return xpbd(m, t, s, n); }));
  for (const auto& [step_s, n] : quick ? Drivers{{2e-3, 10}} : Drivers{{4e-3, 20}, {2e-3, 10}, {1e-3, 5}, {5e-4, 5}})
    all.push_back(
        on_tets("implicit corotational", steps_text(step_s, std::to_string(n) + " iterations"), step_s, false,
                [n = n](const Mesh& m, const Material& t, const Settings& s) { return corotational(m, t, s, n); }));
  all.push_back(on_tets("plain tetrahedra", "explicit", kStep, false, plain_tetrahedra));
  all.push_back(on_tets("paper C's springs", "explicit", kStep, false, papers_springs));
  return all;
}

}  // namespace sectio::chart
