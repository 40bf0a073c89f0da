#include "sim_server/deformation/tetra/tet_solid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/error.h"
#include "common/math/lame.h"
#include "sim_server/deformation/sag.h"

namespace sectio {
namespace {

// The share of the stable step at rest that is used. Deformation stiffens a nearly incompressible solid, the more the
// closer Poisson's ratio is to 1/2.
double safety(double poisson) {
  return poisson > 0.47 ? 0.45 : 0.6;
}
// The margin beyond the rigorous bound at rest, which is itself 1.4 to 1.9 times too careful.
constexpr double kRoomForDeformation = 1.05, kRoomOnceDivided = 1.25;

// The share of rows in overflow slices at which all are laid out anew in a step without a change, and at once.
constexpr double kSpread = 0.1, kSpreadTooFar = 0.25;

void set_stiffness(const VolumeMaterial& m, double factor, std::uint32_t t, TetStiffness& stiffness) {
  const auto [mu, lambda] = lame(m.young_pa, m.poisson);
  stiffness.shear_pa[t] = factor * mu;
  stiffness.bulk_pa[t] = factor * (lambda + mu);
}

}  // namespace

TetSolid::TetSolid(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
                   VolumeIntegrator integrator)
    : ExplicitImplicitIntegrator(material, std::move(settings), integrator), body_(mesh, material, settings_.fixed) {
  stiffness_.shear_pa.resize(mesh.tetrahedra.size());
  stiffness_.bulk_pa.resize(mesh.tetrahedra.size());
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
    set_stiffness(material_, body_.stiffness_factor(t), t, stiffness_);
  const std::uint32_t vertices = body_.vertex_count();
  settings_.least_substep_s = body_.weigh_for(settings_.least_substep_s, [&](double substep_s) {
    for (VertexId v = 0; v < vertices && substep_s > 0; ++v) {
      star_.begin(mesh, body_.stars(), v);
      star_.measure(mesh);
      weigh(v, star_, substep_s);
    }
  });
  const double omega2 = largest_omega2_at_rest(mesh, stiffness_, body_.inverse_mass());
  explicit_limit_s_ = safety(material_.poisson) * damped_limit_s(omega2, material_.damping_per_s);
  substeps_ = substeps_for(explicit_limit_s_);
  rows_.build(body_.mesh(), body_.stars(), stiffness_, integrator_ != VolumeIntegrator::implicit_only);
  std::vector<TetVertex> rows(vertices);
  for (VertexId v = 0; v < vertices; ++v) rows[v] = row_of(v);
  rows_.set(rows, settings_.step_s / substeps_);
  scratch_.resize(3 * rows_.most_faces() + 1);
  std::vector<Vec4f> rest(vertices, Vec4f::Zero());
  for (VertexId v = 0; v < vertices; ++v) rest[v].head<3>() = mesh.vertices_body_m[v].cast<float>();
  const double bound = double{update_pressures(rows_, true, rest)};
  omega2_per_bound_ = bound > 0 ? omega2 / bound : 0;
  give_room(stiffness_.shear_pa, stiffness_.bulk_pa);
}

// Adds mass until the vertex is stable in substeps of this length.
void TetSolid::weigh(VertexId v, const VertexStar& star, double substep_s) {
  if (body_.fixed(v)) return;
  const double h = kRoomForDeformation * (divided_ > 0 ? kRoomOnceDivided : 1) * substep_s;
  body_.weigh_at_least(v, 0.25 * h * h * stiffness_bound_n_per_m(star, stiffness_));
}

// Twice as many substeps, which need a quarter of the added mass.
void TetSolid::divide() {
  ++divided_;
  substeps_ *= 2;
  body_.shed_added_mass();
  std::vector<TetVertex> rows(body_.vertex_count());
  for (VertexId v = 0; v < rows.size(); ++v) {
    if (!rows_.contains(v)) continue;
    star_.begin(body_.mesh(), body_.stars(), v);
    star_.measure(body_.mesh());
    weigh(v, star_, part_s(substeps_));
    rows[v] = row_of(v);
  }
  rows_.set(rows, settings_.step_s / substeps_);
}

TetVertex TetSolid::row_of(VertexId v) const {
  const double inverse = body_.inverse_mass()[v];
  return {inverse, body_.mass_kg(v) * inverse};
}

void TetSolid::change(const TetChange& change) {
  const std::span<const VertexId> touched = body_.follow(change);
  for (auto* table : {&stiffness_.shear_pa, &stiffness_.bulk_pa})
    resize_slots(*table, body_.mesh().tetrahedra.size(), 0.0);
  for (const TetEdit& e : change.tetrahedra) set_stiffness(material_, body_.stiffness_factor(e.id), e.id, stiffness_);
  rows_.follow(body_.vertex_count());
  for (const VertexId v : touched) {
    star_.begin(body_.mesh(), body_.stars(), v);
    star_.measure(body_.mesh());
    rows_.update(v, star_, stiffness_);
    if (!rows_.contains(v)) continue;
    weigh(v, star_, part_s(substeps_));
    rows_.set(v, row_of(v));
  }
  const bool may_wait = integrator_ != VolumeIntegrator::implicit_only;
  rows_.compact_if_spread(may_wait ? kSpreadTooFar : kSpread);
  has_changed_ = true;
  while (body_.is_heavy() && may_divide()) divide();
  scratch_.resize(3 * rows_.most_faces() + 1);
  energy_.changed();
  if (!change.added_body_m.empty()) driver_.forget(change.first_added);
}

void TetSolid::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                    std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  if (!std::exchange(has_changed_, false)) {
    rows_.compact_if_spread(kSpread);
    rows_.renew_room();
  }
  start_position_.assign(position_world_m.begin(), position_world_m.end());
  start_velocity_.assign(velocity_m_per_s.begin(), velocity_m_per_s.end());
  was_implicit_ = begins_implicit();
  if (!was_implicit_) {
    constraints_.begin(constraints, position_world_m, substeps_);
    was_implicit_ = !explicit_step(position_world_m, velocity_m_per_s);
  }
  if (was_implicit_) {
    implicit_steps_ += integrator_ == VolumeIntegrator::automatic;
    std::ranges::copy(start_position_, position_world_m.begin());
    std::ranges::copy(start_velocity_, velocity_m_per_s.begin());
    implicit_step(position_world_m, velocity_m_per_s, constraints, reactions);
  } else {
    constraints_.finish(reactions);
  }
}

