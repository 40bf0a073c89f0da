#include "sim_server/deformation/surface_springs.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/core/error.h"
#include "common/core/sort_unique.h"
#include "common/mesh/slot_table.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {
namespace {

// The sum of the areas around a vertex as vectors falls short of the area by this share, on skin and at creases.
constexpr double kFlat = 0.02, kCrease = 0.1;

constexpr int kMostDivision = 4;  // largest division, by cuts, of the parts that an explicit step had at rest

// The depth of the layer over the spacing of the vertices. A surface that is held out of a ball everywhere lies around
// it like a polyhedron, further in than the ball; with this layer, balls on layers feel the same force on all meshes.
constexpr double kLayer = 0.5;

constexpr int kColumnPoints = 8;  // sample points in the column of tissue beneath a vertex

// The margin beyond the bound at rest that a row gets after a cut. Instruments fold the surface near cuts, and folding
// turns springs towards one direction, which raises lambda_max from sum k / 2 (a flat ring) towards sum k.
constexpr double kMassMargin = 2, kLeastMassMargin = 1.05;

// The largest speed of a vertex that nothing holds: soft tissue recoils at less. A faster vertex would cross its
// neighbours within a step, and go on to cross them to and fro, since no bound on the step foresees a spring that is
// pressed through its own length.
constexpr double kFreeSpeed_m_per_s = 2;
// When some vertex is capped in so many of the last parts of steps, the implicit driver brings the surface to rest.
constexpr int kLookBack = 128, kCappedAtMost = 96;
constexpr int kStableAfterCap = 50;  // steps

constexpr double kReturn_m_per_s = 0.2;  // tissue that has come to be fixed goes to its place
constexpr double kAtHome_m = 1e-6;

// The part of the skin's pull on a vertex that its home spring balances at rest. On skin that is flat or gently curved
// that is the part along the normal; what is left along the skin comes from uneven triangles, and vertices that a cut
// makes have it, too. At a crease there is no such normal: uneven triangles would make a saw of it.
Vec3 balanced_pull_n(const SpringStar& star) {
  const double bent = 1 - star.outward_m2.norm() / std::max(3 * star.area_m2, 1e-30);
  const double crease = std::clamp((bent - kFlat) / (kCrease - kFlat), 0.0, 1.0);
  const Vec3 outward = star.outward_m2.stableNormalized();
  const Vec3 along_normal = star.pull_n.dot(outward) * outward;
  return along_normal + crease * (star.pull_n - along_normal);
}

}  // namespace

SurfaceSprings::SurfaceSprings(const TriangleMesh& mesh, const Pose& body, const SurfaceSpringMaterial& material,
                               const SurfaceSpringSettings& settings)
    : material_(material), settings_(settings), body_(body), frames_(body), inside_(material) {
  SECTIO_ASSERT(material.young_pa > 0 && material.density_kg_per_m3 > 0, "elastic constants are positive");
  SECTIO_ASSERT(material.skin_thickness_m > 0 && material.foundation_radius_m > 0, "lengths are positive");
  SECTIO_ASSERT(std::abs(material.poisson) < 1 && settings.step_s > 0, "Poisson's ratio and step are in range");
  membrane_ = {material.young_pa * material.skin_thickness_m, material.pretension};
  const double contact_modulus_pa = material.young_pa / (1 - material.poisson * material.poisson);
  foundation_pa_per_m_ = 2 * contact_modulus_pa / (std::numbers::pi * material.foundation_radius_m);
  area_density_kg_per_m2_ = material.density_kg_per_m3 * material.foundation_radius_m;
  if (!settings_.given_gravity_m_per_s2) settings_.given_gravity_m_per_s2 = settings_.gravity_m_per_s2;
  forces_.reserve(256);

  std::vector<std::uint32_t> degrees(mesh.vertex_slots(), kNone);
  double area_m2 = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    gather_star(mesh, v, membrane_, star_);
    degrees[v] = static_cast<std::uint32_t>(star_.half_edges.size());
    area_m2 += star_.area_m2;
  }
  const double mean_m2 = area_m2 / std::max(1u, mesh.vertex_count());
  least_area_m2_ = kLeastAreaShare * mean_m2;
  layer_m_ = kLayer * std::sqrt(mean_m2);
  rows_.layout(degrees);
  omega2_.set(with_room(mesh.vertex_slots()), 0);
  resize(mesh.vertex_slots());
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    frames_.move(v, 0);
    set_row(mesh, v);
  }
  if (settings_.adapts) divide_at_rest();
}

