#include "sim_server/world/body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/sort_unique.h"
#include "sim_server/bodies/touched_vertices.h"
#include "sim_server/deformation/shape_matching.h"
#include "sim_server/deformation/spring_star.h"

namespace sectio {
namespace {

constexpr double kThicknessUsed = 0.8;        // share of the tissue under a groove, at most
constexpr double kSkipBelowSurface_m = 1e-3;  // the groove's own lips are not the other side
constexpr double kPictureLines = 720;
constexpr int kLipSweeps = 10;
constexpr std::size_t kPatch = 40;  // vertices that tell how tissue has turned
constexpr double kTilts_rad = 0.2;  // so far the rim of a dent may turn them

std::string percent(double fraction) {
  return formatted("%.0f %%", 100 * fraction);
}

double pixel_rad(const Camera& camera) {
  return camera.field_of_view_deg * M_PI / 180 / kPictureLines;
}

// A vertex and those that hang together with it over the surface, the near ones first; they end with about `enough`.
template <class Mesh>
std::vector<VertexId> around(VertexId v, const Mesh& surface,
                             std::size_t enough = std::numeric_limits<std::size_t>::max()) {
  std::vector<VertexId> order{v};
  std::set<VertexId> members{v};
  for (std::size_t k = 0; k < order.size() && order.size() < enough; ++k)
    for (const TriangleId t : surface.fan(order[k]))
      for (const VertexId near : surface.triangle(t).v)
        if (members.insert(near).second) order.push_back(near);
  return order;
}

// How the surface about a vertex stands in the world, which has the frame's orientation at rest. The patch grows over
// the surface: it stays on its side of a cut.
Eigen::Quaterniond orientation_about(VertexId v, const MeshDraft& surface, const Pose& frame) {
  std::vector<MatchedPoint> points;
  for (const VertexId near : around(v, surface, kPatch))
    points.push_back({surface.rest(near), surface.position(near), 1});
  const Eigen::Quaterniond at = match_shape(points, frame).orientation;
  const double turned_rad = frame.orientation.angularDistance(at);
  return turned_rad > kTilts_rad ? frame.orientation.slerp(1 - kTilts_rad / turned_rad, at) : frame.orientation;
}

// Null for a part that goes on deforming.
std::unique_ptr<RigidMotion> rigid_motion_of(const EngineSite& part) {
  const BodySpec& spec = part.spec;
  if (spec.fixed || spec.splitting.free_parts != FreeParts::rigid) return nullptr;
  const MaterialSpec& m = spec.material;
  return RigidMotion::release(
      part.body, part.frame_world, surface_masses_kg(part.body.mesh, m.density_kg_per_m3 * m.foundation_radius_m),
      {part.scene.step_s, part.scene.gravity_m_per_s2, m.density_kg_per_m3, spec.splitting.friction});
}

}  // namespace

Body::Body(const BodySpec& body, const Scene& scene, std::uint32_t body_id, MakeEngines make)
    : spec(body),
      id(body_id),
      mesh(body.mesh),
      particles(particles_at_rest(mesh.rest_body_m(), body.pose)),
      make_(std::move(make)) {
  begin({spec, scene, shared(), body.pose});
  const double largest_s = engines.deformation->largest_stable_step_s();
  if (scene.step_s > largest_s)
    throw InputError(
        formatted("%s: %g s is beyond the stable step of body '%s', which its young_pa, density_kg_per_m3 and "
                  "mesh limit; the largest that would do is %.3g s",
                  place_of_step(scene).c_str(), scene.step_s, body.name.c_str(),
                  0.995 * largest_s));  // no digit is rounded up
}

Body::Body(const BodySpec& part, const Scene& scene, std::uint32_t body_id, MakeEngines make, TriangleMesh part_mesh,
           ParticleState state, const Pose& frame, const Body* parent, std::span<const VertexId> vertex_from)
    : spec(part), id(body_id), mesh(std::move(part_mesh)), particles(std::move(state)), make_(std::move(make)) {
  begin({.spec = spec,
         .scene = scene,
         .body = shared(),
         .frame_world = frame,
         .is_part = true,
         .parent = parent ? &parent->engines : nullptr,
         .parent_particles = parent ? &parent->particles : nullptr,
         .vertex_from = vertex_from});
}

void Body::begin(EngineSite site) {
  Box3 at_rest;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    if (mesh.vertex_alive(v)) at_rest.extend(mesh.rest_body_m(v));
  thinnest_m_ = at_rest.sizes().minCoeff();
  frame_at_first_world_ = site.frame_world;
  auto rigid_motion = site.is_part ? rigid_motion_of(site) : nullptr;
  site.is_rigid = rigid_motion != nullptr;
  engines = make_(site);
  if (rigid_motion) engines.deformation = std::move(rigid_motion);
  cut_traits = engines.cutting->traits();
  if (!site.is_part || site.is_rigid) return;
  std::vector<VertexId> all(mesh.vertex_slots());
  std::iota(all.begin(), all.end(), VertexId{0});
  lips_.follow(mesh, all);
}

Body::Body(const BodySpec& part, const Scene& scene, std::uint32_t body_id, MakeEngines make, const Unread& unread)
    : spec(part), id(body_id), make_(std::move(make)), frame_at_first_world_(unread.frame_at_first_world) {
  BodySpec tetrahedron = spec;
  tetrahedron.tets = {{Vec3::Zero(), 0.01 * Vec3::UnitX(), 0.01 * Vec3::UnitY(), 0.01 * Vec3::UnitZ()}, {{0, 1, 2, 3}}};
  mesh = TriangleMesh(surface_of(tetrahedron.tets).soup);
  particles = particles_at_rest(mesh.rest_body_m(), frame_at_first_world_);
  engines = make_({.spec = tetrahedron,
                   .scene = scene,
                   .body = shared(),
                   .frame_world = frame_at_first_world_,
                   .is_part = true,
                   .is_rigid = unread.is_rigid});
  if (unread.is_rigid) engines.deformation = std::make_unique<RigidMotion>();
  cut_traits = engines.cutting->traits();
}

void Body::archive(Archive& a) {
  bounds_world_m_.reset();
  a(mesh, particles);
  for (Engine* engine : engines.all()) engine->archive(a, shared());
  bool is_swept = swept_ != nullptr;
  a(is_swept);
  if (is_swept) a(swept_tissue());
  a(contact, still_s, unsettled, resting_loads, parts_made, frozen, lips_, tree_stale_, asleep_, much_added_, implicit_,
    implicit_steps_, stillness_, recovery_, thinnest_m_);
}

const CollisionEngine& Body::tree() {
  if (tree_stale_) engines.collision->moved(view());
  tree_stale_ = false;
  return *engines.collision;
}

Box3 Body::bounds_world_m() {
  if (!tree_stale_) return engines.collision->bounds_world_m();
  if (bounds_world_m_) return *bounds_world_m_;
  Box3& box = bounds_world_m_.emplace();
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    if (mesh.vertex_alive(v)) box.extend(particles.view().position(v));
  return box;
}

Vec3 Body::position_at(const std::array<VertexId, 3>& v, const Vec3& weights) const {
  Vec3 position = Vec3::Zero();
  for (std::size_t i = 0; i < v.size(); ++i)
    if (v[i] != kNone) position += weights[static_cast<int>(i)] * particle_view().position(v[i]);
  return position;
}

Vec3 Body::velocity_at(const std::array<VertexId, 3>& v, const Vec3& weights, const Vec3& point_world_m) const {
  if (const RigidMotion* whole = rigid()) return whole->body.velocity_at(point_world_m);
  Vec3 velocity = Vec3::Zero();
  for (std::size_t i = 0; i < v.size(); ++i)
    if (v[i] != kNone) velocity += weights[static_cast<int>(i)] * particle_view().velocity(v[i]);
  return velocity;
}

Vec3 Body::undeformed_world_m(const std::array<VertexId, 3>& v, const Vec3& bary) const {
  Vec3 rest = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i)
    if (v[i] != kNone) rest += bary[static_cast<int>(i)] * mesh.rest_body_m(v[i]);
  return frame_world(v[0]).to_world(rest);
}