bool TetSolid::explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  const double h = settings_.step_s / substeps_;
  const VelocityUpdate update = velocity_update(h);
  for (int substep = 0; substep < substeps_; ++substep) {
    const bool look = substep % kBoundEvery == 0;
    const double bound = double{update_pressures(rows_, look, position_world_m)};
    if (look) {
      margin_ = damped_limit_s(omega2_per_bound_ * bound, material_.damping_per_s) / h;
      if (!(margin_ >= kLeastMargin)) return false;
    }
    const VelocityOutcome outcome = update_velocities(rows_, update, position_world_m, velocity_m_per_s);
    if (outcome.clamped > 0 || outcome.not_finite != kNone) return false;
    update_positions(static_cast<float>(h), velocity_m_per_s, position_world_m);
    constraints_.project_substep(substep, h, body_.inverse_mass(), position_world_m, velocity_m_per_s);
  }
  return true;
}

void TetSolid::implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                             std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  masses_.resize(body_.vertex_count());
  for (VertexId v = 0; v < masses_.size(); ++v) masses_[v] = body_.mass_kg(v);
  corners_of(constraints, corners_);
  driver_.step(energy_, motion(), {masses_, body_.inverse_mass(), position_world_m, velocity_m_per_s}, constraints,
               corners_, reactions, [this](double step_s, std::span<const Vec3> inertial, std::span<Vec3> position) {
                 smooth(step_s, inertial, position);
               });
}