// A fine surface needs parts of a step from the beginning, without any added mass.
void SurfaceSprings::divide_at_rest() {
  const double parts = std::ceil(settings_.step_s / largest_stable_step_s());
  parts_ = parts_at_rest_ = static_cast<int>(std::clamp(parts, 1.0, double{kMostParts}));
  if (parts_ == 1) return;
  for (VertexId v = 0; v < physical_mass_.size(); ++v)
    if (rows_.contains(v))
      rows_.set_mass(v, static_cast<float>(part_s() * inverse_mass_[v]), fixed_[v] != 0 ? 0.0f : 1.0f);
}

void SurfaceSprings::resize(std::uint32_t vertex_slots) {
  for (auto* places : {&rest_body_m_, &home_body_m_, &lift_world_m_})
    resize_slots<Vec3>(*places, vertex_slots, Vec3::Zero());
  for (auto* masses : {&physical_mass_, &added_mass_, &inverse_mass_}) resize_slots(*masses, vertex_slots, 0.0);
  for (auto* flags : {&fixed_, &cut_, &temporary_}) resize_slots<std::uint8_t>(*flags, vertex_slots, 0);
  frames_.resize(vertex_slots);
}

double SurfaceSprings::stable_mass_kg(double stiffness_n_per_m) const {
  // omega h <= 2 (sqrt(1 + zeta^2) - zeta), zeta = alpha / (2 omega)  <=>  omega^2 h^2 + 2 alpha h <= 4
  const double h = part_s();
  const double budget = 4 - 2 * material_.damping_per_s * h;
  SECTIO_ASSERT(budget > 0, "the step is beyond what damping allows");
  return stiffness_n_per_m * h * h / budget;
}

// With the margin, or without it, or none: as much as the body may still get.
double SurfaceSprings::added_mass_kg(double physical_kg, double stiffness_n_per_m) {
  const double left_kg = kAddedMassGiven * (physical_mass_kg_ + physical_kg) - added_mass_kg_;
  for (const double margin : {kMassMargin, kLeastMassMargin})
    if (const double kg = margin * stable_mass_kg(stiffness_n_per_m) - physical_kg; kg <= left_kg)
      return std::max(0.0, kg);
  refused_ = true;
  return 0;
}

// Twice as many parts, which need a quarter of the added mass.
void SurfaceSprings::divide() {
  parts_ *= 2;
  added_mass_kg_ = 0;
  refused_ = false;
  for (VertexId v = 0; v < physical_mass_.size(); ++v) {
    if (!rows_.contains(v)) continue;
    if (const double inverse = inverse_mass_[v]; inverse > 0) {
      const double physical = physical_mass_[v], stiffness = omega2_[v] / inverse;
      const bool needs = std::exchange(added_mass_[v], 0.0) > 0 || stable_mass_kg(stiffness) > physical;
      if (needs) added_mass_[v] = added_mass_kg(physical, stiffness);
      added_mass_kg_ += added_mass_[v];
      inverse_mass_[v] = 1 / (physical + added_mass_[v]);
      omega2_.set(v, stiffness * inverse_mass_[v]);
    }
    rows_.set_mass(v, static_cast<float>(part_s() * inverse_mass_[v]),
                   static_cast<float>(physical_mass_[v] * inverse_mass_[v]));
  }
}

