#include "sim_server/simulation_body.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <set>

#include "common/core/error.h"
#include "sim_server/bodies/touched_vertices.h"

namespace sectio {
namespace {

SurfaceSpringMaterial spring_material(const MaterialSpec& m) {
  SurfaceSpringMaterial s;
  s.young_pa = m.young_pa;
  s.poisson = m.poisson;
  s.density_kg_per_m3 = m.density_kg_per_m3;
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
  if (spec.fixed)
    s.fixed = [box = *spec.fixed](const Vec3& x) {
      return (x.array() >= box.min_world_m.array()).all() && (x.array() <= box.max_world_m.array()).all();
    };
  return s;
}

StrokeSettings stroke_settings_of(const CuttingSpec& cutting) {
  StrokeSettings s;
  s.style = cutting.style == "templates" ? CutStyle::templates : CutStyle::progressive;
  s.open_top_m = cutting.open_top_m;
  s.open_bottom_m = cutting.open_bottom_m;
  s.join_tolerance_m = cutting.join_tolerance_m;
  s.min_depth_m = cutting.groove_min_depth_m;
  return s;
}

constexpr double kThicknessUsed = 0.8;       // of the tissue under a groove, at most
constexpr double kSkipBelowSurfaceM = 1e-3;  // the groove's own lips are not the other side

}  // namespace

SimulationBody::SimulationBody(const BodySpec& body, const Scene& scene, std::uint32_t body_id)
    : spec(body),
      id(body_id),
      mesh(body.mesh),
      particles(particles_at_rest(mesh.rest_body_m(), body.pose)),
      springs(mesh, body.pose, spring_material(body.material), spring_settings(body, scene)),
      stroke_settings(stroke_settings_of(body.cutting)),
      tree_(SurfaceView{mesh, compact_.of(particles), body_id}) {
  const double largest_s = springs.largest_stable_step_s();
  if (scene.step_s > largest_s) {
    char text[256];
    std::snprintf(text, sizeof text,
                  "%s: step_s: %g s is beyond the stable step of body '%s'; the largest that would do is %.3g s",
                  scene.file.c_str(), scene.step_s, body.name.c_str(), std::floor(largest_s * 1e6) * 1e-6);
    throw InputError(text);
  }
}

SimulationBody::SimulationBody(const BodySpec& part, const Scene& scene, std::uint32_t body_id, TriangleMesh part_mesh,
                               ParticleState state, const Pose& frame)
    : spec(part),
      id(body_id),
      mesh(std::move(part_mesh)),
      particles(std::move(state)),
      springs(mesh, frame, spring_material(part.material), spring_settings(part, scene)),
      stroke_settings(stroke_settings_of(part.cutting)),
      tree_(SurfaceView{mesh, compact_.of(particles), body_id}) {
  std::vector<VertexId> all(mesh.vertex_slots());
  std::iota(all.begin(), all.end(), VertexId{0});
  springs.update(mesh, all);  // what a cut has left may need mass to be stable
  if (part.fixed) return;
  springs.set_component(0, all, false);
  if (scene.floor_z_m) springs.set_bed(0, Vec3(0, 0, *scene.floor_z_m), Vec3::UnitZ());
}

const SurfaceTree& SimulationBody::tree() {
  if (tree_stale_) tree_.update_moved(view());
  tree_stale_ = false;
  return tree_;
}

Vec3 SimulationBody::home_world_m(const std::array<VertexId, 3>& v, const Vec3& bary) const {
  Vec3 rest = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) rest += bary[static_cast<int>(i)] * mesh.rest_body_m(v[i]);
  return frame_world(v[0]).to_world(rest);
}

Vec3 SimulationBody::home_normal_world(const std::array<VertexId, 3>& v, const Vec3& bary) const {
  const MeshDraft reader(mesh, particle_view());
  Vec3 normal_body = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3 area = Vec3::Zero();
    for (const TriangleId t : reader.fan(v[i])) {
      const auto& c = mesh.triangle(t).v;
      const Vec3& a = mesh.rest_body_m(c[0]);
      area += (mesh.rest_body_m(c[1]) - a).cross(mesh.rest_body_m(c[2]) - a);
    }
    normal_body += bary[static_cast<int>(i)] * area.stableNormalized();
  }
  return frame_world(v[0]).orientation * normal_body.stableNormalized();
}

double SimulationBody::depth_limit_m(const Vec3& surface_world_m, const Vec3& tip_world_m) {
  const Vec3 down = tip_world_m - surface_world_m;
  const double depth_m = down.norm();
  if (depth_m <= kSkipBelowSurfaceM) return 1e9;
  const Vec3 from = surface_world_m + kSkipBelowSurfaceM / depth_m * down;
  const Vec3 to = surface_world_m + (1 / kThicknessUsed) * down;
  for (const SurfaceHit& hit : tree().hits(view(), from, to))
    if (!hit.entering && mesh.triangle(hit.triangle).surface == Surface::skin)
      return kThicknessUsed * (hit.point_world_m - surface_world_m).norm();
  return 1e9;
}