Vec3 Body::undeformed_normal_world(const MeshDraft& surface, const std::array<VertexId, 3>& v, const Vec3& bary) const {
  Vec3 normal_body = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3 area = Vec3::Zero();
    for (const TriangleId t : surface.fan(v[i])) {
      const auto c = surface.triangle(t).v;
      const Vec3& a = mesh.rest_body_m(c[0]);
      area += (mesh.rest_body_m(c[1]) - a).cross(mesh.rest_body_m(c[2]) - a);
    }
    normal_body += bary[static_cast<int>(i)] * area.stableNormalized();
  }
  return orientation_about(v[0], surface, frame_world(v[0])) * normal_body.stableNormalized();
}

void Body::express_in_rest_frame(std::span<const Entry> entries, BladeMotion& motion) {
  VertexId at = kNone;
  for (const Entry& e : entries)
    if (e.edge_id == motion.edge_id) at = mesh.triangle(e.triangle).v[0];
  if (const auto point = engines.cutting->cut_point(shared(), motion.edge_id)) at = point->near;
  if (at == kNone) return;
  motion.frame_world = frame_world(at);
  const Eigen::Quaterniond to_body = motion.frame_world.orientation.conjugate();
  for (Blade& blade : motion.path) blade.up_body = to_body * blade.up_world;
}