double SurfaceSprings::column_factor(const TriangleMesh& mesh, VertexId v) const {
  if (!settings_.stiffness_factor) return 1;
  Vec3 outward = Vec3::Zero();
  for (const TriangleId t : mesh.fan(v)) {
    const auto& c = mesh.triangle(t).v;
    const Vec3& a = mesh.rest_body_m(c[0]);
    outward += (mesh.rest_body_m(c[1]) - a).cross(mesh.rest_body_m(c[2]) - a);
  }
  const Vec3 down_m = -material_.foundation_radius_m * outward.stableNormalized();
  double compliance = 0;
  for (int i = 0; i < kColumnPoints; ++i)
    compliance += 1 / settings_.stiffness_factor(mesh.rest_body_m(v) + (i + 0.5) / kColumnPoints * down_m);
  return kColumnPoints / compliance;
}

void SurfaceSprings::set_row(const TriangleMesh& mesh, VertexId v) {
  forget_mass(v);
  gather_star(mesh, v, membrane_, star_);
  const bool scale_mass = cut_[v] || temporary_[v] || std::ranges::any_of(star_.half_edges, [&](const HalfEdge& e) {
                            return temporary_[e.to] != 0;
                          });
  const double area_m2 = std::max(star_.area_m2, least_area_m2_);
  const double k_home = material_.home_springs ? foundation_pa_per_m_ * area_m2 * column_factor(mesh, v) : 0;
  const double stiffness = 2 * star_.stiffness_n_per_m + k_home;
  const double physical = area_density_kg_per_m2_ * area_m2;
  rest_body_m_[v] = home_body_m_[v] = mesh.rest_body_m(v);
  lift_world_m_[v].setZero();
  if (k_home > 0) {
    if (star_.whole_skin) home_body_m_[v] -= balanced_pull_n(star_) / k_home;
    lift_world_m_[v] = -physical / k_home * given_gravity_m_per_s2();
  }
  fixed_[v] = settings_.fixed && settings_.fixed(body_.to_world(rest_body_m_[v]));
  if (fixed_[v]) displaced_.push_back(v);
  const double effective = physical + (scale_mass && !fixed_[v] ? added_mass_kg(physical, stiffness) : 0);
  physical_mass_[v] = physical;
  added_mass_[v] = effective - physical;
  inverse_mass_[v] = fixed_[v] ? 0 : 1 / effective;
  physical_mass_kg_ += physical;
  added_mass_kg_ += added_mass_[v];
  omega2_.set(v, stiffness * inverse_mass_[v]);

  VertexRow row;
  row.home_world_m = home_world_m(v);
  row.k_home = static_cast<float>(k_home);
  row.step_over_mass = static_cast<float>(part_s() * inverse_mass_[v]);
  row.gravity_share = static_cast<float>(physical * inverse_mass_[v]);
  rows_.set(v, row, star_.half_edges);
  if (cut_[v] || temporary_[v])
    cut_damping_.watch(v);
  else
    cut_damping_.forget(v);
}

void SurfaceSprings::forget_mass(VertexId v) {
  physical_mass_kg_ -= physical_mass_[v];
  added_mass_kg_ -= added_mass_[v];
  physical_mass_[v] = added_mass_[v] = inverse_mass_[v] = 0;
}

void SurfaceSprings::remove_row(VertexId v) {
  forget_mass(v);
  omega2_.set(v, 0);
  fixed_[v] = cut_[v] = temporary_[v] = 0;
  rows_.remove(v);
  cut_damping_.forget(v);
  frames_.move(v, kNone);
}

void SurfaceSprings::update(const TriangleMesh& mesh, std::span<const VertexId> touched, Change change) {
  const auto alive = [&](VertexId v) { return v < mesh.vertex_slots() && mesh.vertex_alive(v); };
  const auto old_slots = static_cast<std::uint32_t>(rest_body_m_.size());
  resize(std::max(old_slots, mesh.vertex_slots()));
  for (const VertexId v : touched) {
    if (!alive(v)) remove_row(v);
  }
  resize(mesh.vertex_slots());  // slots at the end may be gone
  inside_.forget_pieces();
  for (const VertexId v : touched) {
    if (!alive(v)) continue;
    if (change == Change::permanent) {
      cut_[v] = 1;
    } else if (component_of(v) == kNone) {
      temporary_[v] = 1;
    }
  }
  adopt_new_vertices(mesh, touched);
  for (const VertexId v : touched) {
    if (alive(v)) set_row(mesh, v);
  }
  while (parts_ < kMostDivision * parts_at_rest_ && (refused_ || added_mass_kg_ > kMuchAddedMass * physical_mass_kg_))
    divide();
  if (rows_.wants_compaction()) rows_.compact();
}

