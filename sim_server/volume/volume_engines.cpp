#include "sim_server/volume/volume_engines.h"

#include <cmath>
#include <numeric>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/material/region_volumes.h"
#include "common/mesh/check.h"
#include "sim_server/collision/surface_tree.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/deformation/tetra/volume_deformation.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/volume/volume_cutting.h"
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

Volume::IsFixed fixed_places(const EngineSite& site) {
  if (!site.spec.fixed) return {};
  return [fixed = *site.spec.fixed, frame = site.frame_world](const Vec3& home) {
    return fixed.contains(frame.to_world(home));
  };
}

// `whole`: the model of the body that a part comes off. Vertices of the part weigh at least as much as they did.
VolumeSettings settings_for(const EngineSite& site, const TetMesh& mesh, const VolumeModel* whole = nullptr) {
  VolumeSettings settings;
  settings.step_s = site.scene.step_s;
  settings.gravity_m_per_s2 = site.scene.gravity_m_per_s2;
  settings.least_substep_s = whole ? settings.step_s / whole->size().parts : site.spec.volume.least_part_s;
  if (const auto is_fixed = fixed_places(site))
    for (const Vec3& home : mesh.vertices_body_m) settings.fixed.push_back(is_fixed(home));
  return settings;
}

VolumePart whole_volume(const EngineSite& site) {
  VolumePart whole{site.spec.tets, std::vector<VertexId>(site.body.mesh.vertex_slots()), {}};
  std::iota(whole.vertex_of.begin(), whole.vertex_of.end(), VertexId{0});  // see fill_volumes()
  return whole;
}

FrontSettings front_settings(const BodySpec& spec) {
  FrontSettings settings;
  settings.tets.semi_progressive = spec.cutting.style == "semi_progressive";
  settings.tets.snap = spec.cutting.snap_ratio;
  settings.tets.collapse_ratio = spec.volume.collapse_ratio;
  return settings;
}

// A part whose state is about to be read has a volume of its own instead of a parent.
bool comes_off(const EngineSite& site) {
  return site.is_rigid || site.parent;
}

// The surface of a rigid part is enough.
BodyEngines part_engines(const EngineSite& site) {
  return site.is_rigid ? surface_spring_engines(site) : site.parent->make_part(site);
}

using MakePartEngines = std::function<BodyEngines(const EngineSite& site, VolumePart part)>;

// The engines around a model, which share the volume; so do the parts that come off, each of which copies its own.
BodyEngines engines_around(std::unique_ptr<VolumeModel> model, VolumePart part, const EngineSite& site,
                           MakePartEngines make_part) {
  BodyEngines engines;
  std::optional<VolumeFloor> floor;
  if (site.scene.floor_z_m) floor = VolumeFloor{*site.scene.floor_z_m, site.spec.volume.floor_kept_velocity};
  ParticleState& particles = site.body.particles;
  auto deformation =
      std::make_unique<VolumeDeformation>(std::move(model), part.vertex_of, site.frame_world, floor, particles);
  for (std::size_t v = 0; v < part.vertex_from.size(); ++v) {
    particles.position_world_m[v] = site.parent_particles->position_world_m[part.vertex_from[v]];
    particles.velocity_world_m_per_s[v] = site.parent_particles->velocity_world_m_per_s[part.vertex_from[v]];
  }
  engines.collision =
      std::make_unique<SurfaceTree>(SurfaceView{site.body.mesh, site.body.positions_world_m(), site.body.id});
  const auto volume = std::make_shared<Volume>(part.mesh, std::move(part.vertex_of), *deformation, fixed_places(site));
  engines.splitting = std::make_unique<VolumeSplitting>(volume);
  engines.cutting = std::make_unique<VolumeCutting>(volume, front_settings(site.spec), site.is_part);
  engines.deformation = std::move(deformation);
  engines.make_part = [volume, make_part = std::move(make_part)](const EngineSite& part_site) {
    return make_part(part_site, volume->part(part_site.vertex_from));
  };
  return engines;
}

constexpr double kCells = 2000;  // in a body whose scene doesn't say how large they are

// Presses meet the surface of the tetrahedra, which the cells carry: a coarse one gives another force at each place.
constexpr double kFewTets = 4, kEnoughTets = 6;  // a cell's volume