bool SimulationBody::accept_plan(const CutPlan& plan, std::vector<TriangleId>& changed) {
  changed.clear();
  std::vector<VertexId> touched = touched_vertices(plan.delta, mesh);
  if (!accept(plan, mesh, cuts)) return false;
  if (plan.delta.empty()) return true;

  particles.resize(mesh.vertex_slots());
  std::vector<VertexId> placed;
  for (const auto& [v, state] : plan.seeds) {
    particles.place(v, state.position_world_m, state.velocity_world_m_per_s);
    compact_.changed(particles, v);
    placed.push_back(v);
  }

  for (const TriangleEdit& e : plan.delta.triangles) changed.push_back(e.id);
  // A vertex that moved changes the springs and triangles around it, too.
  const MeshDraft after(mesh, particle_view());
  for (const VertexEdit& e : plan.delta.vertices) {
    if (!e.alive) continue;
    for (const TriangleId t : after.fan(e.id)) {
      changed.push_back(t);
      touched.insert(touched.end(), mesh.triangle(t).v.begin(), mesh.triangle(t).v.end());
    }
  }
  for (auto* list : {&touched, &changed}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  springs.update(mesh, touched);
  tree_.update_changed(view(), changed);
  tree_.update_moved(view(), placed);
  if (spec.splitting.free_parts == FreeParts::keep)
    free_islands(plan);
  else
    unsettled.insert(unsettled.end(), changed.begin(), changed.end());
  return true;
}

void SimulationBody::free_islands(const CutPlan& plan) {
  for (const Island& island : plan.islands) {
    std::set<VertexId> members{island.any_vertex};
    std::vector<VertexId> order{island.any_vertex};
    const MeshDraft reader(mesh, particle_view());
    for (std::size_t k = 0; k < order.size(); ++k)
      for (const TriangleId t : reader.fan(order[k]))
        for (const VertexId v : mesh.triangle(t).v)
          if (members.insert(v).second) order.push_back(v);
    std::sort(order.begin(), order.end());
    springs.set_component(components_, order, false);
    springs.set_bed(components_, island.bed_point_world_m, island.bed_normal_world);
    ++components_;
  }
}

Pose SimulationBody::frame_world(VertexId v) const {
  return rigid ? rigid->carried(frame_at_release_) : springs.frame_world(springs.component_of(v));
}

void SimulationBody::give_up(const TopologyDelta& delta) {
  const ApplyStatus status = apply(delta, mesh);
  SECTIO_ASSERT(status == ApplyStatus::applied, "a whole part can be removed");
  static_cast<void>(status);
  std::vector<VertexId> vertices;
  std::vector<TriangleId> triangles;
  for (const VertexEdit& e : delta.vertices) vertices.push_back(e.id);
  for (const TriangleEdit& e : delta.triangles) triangles.push_back(e.id);
  springs.update(mesh, vertices);
  tree_.update_changed(view(), triangles);
  const auto gone = [&](VertexId v) { return v != kNone && (v >= mesh.vertex_slots() || !mesh.vertex_alive(v)); };
  cuts.grooves.forget(vertices);
  std::erase_if(cuts.strokes, [&](const Stroke& s) {
    return gone(s.cell.apex) || gone(s.start) || gone(s.bottom) || gone(s.first) || gone(s.temporary_tip) ||
           std::ranges::any_of(s.cell.rim, gone) || std::ranges::any_of(s.touched, gone);
  });
}

bool SimulationBody::become_rigid() {
  std::vector<double> masses(mesh.vertex_slots());
  for (VertexId v = 0; v < masses.size(); ++v) masses[v] = springs.mass_kg(v);
  const Pose frame = frame_world(0);
  rigid = RigidPiece::release(mesh, particles.position_world_m, particles.velocity_world_m_per_s, masses,
                              spec.material.density_kg_per_m3);
  frame_at_release_ = frame;
  if (rigid) follow_rigid();
  return rigid.has_value();
}

void SimulationBody::follow_rigid() {
  rigid->place(particles.position_world_m, particles.velocity_world_m_per_s);
  compact_.invalidate();
  tree_stale_ = true;
}

void SimulationBody::deform(std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  if (frozen) return;
  springs.step(particles.position_world_m, particles.velocity_world_m_per_s, constraints, reactions);
  compact_.invalidate();
  tree_stale_ = true;
}

}  // namespace sectio