// Assigns components from neighbour to neighbour, since a vertex deep in a groove may have new neighbours only.
void SurfaceSprings::adopt_new_vertices(const TriangleMesh& mesh, std::span<const VertexId> touched) {
  std::vector<VertexId> orphans;
  for (const VertexId v : touched) {
    if (v < mesh.vertex_slots() && mesh.vertex_alive(v) && component_of(v) == kNone) orphans.push_back(v);
  }
  while (!orphans.empty()) {
    std::vector<VertexId> left;
    for (const VertexId v : orphans) {
      gather_star(mesh, v, membrane_, star_);
      const auto next = std::find_if(star_.half_edges.begin(), star_.half_edges.end(),
                                     [&](const HalfEdge& e) { return component_of(e.to) != kNone; });
      if (next == star_.half_edges.end()) {
        left.push_back(v);
      } else {
        frames_.move(v, component_of(next->to));
      }
    }
    // No orphan has a known neighbour: they form a new piece, which starts in component 0.
    if (left.size() == orphans.size()) frames_.move(left.front(), 0);
    if (left.size() == orphans.size()) left.erase(left.begin());
    orphans = std::move(left);
  }
}

Vec3f SurfaceSprings::home_world_m(VertexId v) const {
  const std::uint32_t component = component_of(v);
  const Vec3 home = frame_world(component).to_world(home_body_m_[v]);
  return (anchored(component) ? Vec3(home + lift_world_m_[v]) : home).cast<float>();
}

void SurfaceSprings::set_component(std::uint32_t component, std::span<const VertexId> vertices, bool anchored) {
  if (vertices.empty()) return;
  SECTIO_ASSERT(std::all_of(vertices.begin(), vertices.end(), [&](VertexId v) { return rows_.contains(v); }),
                "a component is made of living vertices");
  const bool is_held = std::any_of(vertices.begin(), vertices.end(), [&](VertexId v) { return fixed_[v] != 0; });
  frames_.set(component, vertices, !anchored && !is_held);
  inside_.forget_pieces();
  for (const VertexId v : vertices) rows_.set_home(v, home_world_m(v));
}

void SurfaceSprings::release(std::span<const VertexId> piece, const std::optional<SupportPlane>& support) {
  const std::uint32_t component = frames_.size();
  set_component(component, piece, false);
  if (support) set_bed(component, support->point_world_m, support->normal);
}

void SurfaceSprings::add_force(VertexId v, const Vec3& force_world_n) {
  forces_.push_back({v, force_world_n});
}

Vec3 SurfaceSprings::displace(VertexId v, const Vec3& by_m, std::span<Vec4f> position_world_m,
                              std::span<Vec4f> velocity_m_per_s) {
  if (inverse_mass_[v] == 0) return Vec3::Zero();
  position_world_m[v].head<3>() += by_m.cast<float>();
  velocity_m_per_s[v].head<3>() += (by_m / settings_.step_s).cast<float>();
  return -by_m / (inverse_mass_[v] * settings_.step_s * settings_.step_s);
}

void SurfaceSprings::save(DeformationState& state) const {
  state.frames_world = frames_.save();
}

void SurfaceSprings::restore(const SharedBody&, const DeformationState* state) {
  first_bad_vertex_ = kNone;
  forces_.clear();
  frames_.restore(state ? std::span<const Pose>(state->frames_world) : std::span<const Pose>());
}

double SurfaceSprings::largest_stable_step_s() const {
  const double alpha = material_.damping_per_s;
  return 4 * parts_ / (alpha + std::sqrt(alpha * alpha + 4 * omega2_.max()));
}

