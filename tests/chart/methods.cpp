#include <algorithm>

#include "common/core/formatted.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/planning/resolution.h"
#include "tests/chart/baselines.h"
#include "tests/chart/knife_cut.h"
#include "tests/chart/surface_specimen.h"
#include "tests/chart/tet_specimen.h"
#include "tests/support/shapes.h"

namespace sectio::chart {
namespace {

constexpr double kStep = 1e-3;  // step of the scenes; explicit models divide it

// A single cell is right by accident, and a knife takes many minutes through the finest meshes.
bool has(const ChartScene& scene, int across) {
  return across >= 2 && (!scene.cut_by_knife || across <= 6);
}

std::string steps_text(double step_s, const std::string& with) {
  return formatted("%.3g ms%s%s", 1000 * step_s, with.empty() ? "" : " ", with.c_str());
}

using Mesh = TetMesh;
using Material = VolumeMaterial;
using Settings = VolumeSettings;

// On the tetrahedra that a scene gives the body; as many cubes of the mesher's lattice across.
Method on_tets(const std::string& model, const std::string& driver, double step_s, bool is_ours,
               const MakeVolume& make) {
  return {model, driver, kOfScene,
          [=](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
            if (!has(scene, across)) return nullptr;
            const double cell_m = scene.across_m() / across;
            const double tetrahedra = std::max(12.0, planning::tetrahedra_for(scene.size_m.prod(), cell_m));
            return tet_specimen(scene, mesh_of(scene, tetrahedra), step_s, make);
          },
          is_ours};
}
// The same on a lattice of five tetrahedra to a cube, whose cubes fit the box and the slit.
Method by_hand(Method method, double step_s, const MakeVolume& make) {
  method.mesh = kByHand;
  method.make = [=](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
    return scene.cut_by_knife ? nullptr : tet_specimen(scene, across, step_s, make);
  };
  return method;
}

template <class Model>
MakeVolume explicit_model() {
  return
      [](const Mesh& m, const Material& t, const Settings& s) { return with_forces(std::make_unique<Model>(m, t, s)); };
}
// The model of a scene with `driver: implicit`.
ChartModel implicit_neo_hookean(const Mesh& m, const Material& t, const Settings& s) {
  return with_forces(std::make_unique<TetSolid>(m, t, s, VolumeIntegrator::implicit_only));
}

Method surface_springs() {
  return {"surface springs", "explicit", kOfScene,
          [](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
            return scene.ball ? surface_specimen(scene, across, kStep) : nullptr;
          }};
}

MakeVolume hexahedra(double cell_m, double offset) {
  return [=](const Mesh& m, const Material& t, const Settings& s) {
    Grid grid = grid_around(m, cell_m);
    grid.origin_m.array() -= offset * cell_m;
    auto solid = std::make_unique<HexSolid>(m, grid, t, s);
    const std::size_t cells = solid->lattice().cells.size();
    return ChartModel{std::move(solid), nullptr, true, cells};
  };
}
// Cells across the box, on the tetrahedra that a scene lets them carry. `offset`: by how much of a cell the body's
// faces lie beside those of the cells, as those of a turned body do.
Method lattice(const std::string& name, double offset) {
  return {name, "explicit", kOfScene, [offset](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
            if (!has(scene, across)) return nullptr;
            const double cell_m = scene.across_m() / across;
            return tet_specimen(scene, mesh_of(scene, planning::embedded_for(scene.size_m.prod(), cell_m)), kStep,
                                hexahedra(cell_m, offset));
          }};
}
Method lattice_by_hand() {
  return {"hexahedra", "explicit", kByHand, [](const ChartScene& scene, int across) -> std::unique_ptr<Specimen> {
            if (scene.cut_by_knife) return nullptr;
            return tet_specimen(scene, across, kStep, hexahedra(scene.across_m() / across, 0));
          }};
}

using Drivers = std::vector<std::pair<double, int>>;  // steps and iterations

void add_ours(bool quick, std::vector<Method>& all) {
  all.push_back(surface_springs());
  all.push_back(on_tets("tetra springs", "explicit", kStep, true, explicit_model<TetSprings>()));
  all.push_back(on_tets("neo-Hookean tetra", "explicit", kStep, true, explicit_model<TetSolid>()));
  all.push_back(lattice("hexahedra", 0));
  all.push_back(lattice("hexahedra beside faces", 0.37));
  for (const double step_s : quick ? std::vector{1.0 / 60} : std::vector{1e-3, 4e-3, 1.0 / 60, 1.0 / 30})
    all.push_back(on_tets("neo-Hookean tetra", steps_text(step_s, "implicit"), step_s, true, implicit_neo_hookean));
  all.push_back(by_hand(all[2], kStep, explicit_model<TetSolid>()));
  all.push_back(lattice_by_hand());
}

void add_others(bool quick, std::vector<Method>& all) {
  const auto iterations = [](double step_s, int n) { return steps_text(step_s, std::to_string(n) + " iterations"); };
  for (const auto& [step_s, n] :
       quick ? Drivers{{5e-4, 1}} : Drivers{{1.0 / 60, 30}, {4e-3, 4}, {1e-3, 4}, {1e-3, 1}, {5e-4, 1}, {2.5e-4, 1}})
    all.push_back(on_tets("XPBD", iterations(step_s, n), step_s, false,
                          [n = n](const Mesh& m, const Material& t, const Settings& s) { return xpbd(m, t, s, n); }));
  for (const auto& [step_s, n] :
       quick ? Drivers{{1.0 / 60, 100}} : Drivers{{1.0 / 30, 200}, {1.0 / 60, 100}, {4e-3, 30}, {1e-3, 10}}) {
    const auto make = [n = n](const Mesh& m, const Material& t, const Settings& s) { return corotational(m, t, s, n); };
    all.push_back(on_tets("implicit corotational", iterations(step_s, n), step_s, false, make));
    if (n == 100) all.push_back(by_hand(all.back(), step_s, make));
  }
  all.push_back(on_tets("plain tetrahedra", "explicit", kStep, false, plain_tetrahedra));
  all.push_back(by_hand(all.back(), kStep, plain_tetrahedra));
  all.push_back(on_tets("paper C's springs", "explicit", kStep, false, papers_springs));
}

}  // namespace

std::vector<Method> methods(bool quick) {
  std::vector<Method> all;
  add_ours(quick, all);
  add_others(quick, all);
  return all;
}

}  // namespace sectio::chart
