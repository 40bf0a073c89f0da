#include "sim_server/simulation_volume.h"

#include <cmath>
#include <cstdio>

#include "common/core/error.h"
#include "common/material/region_volumes.h"
#include "common/mesh/check.h"
#include "sim_server/collision/surface_tree.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/deformation/tetra/volume_engine.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/simulation_volume_cut.h"

namespace sectio {
namespace {

ElasticConstants elastic_constants(const MaterialSpec& m) {
  return {m.young_pa, m.poisson, m.density_kg_per_m3};
}

FilledVolume filled(const BodySpec& body) {
  if (body.volume.file.empty()) {
    FillSettings settings;
    settings.mesher = body.volume.mesher == "tetgen" ? Mesher::tetgen
                      : body.volume.mesher == "best" ? Mesher::best
                                                     : Mesher::lattice;
    settings.tetrahedra = body.volume.tetrahedra;
    settings.material = elastic_constants(body.material);
    return fill(body.mesh, settings);
  }
  TetFile file = read_tet_file(body.volume.file, body.volume.file_unit_m);
  FilledVolume volume;
  volume.mesh = std::move(file.mesh);
  volume.notes = std::move(file.notes);
  volume.report = report_on(volume.mesh, "file", check(volume.mesh).volume_m3, elastic_constants(body.material));
  volume.compared = {volume.report};
  return volume;
}

VolumeMaterial volume_material(const MaterialSpec& m) {
  return {m.young_pa, m.poisson, m.density_kg_per_m3, m.damping_per_s, {}};
}

// With the stiffness of the region in the middle of each tetrahedron.
VolumeMaterial volume_material(VolumeMaterial whole, const Regions& regions, const TetMesh& mesh) {
  if (!vary_in_stiffness(regions)) return whole;
  for (const std::uint32_t region : regions_of(regions, mesh))
    whole.stiffness_factor.push_back(region == kNoRegion ? 1 : regions[region].stiffness_factor);
  return whole;
}

// The settings of a model for a mesh, which a cut changes.
std::function<VolumeSettings(const TetMesh&)> settings_for(const EngineSite& site) {
  VolumeSettings settings;
  settings.step_s = site.scene.step_s;
  settings.gravity_m_per_s2 = site.scene.gravity_m_per_s2;
  settings.least_part_s = site.spec.volume.least_part_s;
  return [settings, fixed = site.spec.fixed, frame = site.frame_world](const TetMesh& mesh) {
    VolumeSettings of_mesh = settings;
    if (!fixed) return of_mesh;
    for (const Vec3& home : mesh.vertices_body_m) {
      const Vec3 x = frame.to_world(home);
      of_mesh.fixed.push_back((x.array() >= fixed->min_world_m.array()).all() &&
                              (x.array() <= fixed->max_world_m.array()).all());
    }
    return of_mesh;
  };
}

constexpr const char* kSemiProgressive = "semi_progressive";

// Refuses every cut.
class NoCutting final : public CuttingEngine {
 public:
  const StrokeSettings& settings() const override { return settings_; }
  CutPlan plan(const SharedBody&, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion>) override {
    CutPlan plan(cuts);
    for (const Entry& entry : entries)
      plan.outcomes.push_back({entry.tool_id, StrokeEnd::refused, "a body whose inside deforms can't be cut"});
    plan.refused = static_cast<std::uint32_t>(entries.size());
    return plan;
  }
  void follow(const SharedBody&, const TopologyChange&) override {}