void SurfaceSprings::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                          std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  SECTIO_ASSERT(position_world_m.size() == rest_body_m_.size(), "one position a vertex slot");
  const double h = settings_.step_s;
  take_fixed_home(position_world_m, velocity_m_per_s);
  was_implicit_ = settings_.adapts && (h > largest_stable_step_s() || (stable_for_ > 0 && stable_for_-- > 0));
  if (was_implicit_) return implicit_step(position_world_m, velocity_m_per_s, constraints, reactions);

  find_held(constraints);
  if (parts_ == 1) {
    explicit_step(position_world_m, velocity_m_per_s);
    project(constraints, inverse_mass_, h, position_world_m, velocity_m_per_s, reactions);
    return slow_down_unpushed(position_world_m, velocity_m_per_s);
  }
  divided_.begin(constraints, position_world_m, parts_);
  for (int part = 0; part < parts_; ++part) {
    explicit_step(position_world_m, velocity_m_per_s);
    divided_.project_substep(part, part_s(), inverse_mass_, position_world_m, velocity_m_per_s);
    slow_down_unpushed(position_world_m, velocity_m_per_s);
  }
  divided_.finish(reactions);
}

// Homes that stayed behind would brake a piece that moves.
void SurfaceSprings::follow(std::span<const Vec4f> position_world_m) {
  frames_.follow(home_body_m_, physical_mass_, position_world_m,
                 [&](VertexId v) { rows_.set_home(v, home_world_m(v)); });
}

// The bottom of a cut that goes down into fixed tissue is fixed from then on, and was moving.
void SurfaceSprings::take_fixed_home(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  sort_unique(displaced_);
  std::erase_if(displaced_, [&](VertexId v) {
    if (!rows_.contains(v) || !fixed_[v]) return true;
    velocity_m_per_s[v].setZero();
    const Vec3f home = frame_world(component_of(v)).to_world(rest_body_m_[v]).cast<float>();
    const Vec3f way_m = home - position_world_m[v].head<3>();
    const double far_m = way_m.norm();
    if (far_m < kAtHome_m) return true;
    position_world_m[v].head<3>() +=
        static_cast<float>(std::min(1.0, kReturn_m_per_s * settings_.step_s / far_m)) * way_m;
    return false;
  });
}

void SurfaceSprings::find_held(std::span<const PointConstraint> constraints) {
  held_.clear();
  for (const PointConstraint& c : constraints)
    for (const VertexId v : c.v)
      if (v != kNone && rows_.contains(v)) held_.push_back({v});
  std::ranges::sort(held_, {}, &Held::v);
  const auto is_same = [](const Held& a, const Held& b) { return a.v == b.v; };
  held_.erase(std::unique(held_.begin(), held_.end(), is_same), held_.end());
}