SweptTissue& Body::swept_tissue() {
  if (!swept_) swept_ = std::make_unique<SweptTissue>(mesh);
  return *swept_;
}

double Body::depth_limit_m(const Vec3& surface_world_m, const Vec3& tip_world_m) {
  const Vec3 down = tip_world_m - surface_world_m;
  const double depth_m = down.norm();
  if (depth_m <= kSkipBelowSurface_m) return 1e9;
  const Vec3 from = surface_world_m + kSkipBelowSurface_m / depth_m * down;
  const Vec3 to = surface_world_m + (1 / kThicknessUsed) * down;
  for (const SurfaceHit& hit : tree().hits(view(), from, to))
    if (!hit.entering && mesh.triangle(hit.triangle).surface == Surface::skin)
      return kThicknessUsed * (hit.point_world_m - surface_world_m).norm();
  return 1e9;
}

std::optional<AppliedChange> Body::apply(const Change& change) {
  const TopologyDelta& delta = change.delta;
  AppliedChange applied;
  applied.vertices = touched_vertices(delta, mesh);
  if (!delta.empty() && sectio::apply(delta, mesh) != ApplyStatus::applied) {
    if (change.plan) engines.cutting->reject();
    return std::nullopt;
  }
  if (change.contact) contact = *change.contact;
  particles.resize(mesh.vertex_slots());
  place(change.seeds);
  bounds_world_m_.reset();
  bring_dead_to_rest(delta);
  if (delta.empty()) {
    if (!change.seeds.empty()) particles_moved();
    if (change.ticket) engines.cutting->accept(shared(), *change.ticket);
    return applied;
  }
  for (const auto& [v, state] : change.seeds) applied.placed.push_back(v);
  for (const TriangleEdit& e : delta.triangles) applied.triangles.push_back(e.id);
  // A vertex that moved changes the springs and triangles around it, too.
  for (const VertexEdit& e : delta.vertices) {
    if (!e.alive) continue;
    for (const TriangleId t : mesh.fan(e.id)) {
      applied.triangles.push_back(t);
      applied.vertices.insert(applied.vertices.end(), mesh.triangle(t).v.begin(), mesh.triangle(t).v.end());
    }
  }
  sort_unique(applied.vertices), sort_unique(applied.triangles);
  engines.follow(shared(), applied.of(delta), change.ticket.get());
  lips_.follow(mesh, applied.vertices);
  if (!change.plan) return applied;
  if (spec.splitting.free_parts == FreeParts::keep) free_islands(change.plan->islands);
  unsettled.insert(unsettled.end(), applied.triangles.begin(), applied.triangles.end());
  return applied;
}

// A volume places its vertices itself, with those inside.
void Body::place(Seeds seeds) {
  if (!particles.slots_are_particles()) return;
  for (const auto& [v, state] : seeds) particles.place(v, state.position_world_m, state.velocity_world_m_per_s);
}

// Nothing brakes a particle without springs, and one that moves keeps the body awake.
void Body::bring_dead_to_rest(const TopologyDelta& delta) {
  if (!particles.slots_are_particles()) return;
  for (const VertexEdit& e : delta.vertices)
    if (!e.alive && e.id < particles.size()) particles.velocity_world_m_per_s[e.id].setZero();
}

// Releases an island, which is no part of the body any more: it lies on a bed, and nothing holds it.
void Body::free_islands(std::span<const Island> islands) {
  for (const Island& island : islands) {
    std::vector<VertexId> members = around(island.any_vertex, mesh);
    std::ranges::sort(members);
    engines.deformation->release(members, SupportPlane{island.bed_point_world_m, island.bed_normal_world});
  }
}

ContactBody Body::contact_body() {
  if (rigid() && !frozen) return {&rigid()->body};
  return {nullptr, particles.view(), frozen ? nullptr : engines.deformation.get()};
}

