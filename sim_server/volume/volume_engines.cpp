#include "sim_server/volume/volume_engines.h"

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
#include "sim_server/surface/surface_engines.h"
#include "sim_server/volume/volume_material.h"
#include "sim_server/volume/volume_splitting.h"

namespace sectio {
namespace {

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
  settings.least_substep_s = site.spec.volume.least_part_s;
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
  std::iota(whole.vertex_of.begin(), whole.vertex_of.end(), VertexId{0});  // see fill_volumes()
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

constexpr double kCells = 2000;  // in a body whose scene doesn't say how large they are

std::string note_on(const HexSolid& solid) {
  char text[240];
  std::snprintf(text, sizeof text,
                "hexahedra: %zu of %.2g mm, %zu nodes, stable step %.3g ms at rest, which no cut makes shorter",
                solid.lattice().cells.size(), 1e3 * solid.lattice().grid.cell_m, solid.lattice().nodes.size(),
                1e3 * solid.explicit_limit_s());
  return text;
}

}  // namespace

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
      settings_for(site, volume.mesh), integrator_of(site.spec));
  return engines_of(site, std::move(volume), std::move(model));
}

BodyEngines neo_hookean_lattice_engines(const EngineSite& site) {
  if (is_rigid_part(site)) return surface_spring_engines(site);
  VolumePart volume = volume_of(site);
  const auto* whole = site.parent ? &dynamic_cast<const HexSolid&>(model_of(*site.parent)) : nullptr;
  const Grid grid = whole ? whole->lattice().grid : grid_around(site.spec.tets, site.spec.volume.cell_m);
  auto model = std::make_unique<HexSolid>(
      volume.mesh, grid, volume_material(volume_material(site.spec.material), site.spec.regions, volume.mesh),
      settings_for(site, volume.mesh), integrator_of(site.spec), whole);
  return engines_of(site, std::move(volume), std::move(model));
}

void prepare_lattice(BodySpec& body) {
  if (body.volume.cell_m == 0) body.volume.cell_m = std::cbrt(check(body.tets).volume_m3 / kCells);
  body.mesh_notes.push_back(note_on(HexSolid(body.tets, grid_around(body.tets, body.volume.cell_m),
                                             volume_material(body.material), {}, integrator_of(body))));
}

void prepare_tetra_springs(BodySpec& body) {
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

}  // namespace sectio
