// The step of the surface springs; construction and changes of topology are in surface_springs.cpp.
#include "common/core/error.h"
#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/surface_springs.h"

namespace sectio {
namespace {

constexpr int kClampedInARow = 100;    // steps in which a vertex got too fast: that is no blow, but an instability
constexpr int kStableAfterClamp = 50;  // steps of the implicit driver after a vertex got too fast

}  // namespace

void SurfaceSprings::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                          std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  SECTIO_ASSERT(position_world_m.size() == rest_body_m_.size(), "one position a vertex slot");
  const double h = settings_.step_s;
  follow_free_components(position_world_m);
  was_implicit_ = settings_.adapts && (h > largest_stable_step_s() || (stable_for_ > 0 && stable_for_-- > 0));
  if (was_implicit_) return implicit_step(position_world_m, velocity_m_per_s, constraints, reactions);

  if (parts_ == 1) {
    explicit_step(position_world_m, velocity_m_per_s);
    return project(constraints, inverse_mass_, h, position_world_m, velocity_m_per_s, reactions);
  }
  divided_.begin(constraints, position_world_m, parts_);
  for (int part = 0; part < parts_; ++part) {
    explicit_step(position_world_m, velocity_m_per_s);
    divided_.project_substep(part, part_s(), inverse_mass_, position_world_m, velocity_m_per_s);
  }
  divided_.finish(reactions);
}

void SurfaceSprings::explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  const double h = part_s();
  VelocityUpdate update;
  update.damping_factor = static_cast<float>(1 - material_.damping_per_s * h);
  update.gravity_step = (h * settings_.gravity_m_per_s2).cast<float>();
  update.max_speed_m_per_s = static_cast<float>(kMaxSpeed_m_per_s);
  const VelocityOutcome outcome = update_velocities(rows_, update, position_world_m, velocity_m_per_s);
  clamped_ += outcome.clamped;
  if (first_bad_vertex_ == kNone) first_bad_vertex_ = outcome.not_finite;
  clamped_in_a_row_ = outcome.clamped > 0 ? clamped_in_a_row_ + 1 : 0;
  if (clamped_in_a_row_ >= kClampedInARow * parts_) stable_for_ = kStableAfterClamp;
  push(velocity_m_per_s);
  update_positions(static_cast<float>(h), velocity_m_per_s, position_world_m);
  stop_at_beds(position_world_m, velocity_m_per_s);
}

void SurfaceSprings::push(std::span<Vec4f> velocity_m_per_s) {
  for (const Force& force : forces_)
    velocity_m_per_s[force.v].head<3>() += (settings_.step_s * inverse_mass_[force.v] * force.force_n).cast<float>();
  forces_.clear();
}

void SurfaceSprings::implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                   std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  ++implicit_steps_;
  push(velocity_m_per_s);
  corners_of(constraints, corners_);
  energy_.read(rows_, static_cast<std::uint32_t>(rest_body_m_.size()));
  driver_.step(energy_, {settings_.step_s, material_.damping_per_s, settings_.gravity_m_per_s2, kMaxSpeed_m_per_s},
               {physical_mass_, inverse_mass_, position_world_m, velocity_m_per_s}, constraints, corners_, reactions);
  stop_at_beds(position_world_m, velocity_m_per_s);
}

void SurfaceSprings::follow_free_components(std::span<const Vec4f> position_world_m) {
  for (Component& c : components_) {
    if (!c.free || c.vertices.empty()) continue;
    matched_.clear();
    for (const VertexId v : c.vertices) {
      matched_.push_back({home_body_m_[v], position_world_m[v].head<3>().cast<double>(), physical_mass_[v]});
    }
    c.frame = match_shape(matched_, c.frame);
    for (const VertexId v : c.vertices) rows_.set_home(v, home_world_m(v));
  }
}

void SurfaceSprings::stop_at_beds(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const {
  for (const Component& c : components_) {
    if (!c.free || !c.bed_point_m) continue;
    for (const VertexId v : c.vertices) {
      const Vec3 at = position_world_m[v].head<3>().cast<double>();
      const double height = (at - *c.bed_point_m).dot(c.bed_normal);
      if (height >= 0) continue;
      position_world_m[v].head<3>() = (at - height * c.bed_normal).cast<float>();
      velocity_m_per_s[v].setZero();
    }
  }
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
      const double stretch = l - (e.k > 0 ? double{e.k_l0} / double{e.k} : l);
      energy += 0.25 * double{e.k} * stretch * stretch;  // each spring is met twice
    }
    if (inverse_mass_[v] == 0) continue;
    energy += 0.5 / inverse_mass_[v] * velocity_m_per_s[v].head<3>().cast<double>().squaredNorm();
    energy -= physical_mass_[v] * settings_.gravity_m_per_s2.dot(x);
  }
  return energy;
}

}  // namespace sectio