std::string note_on(const HexSolid& solid, std::size_t tetrahedra, double volume_m3) {
  const double cells = volume_m3 / std::pow(solid.lattice().grid.cell_m, 3);
  std::string note =
      formatted("hexahedra: %zu of %.2g mm, %zu nodes, stable step %.3g ms at rest, which no cut makes shorter",
                solid.lattice().cells.size(), 1e3 * solid.lattice().grid.cell_m, solid.lattice().nodes.size(),
                1e3 * solid.explicit_limit_s());
  if (static_cast<double>(tetrahedra) < kFewTets * cells)
    note += formatted("; a press feels where its %zu tetrahedra meet, which are coarse for these: %.0f are fine",
                      tetrahedra, kEnoughTets * cells);
  return note;
}

BodyEngines spring_engines(const EngineSite& site, VolumePart part, TetSpringOptions options,
                           const VolumeModel* whole) {
  options.calibrate = options.correction == 1;
  auto model = std::make_unique<TetSprings>(
      part.mesh, volume_material(volume_material(site.spec.material), site.spec.regions, part.mesh),
      settings_for(site, part.mesh, whole), options);
  const TetSprings* of_parts = model.get();
  return engines_around(std::move(model), std::move(part), site, [of_parts](const EngineSite& s, VolumePart p) {
    return spring_engines(s, std::move(p), of_parts->options(), of_parts);
  });
}

BodyEngines solid_engines(const EngineSite& site, VolumePart part, const VolumeModel* whole) {
  auto model = std::make_unique<TetSolid>(
      part.mesh, volume_material(volume_material(site.spec.material), site.spec.regions, part.mesh),
      settings_for(site, part.mesh, whole), integrator_of(site.spec));
  const TetSolid* of_parts = model.get();
  return engines_around(std::move(model), std::move(part), site, [of_parts](const EngineSite& s, VolumePart p) {
    return solid_engines(s, std::move(p), of_parts);
  });
}

BodyEngines lattice_engines(const EngineSite& site, VolumePart part, const HexSolid* whole) {
  const Grid grid = whole ? whole->lattice().grid : grid_around(site.spec.tets, site.spec.volume.cell_m);
  auto model = std::make_unique<HexSolid>(
      part.mesh, grid, volume_material(volume_material(site.spec.material), site.spec.regions, part.mesh),
      settings_for(site, part.mesh), integrator_of(site.spec), whole);
  const HexSolid* of_parts = model.get();
  return engines_around(std::move(model), std::move(part), site, [of_parts](const EngineSite& s, VolumePart p) {
    return lattice_engines(s, std::move(p), of_parts);
  });
}

}  // namespace

// The tensile test corrects the tissue, whatever regions are in it. The springs of a part are what they were in the
// whole.
BodyEngines tetra_spring_engines(const EngineSite& site) {
  if (comes_off(site)) return part_engines(site);
  VolumePart whole = whole_volume(site);
  TetSpringOptions options{site.spec.volume.second_share, site.spec.volume.damper_s, true};
  if (vary_in_stiffness(site.spec.regions))
    options =
        TetSprings(whole.mesh, volume_material(site.spec.material), settings_for(site, whole.mesh), options).options();
  return spring_engines(site, std::move(whole), options, nullptr);
}

BodyEngines neo_hookean_engines(const EngineSite& site) {
  return comes_off(site) ? part_engines(site) : solid_engines(site, whole_volume(site), nullptr);
}

BodyEngines neo_hookean_lattice_engines(const EngineSite& site) {
  return comes_off(site) ? part_engines(site) : lattice_engines(site, whole_volume(site), nullptr);
}

void prepare_lattice(BodySpec& body) {
  const double volume_m3 = check(body.tets).volume_m3;
  if (body.volume.cell_m == 0) body.volume.cell_m = std::cbrt(volume_m3 / kCells);
  const HexSolid solid(body.tets, grid_around(body.tets, body.volume.cell_m), volume_material(body.material), {},
                       integrator_of(body));
  body.mesh_notes.push_back(note_on(solid, body.tets.tetrahedra.size(), volume_m3));
}

void prepare_tetra_springs(BodySpec& body) {
  const TetSprings springs(body.tets, volume_material(body.material), {}, {body.volume.second_share, 0, true});
  body.mesh_notes.push_back(formatted(
      "springs: Young's modulus %.0f Pa before a correction to %.0f Pa; Poisson's ratio %.2f instead of %.2f: a "
      "net of springs has at most 0.25",
      springs.as_made().mean_young_pa, springs.calibrated().mean_young_pa, springs.calibrated().mean_poisson,
      body.material.poisson));
}

}  // namespace sectio