// Vertices that no instrument has pushed are as free as others.
void SurfaceSprings::slow_down_unpushed(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const {
  const auto h = static_cast<float>(part_s());
  for (const Held& held : held_) {
    const Vec4f fast = velocity_m_per_s[held.v];
    const float speed = fast.norm();
    if (fast != held.free_m_per_s || !(speed > kFreeSpeed_m_per_s)) continue;
    velocity_m_per_s[held.v] = static_cast<float>(kFreeSpeed_m_per_s) / speed * fast;
    position_world_m[held.v] += h * (velocity_m_per_s[held.v] - fast);
  }
}

// The velocity that update_velocities() would give a vertex without a cap.
Vec4f SurfaceSprings::free_velocity(const Held& held, const VelocityUpdate& update,
                                    std::span<const Vec4f> position_world_m) const {
  const VertexRow row = rows_.row(held.v);
  const Vec3f x = position_world_m[held.v].head<3>();
  Vec3f force = row.k_home * (row.home_world_m - x);
  for (std::uint32_t n = 0; n < rows_.degree(held.v); ++n) {
    const HalfEdge e = rows_.half_edge(held.v, n);
    const Vec3f d = position_world_m[e.to].head<3>() - x;
    const float l = d.norm();
    if (l > 0) force += (e.k - e.k_l0 / l) * d;
  }
  Vec4f velocity = update.damping_factor * held.before_m_per_s;
  velocity.head<3>() += row.step_over_mass * force + row.gravity_share * update.gravity_step;
  return velocity;
}

void SurfaceSprings::explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  follow(position_world_m);
  const double h = part_s();
  VelocityUpdate update;
  update.damping_factor = static_cast<float>(1 - material_.damping_per_s * h);
  update.gravity_step = (h * settings_.gravity_m_per_s2).cast<float>();
  update.max_speed_m_per_s = static_cast<float>(kFreeSpeed_m_per_s);
  for (Held& held : held_) held = {held.v, velocity_m_per_s[held.v]};
  VelocityOutcome outcome = update_velocities(rows_, update, position_world_m, velocity_m_per_s);
  if (outcome.clamped > 0)
    for (Held& held : held_) {
      const Vec4f free = free_velocity(held, update, position_world_m);
      if (!free.allFinite() || !(free.norm() > kFreeSpeed_m_per_s)) continue;
      velocity_m_per_s[held.v] = held.free_m_per_s = free;
      outcome.clamped -= std::min(1u, outcome.clamped);
    }
  clamped_ += outcome.clamped;
  if (first_bad_vertex_ == kNone) first_bad_vertex_ = outcome.not_finite;
  capped_parts_ += outcome.clamped > 0;
  if (++parts_looked_at_ == kLookBack) {
    if (capped_parts_ > kCappedAtMost) stable_for_ = kStableAfterCap;
    parts_looked_at_ = capped_parts_ = 0;
  }
  push(velocity_m_per_s);
  const auto is_held = [&](VertexId v) { return std::ranges::binary_search(held_, v, {}, &Held::v); };
  cut_damping_.damp(rows_, inverse_mass_, h, is_held, position_world_m, velocity_m_per_s);
  update_positions(static_cast<float>(h), velocity_m_per_s, position_world_m);
  frames_.stop_at_beds(h, position_world_m, velocity_m_per_s);
}

void SurfaceSprings::push(std::span<Vec4f> velocity_m_per_s) {
  for (const Force& force : forces_)
    velocity_m_per_s[force.v].head<3>() += (settings_.step_s * inverse_mass_[force.v] * force.force_n).cast<float>();
  forces_.clear();
}

void SurfaceSprings::implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                   std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  ++implicit_steps_;
  if (frames_.any_free()) {
    ahead_world_m_.assign(position_world_m.begin(), position_world_m.end());
    update_positions(static_cast<float>(settings_.step_s), velocity_m_per_s, ahead_world_m_);
    follow(ahead_world_m_);
  }
  push(velocity_m_per_s);
  corners_of(constraints, corners_);
  energy_.read(rows_, static_cast<std::uint32_t>(rest_body_m_.size()));
  driver_.step(energy_, {settings_.step_s, material_.damping_per_s, settings_.gravity_m_per_s2, kMaxSpeed_m_per_s},
               {physical_mass_, inverse_mass_, position_world_m, velocity_m_per_s}, constraints, corners_, reactions);
  frames_.stop_at_beds(settings_.step_s, position_world_m, velocity_m_per_s);
}

double SurfaceSprings::energy_j(std::span<const Vec4f> position_world_m,
                                std::span<const Vec4f> velocity_m_per_s) const {
  double energy = 0;
  for (VertexId v = 0; v < rest_body_m_.size(); ++v) {
    if (!rows_.contains(v)) continue;
    const Vec3 x = position_world_m[v].head<3>().cast<double>();
    const VertexRow row = rows_.row(v);
    energy += 0.5 * double{row.k_home} * (row.home_world_m.cast<double>() - x).squaredNorm();
    for (std::uint32_t n = 0; n < rows_.degree(v); ++n) {
      const HalfEdge e = rows_.half_edge(v, n);
      const double l = (position_world_m[e.to].head<3>().cast<double>() - x).norm();
      const double stretch = l - e.rest_length_m();
      energy += 0.25 * double{e.k} * stretch * stretch;  // each spring is met twice
    }
    if (inverse_mass_[v] == 0) continue;
    energy += 0.5 / inverse_mass_[v] * velocity_m_per_s[v].head<3>().cast<double>().squaredNorm();
    energy -= physical_mass_[v] * settings_.gravity_m_per_s2.dot(x);
  }
  return energy;
}

}  // namespace sectio