void Body::particles_moved() {
  tree_stale_ = true;
  bounds_world_m_.reset();
}

void Body::nudge(std::span<const NodeChange> changes) {
  if (changes.empty()) return;
  engines.deformation->nudge(shared(), changes);
  particles_moved();
}

void Body::push_as_one(const Vec3& impulse_n_s) {
  const DeformationEngine& deformation = *engines.deformation;
  std::vector<NodeChange> changes;
  double mass_kg = 0;
  for (std::uint32_t n = 0; n < deformation.node_count(particle_view()); ++n)
    if (const double inverse = deformation.node(particle_view(), n).inverse_mass_per_kg; inverse > 0) {
      changes.push_back({n, Vec3::Zero(), Vec3::Zero()});
      mass_kg += 1 / inverse;
    }
  for (NodeChange& c : changes) c.faster_by_m_per_s = impulse_n_s / mass_kg;
  nudge(changes);
}

void Body::deform(std::span<const PointConstraint> constraints, std::span<Reaction> reactions, double step_s) {
  if (frozen) return;
  if (!asleep_) {
    recovery_.keep(shared(), *engines.deformation);
    engines.deformation->step(shared(), constraints, reactions);
  }
  for (const auto& process : engines.processes) process->step(shared(), step_s);
  if (asleep()) return;
  particles_moved();
  separate_lips(step_s);
}

// Solves the contacts of the body's own lips. An overlap is stopped but not undone: undoing it against the springs
// would add energy.
void Body::separate_lips(double step_s) {
  std::vector<BodyContact> contacts;
  lips_.find(shared(), step_s, contacts);
  if (contacts.empty()) return;
  const ContactBody self = contact_body();
  ContactSolver solver({&self, 1}, contacts, step_s);
  solver.solve(kLipSweeps);
  nudge(solver.changes_of(0));
}

Body::Happenings Body::watch_driver() {
  Happenings events;
  const IntegratorDiagnostics driver = engines.deformation->diagnostics();
  if (driver.added_mass_fraction > kMuchAddedMass && !much_added_)
    events.emplace_back(EventKind::mass_added, percent(driver.added_mass_fraction));
  much_added_ = driver.added_mass_fraction > kMuchAddedMass;
  if (const std::uint64_t steps = driver.implicit_steps; steps != implicit_steps_) {
    if (!implicit_) events.emplace_back(EventKind::driver_taken_over, "");
    implicit_ = true;
    implicit_steps_ = steps;
  } else if (implicit_) {
    implicit_ = false;
    events.emplace_back(EventKind::driver_handed_back, "");
  }
  return events;
}

Body::Happenings Body::guard(bool touched, double step_s) {
  Happenings events;
  recovery_.count_step();
  if (frozen && recovery_.thaws(touched, step_s, *engines.deformation)) {
    frozen = false;
    wake();
    events.emplace_back(EventKind::body_thawed, "");
  }
  if (asleep()) return events;
  const auto what = recovery_.flaw(shared(), *engines.deformation);
  if (!what) return events;
  const Recovery::Remedy remedy = recovery_.mend(shared(), *engines.deformation, step_s);
  particles_moved();
  if (frozen) return events;  // something else moved it
  if (remedy == Recovery::Remedy::left) {
    frozen = true;
    events.emplace_back(EventKind::left_world, *what);
    return events;
  }
  frozen = remedy == Recovery::Remedy::frozen;
  const char* const how = remedy == Recovery::Remedy::reshaped ? "its shape at rest" : "its last good state";
  events.emplace_back(frozen ? EventKind::body_frozen : EventKind::body_recovered, how + (": " + *what));
  return events;
}

void Body::watch_rest(const Scene& scene) {
  if (frozen || asleep_ || !deforms() || scene.sleep.after_s == 0) return;
  if (std::ranges::any_of(engines.processes, [](const auto& process) { return process->moves_particles(); })) return;
  const double eye_to_body_m = bounds_world_m().exteriorDistance(scene.camera.eye_world_m);
  const double unseen_m = scene.sleep.unseen_px * pixel_rad(scene.camera) * eye_to_body_m;
  asleep_ = stillness_.watch(particles.positions(), scene.step_s, scene.sleep.after_s,
                             std::max(scene.sleep.still_m, unseen_m));
  if (asleep_) std::ranges::fill(particles.velocity_world_m_per_s, Vec4f::Zero());
}

void Body::wake() {
  asleep_ = false;
  stillness_.begin_anew();
  engines.deformation->wake();
}

}  // namespace sectio
