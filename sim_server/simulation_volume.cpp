#include "sim_server/simulation_volume.h"

#include <cmath>
#include <cstdio>
#include <numeric>

#include "common/core/error.h"
#include "common/material/region_volumes.h"
#include "common/mesh/check.h"
#include "sim_server/collision/surface_tree.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/deformation/tetra/volume_deformation.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/simulation_volume_split.h"

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

VolumeCutting::IsFixed fixed_places(const EngineSite& site) {
  if (!site.spec.fixed) return {};
  return [fixed = *site.spec.fixed, frame = site.frame_world](const Vec3& home) {
    return fixed.contains(frame.to_world(home));
  };
}

VolumeSettings settings_for(const EngineSite& site, const TetMesh& mesh) {
  VolumeSettings settings;
  settings.step_s = site.scene.step_s;
  settings.gravity_m_per_s2 = site.scene.gravity_m_per_s2;
  settings.least_part_s = site.spec.volume.least_part_s;
  if (const auto is_fixed = fixed_places(site))
    for (const Vec3& home : mesh.vertices_body_m) settings.fixed.push_back(is_fixed(home));
  return settings;
}

const VolumeCutting& cutting_of(const BodyEngines& engines) {
  return dynamic_cast<const VolumeCutting&>(*engines.cutting);
}
const VolumeModel& model_of(const BodyEngines& engines) {
  return dynamic_cast<const VolumeDeformation&>(*engines.deformation).model();
}

// Its inside does not count any more.
bool is_rigid_part(const EngineSite& site) {
  return site.is_part && !site.spec.fixed && site.spec.splitting.free_parts == FreeParts::rigid;
}

// The volume of a body, or of a part with its state.
VolumePart volume_of(const EngineSite& site) {
  if (site.parent) return cutting_of(*site.parent).part(site.vertex_from);
  VolumePart whole{site.spec.tets, std::vector<VertexId>(site.body.mesh.vertex_slots()), {}, {}};
  std::iota(whole.vertex_of.begin(), whole.vertex_of.end(), VertexId{0});  // see with_volumes()
  return whole;
}

BodyEngines engines_of(const EngineSite& site, VolumePart volume, std::unique_ptr<VolumeModel> model) {
  BodyEngines engines;
  engines.collision =
      std::make_unique<SurfaceTree>(SurfaceView{site.body.mesh, site.body.positions_world_m(), site.body.id});
  std::optional<VolumeFloor> floor;
  if (site.scene.floor_z_m) floor = VolumeFloor{*site.scene.floor_z_m, site.spec.volume.floor_kept_velocity};
  auto engine = std::make_unique<VolumeDeformation>(std::move(model), volume.vertex_of, site.frame_world, floor);
  if (site.parent) engine->set_state(std::move(volume.position_world_m), std::move(volume.velocity_m_per_s));
  TetCutSettings settings;
  settings.semi_progressive = site.spec.cutting.style == "semi_progressive";
  settings.snap = site.spec.cutting.snap_ratio;
  settings.collapse_ratio = site.spec.volume.collapse_ratio;
  auto cutting = std::make_unique<VolumeCutting>(volume.mesh, volume.vertex_of, settings, *engine, fixed_places(site),
                                                 site.is_part);
  engines.splitting = std::make_unique<VolumeSplitting>(*cutting);
  engines.cutting = std::move(cutting);
  engines.deformation = std::move(engine);
  return engines;
}

// The same volume with these vertices as the first ones, then the others in their order.
TetMesh with_first(const TetMesh& mesh, std::span<const VertexId> first) {
  TetMesh out;
  std::vector<VertexId> number(mesh.vertices_body_m.size(), kNone);
  const auto take = [&](VertexId v) {
    if (number[v] != kNone) return;
    number[v] = static_cast<VertexId>(out.vertices_body_m.size());
    out.vertices_body_m.push_back(mesh.vertices_body_m[v]);
  };
  for (const VertexId v : first) take(v);
  for (VertexId v = 0; v < number.size(); ++v) take(v);
  for (const Tetrahedron& t : mesh.tetrahedra)
    out.tetrahedra.push_back({number[t[0]], number[t[1]], number[t[2]], number[t[3]]});
  return out;
}

constexpr double kCrumb = 0.5;   // of a mean tetrahedron: what comes off and is smaller is removed
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
  if (body.cutting.style == "templates")
    throw InputError("cutting: templates cut a surface; a volume is cut progressive or semi_progressive");
  FilledVolume volume = filled(body);
  const TetSurface surface = surface_of(volume.mesh);
  body.tets = with_first(volume.mesh, surface.of_volume);
  body.mesh = surface.soup;
  const double element_m3 = check(body.tets).volume_m3 / static_cast<double>(body.tets.tetrahedra.size());
  body.splitting.least_volume_m3 = std::max(body.splitting.least_volume_m3, kCrumb * element_m3);
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

// The tensile test corrects the tissue, whatever regions are in it. A part's springs are what they were in the whole.
BodyEngines tetra_spring_engines(const EngineSite& site) {
  if (is_rigid_part(site)) return surface_spring_engines(site);
  VolumePart volume = volume_of(site);
  const VolumeMaterial material = volume_material(site.spec.material);
  const VolumeSettings settings = settings_for(site, volume.mesh);
  TetSpringOptions options{site.spec.volume.second_share, site.spec.volume.damper_s, true};
  if (site.parent) {
    options = dynamic_cast<const TetSprings&>(model_of(*site.parent)).options();
  } else if (vary_in_stiffness(site.spec.regions)) {
    options = TetSprings(volume.mesh, material, settings, options).options();
  }
  options.calibrate = options.correction == 1;
  auto model = std::make_unique<TetSprings>(volume.mesh, volume_material(material, site.spec.regions, volume.mesh),
                                            settings, options);
  return engines_of(site, std::move(volume), std::move(model));
}

BodyEngines neo_hookean_engines(const EngineSite& site) {
  if (is_rigid_part(site)) return surface_spring_engines(site);
  VolumePart volume = volume_of(site);
  auto model = std::make_unique<TetSolid>(
      volume.mesh, volume_material(volume_material(site.spec.material), site.spec.regions, volume.mesh),
      settings_for(site, volume.mesh), driver_of(site.spec));
  return engines_of(site, std::move(volume), std::move(model));
}

BodyEngines neo_hookean_lattice_engines(const EngineSite& site) {
  if (is_rigid_part(site)) return surface_spring_engines(site);
  VolumePart volume = volume_of(site);
  const auto* whole = site.parent ? &dynamic_cast<const HexSolid&>(model_of(*site.parent)) : nullptr;
  const Grid grid = whole ? whole->lattice().grid : grid_around(site.spec.tets, site.spec.volume.cell_m);
  auto model = std::make_unique<HexSolid>(
      volume.mesh, grid, volume_material(volume_material(site.spec.material), site.spec.regions, volume.mesh),
      settings_for(site, volume.mesh), driver_of(site.spec), whole);
  return engines_of(site, std::move(volume), std::move(model));
}

}  // namespace sectio