// Held vertices stay where they are, and what isn't finite where it was.
void TetSolid::smooth(double step_s, std::span<const Vec3> inertial_world_m, std::span<Vec3> position_world_m) {
  inertial_.assign(inertial_world_m.size(), Vec4f::Zero());
  smoothed_ = inertial_;
  for (std::size_t v = 0; v < inertial_.size(); ++v) {
    inertial_[v].head<3>() = inertial_world_m[v].cast<float>();
    smoothed_[v].head<3>() = position_world_m[v].cast<float>();
  }
  update_pressures(rows_, false, smoothed_);
  const std::span<float> scratch(scratch_.data()->bulk.data(), scratch_.size() * kLanes);
  for (int n = 0; n < kSmoothing; ++n) descend(rows_, static_cast<float>(step_s), inertial_, smoothed_, scratch);
  for (std::size_t v = 0; v < inertial_.size(); ++v)
    if (body_.inverse_mass()[v] > 0 && smoothed_[v].head<3>().allFinite())
      position_world_m[v] = smoothed_[v].head<3>().cast<double>();
}

double TetSolid::elastic_energy_j(std::span<const Vec4f> position_world_m) const {
  const TetMesh& mesh = body_.mesh();
  std::vector<double> volume(body_.vertex_count(), 0), rest(volume), bulk(volume);
  double energy = 0;
  const auto at = [&](VertexId v) -> Vec3 { return position_world_m[v].head<3>().cast<double>(); };
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& c = mesh.tetrahedra[t];
    if (c == kNoTetrahedron) continue;
    const TetShape shape = tet_shape(mesh, c);
    Mat3 f = Mat3::Zero();
    for (std::size_t k = 0; k < 4; ++k) f += at(c[k]) * shape.gradient[k].transpose();
    const double j = f.determinant();
    energy += shape.volume_m3 * stiffness_.shear_pa[t] * (0.5 * (f.squaredNorm() - 3) - (j - 1));
    for (const VertexId v : c) {
      volume[v] += j * shape.volume_m3;
      rest[v] += shape.volume_m3;
      bulk[v] += stiffness_.bulk_pa[t] * shape.volume_m3;
    }
  }
  for (VertexId v = 0; v < volume.size(); ++v) {
    if (!(rest[v] > 0)) continue;
    const double strain = volume[v] / rest[v] - 1;
    energy += 0.25 * 0.5 * bulk[v] * strain * strain;
  }
  return energy;
}

void TetSolid::elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const {
  TetRows rows = rows_;
  const std::vector<TetVertex> unit(body_.vertex_count(), TetVertex{1, 0});
  rows.set(unit, 1);
  std::vector<Vec4f> x(position_world_m.begin(), position_world_m.end()), v(x.size(), Vec4f::Zero());
  update_pressures(rows, false, x);
  VelocityUpdate update;
  update.max_speed_m_per_s = 1e18f;
  update_velocities(rows, update, x, v);
  for (std::size_t i = 0; i < force_n.size(); ++i) force_n[i] = v[i].head<3>().cast<double>();
}

double TetSolid::objective_j(std::span<const Vec4f> position_world_m, std::span<const Vec4f> inertial_world_m,
                             double step_s) const {
  double inertia = 0;
  for (VertexId v = 0; v < body_.vertex_count(); ++v)
    inertia += body_.mass_kg(v) * (position_world_m[v] - inertial_world_m[v]).head<3>().cast<double>().squaredNorm();
  return inertia / (2 * step_s * step_s) + elastic_energy_j(position_world_m);
}

std::vector<Vec3> TetSolid::sag_m(const Vec3& gravity_body_m_per_s2) {
  std::vector<double> mass_kg;
  for (VertexId v = 0; v < body_.vertex_count(); ++v) mass_kg.push_back(body_.mass_kg(v));
  return sectio::sag_m(energy_, mesh().vertices_body_m, mass_kg, body_.inverse_mass(), gravity_body_m_per_s2);
}

}  // namespace sectio