 private:
  StrokeSettings settings_;
};

BodyEngines engines_of(const EngineSite& site, VolumeCutting::MakeModel make_model) {
  BodyEngines engines;
  engines.collision =
      std::make_unique<SurfaceTree>(SurfaceView{site.body.mesh, site.body.positions_world_m(), site.body.id});
  engines.splitting = std::make_unique<PartSearcher>();
  std::optional<VolumeFloor> floor;
  if (site.scene.floor_z_m) floor = VolumeFloor{*site.scene.floor_z_m, site.spec.volume.floor_kept_velocity};
  auto volume = std::make_unique<VolumeEngine>(make_model(site.spec.tets), site.spec.tets,
                                               site.body.mesh.vertex_slots(), site.frame_world, floor);
  if (site.spec.cutting.style == kSemiProgressive) {
    StrokeSettings strokes;
    strokes.join_tolerance_m = site.spec.cutting.join_tolerance_m;
    engines.cutting = std::make_unique<VolumeCutting>(site.spec.tets, strokes, *volume, std::move(make_model));
  } else {
    engines.cutting = std::make_unique<NoCutting>();
  }
  engines.deformation = std::move(volume);
  return engines;
}

constexpr double kCells = 2000;  // in a body whose scene doesn't say how large they are

TetDriver driver_of(const BodySpec& body) {
  return body.volume.driver == "implicit" ? TetDriver::implicit_only : TetDriver::automatic;
}

std::string note_on(const HexSolid& solid) {
  char text[240];
  std::snprintf(text, sizeof text,
                "hexahedra: %zu of %.2g mm, %zu nodes, stable step %.3g ms at rest, which no cut makes shorter",
                solid.lattice().cells.size(), 1e3 * solid.lattice().grid.cell_m, solid.lattice().nodes.size(),
                1e3 * solid.explicit_limit_s());
  return text;
}

void make_volume(BodySpec& body) {
  if (body.contact.style == "templates")
    throw InputError("contact: templates subdivide a surface; that of a volume stays as it is");
  if (body.splitting.free_parts != FreeParts::keep)
    throw InputError("splitting: the parts of a volume stay in it: free_parts: keep");
  FilledVolume volume = filled(body);
  const TetSurface surface = surface_of(volume.mesh);
  body.tets = renumbered(volume.mesh, surface.of_volume).mesh;
  body.mesh = surface.soup;
  if (body.cutting.style != kSemiProgressive) {  // the engines that cut surfaces can't open that of a volume
    body.cutting.threshold_displacement_m.reset();
    body.cutting.threshold_force_n = 1e9;
  }
  body.mesh_notes.insert(body.mesh_notes.end(), volume.notes.begin(), volume.notes.end());
  for (const FillReport& report : volume.compared) body.mesh_notes.push_back(to_string(report));
  if (body.model == "neo_hookean_lattice") {
    if (body.volume.cell_m == 0) body.volume.cell_m = std::cbrt(check(body.tets).volume_m3 / kCells);
    body.mesh_notes.push_back(note_on(HexSolid(body.tets, grid_around(body.tets, body.volume.cell_m),
                                               volume_material(body.material), {}, driver_of(body))));
  }
  if (body.model != "tetra_springs") return;
  const TetSprings springs(body.tets, volume_material(body.material), {}, {body.volume.second_share, 0, true});
  char text[240];
  std::snprintf(
      text, sizeof text,
      "springs: Young's modulus %.0f Pa before a correction to %.0f Pa; Poisson's ratio %.2f instead of %.2f: a "
      "net of springs has at most 0.25",
      springs.as_made().mean_young_pa, springs.calibrated().mean_young_pa, springs.calibrated().mean_poisson,
      body.material.poisson);
  body.mesh_notes.emplace_back(text);
}

}  // namespace

Scene with_volumes(Scene scene) {
  for (BodySpec& body : scene.bodies) {
    if (body.model == "surface_springs" || !standard_engines().models.contains(body.model)) continue;
    try {
      make_volume(body);
    } catch (const InputError& error) {
      throw InputError(scene.file + ": body '" + body.name + "': " + error.what());
    }
  }
  return scene;
}

// The tensile test corrects the tissue, whatever regions are in it. After a cut the springs are made by the same
// formula; the correction stays what it was for the whole body.
BodyEngines tetra_spring_engines(const EngineSite& site) {
  const VolumeMaterial material = volume_material(site.spec.material);
  const TetSpringOptions options{site.spec.volume.second_share, site.spec.volume.damper_s, true};
  const auto settings = settings_for(site);
  const Regions regions = site.spec.regions;
  std::optional<double> correction;
  return engines_of(site, [=](const TetMesh& mesh) mutable -> std::unique_ptr<VolumeModel> {
    if (!correction) {
      auto whole = std::make_unique<TetSprings>(mesh, material, settings(mesh), options);
      correction = material.young_pa / whole->as_made().mean_young_pa;
      if (!vary_in_stiffness(regions)) return whole;
    }
    VolumeMaterial corrected = volume_material(material, regions, mesh);
    corrected.young_pa *= *correction;
    return std::make_unique<TetSprings>(mesh, corrected, settings(mesh),
                                        TetSpringOptions{options.second_share, options.damper_s, false});
  });
}

BodyEngines neo_hookean_engines(const EngineSite& site) {
  const TetDriver driver = driver_of(site.spec);
  return engines_of(site,
                    [=, material = volume_material(site.spec.material), regions = site.spec.regions,
                     settings = settings_for(site)](const TetMesh& mesh) -> std::unique_ptr<VolumeModel> {
                      return std::make_unique<TetSolid>(mesh, volume_material(material, regions, mesh), settings(mesh),
                                                        driver);
                    });
}

BodyEngines neo_hookean_lattice_engines(const EngineSite& site) {
  const TetDriver driver = driver_of(site.spec);
  const Grid grid = grid_around(site.spec.tets, site.spec.volume.cell_m);
  return engines_of(site,
                    [=, material = volume_material(site.spec.material), regions = site.spec.regions,
                     settings = settings_for(site)](const TetMesh& mesh) -> std::unique_ptr<VolumeModel> {
                      return std::make_unique<HexSolid>(mesh, grid, volume_material(material, regions, mesh),
                                                        settings(mesh), driver);
                    });
}

}  // namespace sectio
