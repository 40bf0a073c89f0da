#include "sim_server/simulation_volume.h"

#include <cstdio>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/collision/surface_tree.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/deformation/tetra/volume_engine.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/tet_file.h"

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

// The surface's vertices first.
TetMesh renumbered(const TetMesh& mesh, std::span<const VertexId> first) {
  std::vector<VertexId> new_id(mesh.vertices_body_m.size(), kNone);
  TetMesh out;
  const auto take = [&](VertexId v) {
    if (new_id[v] != kNone) return;
    new_id[v] = static_cast<VertexId>(out.vertices_body_m.size());
    out.vertices_body_m.push_back(mesh.vertices_body_m[v]);
  };
  for (const VertexId v : first) take(v);
  for (VertexId v = 0; v < new_id.size(); ++v) take(v);
  for (const Tetrahedron& t : mesh.tetrahedra)
    out.tetrahedra.push_back({new_id[t[0]], new_id[t[1]], new_id[t[2]], new_id[t[3]]});
  return out;
}

VolumeMaterial volume_material(const MaterialSpec& m) {
  return {m.young_pa, m.poisson, m.density_kg_per_m3, m.damping_per_s, {}};
}

VolumeSettings volume_settings(const EngineSite& site) {
  VolumeSettings settings;
  settings.step_s = site.scene.step_s;
  settings.gravity_m_per_s2 = site.scene.gravity_m_per_s2;
  settings.least_part_s = site.spec.volume.least_part_s;
  if (!site.spec.fixed) return settings;
  for (const Vec3& home : site.spec.tets.vertices_body_m) {
    const Vec3 x = site.frame_world.to_world(home);
    settings.fixed.push_back((x.array() >= site.spec.fixed->min_world_m.array()).all() &&
                             (x.array() <= site.spec.fixed->max_world_m.array()).all());
  }
  return settings;
}

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

BodyEngines engines_of(const EngineSite& site, std::unique_ptr<VolumeModel> model) {
  BodyEngines engines;
  engines.collision =
      std::make_unique<SurfaceTree>(SurfaceView{site.body.mesh, site.body.positions_world_m(), site.body.id});
  engines.cutting = std::make_unique<NoCutting>();
  engines.splitting = std::make_unique<PartSearcher>();
  std::optional<VolumeFloor> floor;
  if (site.scene.floor_z_m) floor = VolumeFloor{*site.scene.floor_z_m, site.spec.volume.floor_kept_velocity};
  engines.deformation = std::make_unique<VolumeEngine>(std::move(model), site.spec.tets, site.body.mesh.vertex_slots(),
                                                       site.frame_world, floor);
  return engines;
}

void make_volume(BodySpec& body) {
  if (body.contact.style == "templates")
    throw InputError("contact: templates subdivide a surface; that of a volume stays as it is");
  FilledVolume volume = filled(body);
  const TetSurface surface = surface_of(volume.mesh);
  body.tets = renumbered(volume.mesh, surface.of_volume);
  body.mesh = surface.soup;
  // Its own surface can't be opened by the engines that cut surfaces.
  body.cutting.threshold_displacement_m.reset();
  body.cutting.threshold_force_n = 1e9;
  body.mesh_notes.insert(body.mesh_notes.end(), volume.notes.begin(), volume.notes.end());
  for (const FillReport& report : volume.compared) body.mesh_notes.push_back(to_string(report));
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
    if (body.model != "tetra_springs" && body.model != "neo_hookean") continue;
    try {
      make_volume(body);
    } catch (const InputError& error) {
      throw InputError(scene.file + ": body '" + body.name + "': " + error.what());
    }
  }
  return scene;
}

BodyEngines tetra_spring_engines(const EngineSite& site) {
  const TetSpringOptions options{site.spec.volume.second_share, site.spec.volume.damper_s, true};
  return engines_of(site, std::make_unique<TetSprings>(site.spec.tets, volume_material(site.spec.material),
                                                       volume_settings(site), options));
}

BodyEngines neo_hookean_engines(const EngineSite& site) {
  const TetDriver driver = site.spec.volume.driver == "implicit" ? TetDriver::implicit_only : TetDriver::automatic;
  return engines_of(site, std::make_unique<TetSolid>(site.spec.tets, volume_material(site.spec.material),
                                                     volume_settings(site), driver));
}

}  // namespace sectio
