#include "sim_server/surface/surface_engines.h"

#include <numeric>

#include "sim_server/collision/surface_tree.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/surface/cutting/surface_cutting.h"
#include "sim_server/surface/cutting/template_cutting.h"

namespace sectio {
namespace {

SurfaceSpringMaterial spring_material(const MaterialSpec& m) {
  SurfaceSpringMaterial s{m};
  s.skin_thickness_m = m.skin_thickness_m;
  s.foundation_radius_m = m.foundation_radius_m;
  s.pretension = m.pretension;
  s.damping_per_s = m.damping_per_s;
  return s;
}

SurfaceSpringSettings spring_settings(const BodySpec& spec, const Scene& scene) {
  SurfaceSpringSettings s;
  s.step_s = scene.step_s;
  s.gravity_m_per_s2 = scene.gravity_m_per_s2;
  if (spec.fixed) s.fixed = [box = *spec.fixed](const Vec3& x) { return box.contains(x); };
  if (vary_in_stiffness(spec.regions))
    s.stiffness_factor = [regions = spec.regions](const Vec3& rest_m) { return stiffness_factor_at(regions, rest_m); };
  return s;
}

std::unique_ptr<CuttingEngine> cutting_in_style(const CuttingSpec& cutting) {
  if (cutting.style == "templates") {
    TemplateSettings s;
    s.open_top_m = cutting.open_top_m;
    s.open_bottom_m = cutting.open_bottom_m;
    s.join_tolerance_m = cutting.join_tolerance_m;
    return std::make_unique<TemplateCutting>(s);
  }
  StrokeSettings s;
  s.join_tolerance_m = cutting.join_tolerance_m;
  s.min_depth_m = cutting.groove_min_depth_m;
  return std::make_unique<SurfaceCutting>(s, cutting.loops_free_islands);
}

std::unique_ptr<SurfaceSprings> springs_of(const EngineSite& site, const SurfaceSprings* whole) {
  const TriangleMesh& mesh = site.body.mesh;
  SurfaceSpringSettings settings = spring_settings(site.spec, site.scene);
  if (whole) settings.given_gravity_m_per_s2 = whole->given_gravity_m_per_s2();
  auto springs =
      std::make_unique<SurfaceSprings>(mesh, site.frame_world, spring_material(site.spec.material), settings);
  std::vector<VertexId> all(mesh.vertex_slots());
  std::iota(all.begin(), all.end(), VertexId{0});
  if (site.is_part) springs->update(mesh, all);  // the rest of a cut body may need mass to be stable
  springs->set_component(0, all, false);         // a part that nothing holds falls
  if (site.scene.floor_z_m) springs->set_bed(0, Vec3(0, 0, *site.scene.floor_z_m), Vec3::UnitZ());
  return springs;
}

// `whole`: the springs of the body that a part comes off.
BodyEngines engines_of(const EngineSite& site, const SurfaceSprings* whole) {
  BodyEngines engines;
  engines.collision =
      std::make_unique<SurfaceTree>(SurfaceView{site.body.mesh, site.body.positions_world_m(), site.body.id});
  engines.cutting = cutting_in_style(site.spec.cutting);
  engines.splitting = std::make_unique<SurfaceSplitting>();
  if (site.is_rigid) return engines;
  auto springs = springs_of(site, whole);
  engines.make_part = [of_parts = springs.get()](const EngineSite& s) { return engines_of(s, of_parts); };
  engines.deformation = std::move(springs);
  return engines;
}

}  // namespace

BodyEngines surface_spring_engines(const EngineSite& site) {
  return site.parent && !site.is_rigid ? site.parent->make_part(site) : engines_of(site, nullptr);
}

}  // namespace sectio
