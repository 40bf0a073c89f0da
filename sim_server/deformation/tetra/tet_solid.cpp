#include "sim_server/deformation/tetra/tet_solid.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "common/math/lame.h"

namespace sectio {
namespace {

// The share of the stable step at rest that is used. Deformation stiffens a nearly incompressible solid, the more the
// closer Poisson's ratio is to 1/2.
double safety(double poisson) {
  return poisson > 0.47 ? 0.45 : 0.6;
}
// The margin beyond the rigorous bound at rest, which is itself 1.4 to 1.9 times too careful.
constexpr double kRoomForDeformation = 1.05;

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
  for (VertexId v = 0; v < vertices && settings_.least_substep_s > 0; ++v) {
    star_.begin(mesh, body_.stars(), v);
    star_.measure(mesh);
    weigh(v, star_, settings_.least_substep_s);
  }
  const double omega2 = largest_omega2_at_rest(mesh, stiffness_, body_.inverse_mass());
  explicit_limit_s_ = safety(material_.poisson) * damped_limit_s(omega2, material_.damping_per_s);
  substeps_ = substeps_for(explicit_limit_s_);
  rows_.build(body_.mesh(), body_.stars(), stiffness_);
  std::vector<TetVertex> rows(vertices);
  for (VertexId v = 0; v < vertices; ++v) rows[v] = row_of(v);
  rows_.set(rows, settings_.step_s / substeps_);
  scratch_.resize(3 * rows_.most_faces() + 1);
  std::vector<Vec4f> rest(vertices, Vec4f::Zero());
  for (VertexId v = 0; v < vertices; ++v) rest[v].head<3>() = mesh.vertices_body_m[v].cast<float>();
  const double bound = double{update_pressures(rows_, true, rest)};
  omega2_per_bound_ = bound > 0 ? omega2 / bound : 0;
  last_velocity_.assign(vertices, Vec4f::Zero());
  give_room(stiffness_.shear_pa, stiffness_.bulk_pa, last_velocity_);
}

// Adds mass until the vertex is stable in substeps of this length.
void TetSolid::weigh(VertexId v, const VertexStar& star, double substep_s) {
  if (body_.fixed(v)) return;
  const double h = kRoomForDeformation * substep_s;
  body_.weigh_at_least(v, 0.25 * h * h * stiffness_bound_n_per_m(star, stiffness_));
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
    weigh(v, star_, std::max(settings_.least_substep_s, settings_.step_s / substeps_));
    rows_.set(v, row_of(v));
  }
  rows_.compact_if_spread();
  scratch_.resize(3 * rows_.most_faces() + 1);
  resize_slots<Vec4f>(last_velocity_, body_.vertex_count(), Vec4f::Zero());
}

void TetSolid::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                    std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  start_position_.assign(position_world_m.begin(), position_world_m.end());
  start_velocity_.assign(velocity_m_per_s.begin(), velocity_m_per_s.end());
  was_implicit_ = integrator_ == VolumeIntegrator::implicit_only;
  if (!was_implicit_) {
    constraints_.begin(constraints, position_world_m, substeps_);
    was_implicit_ = !explicit_step(position_world_m, velocity_m_per_s);
  }
  if (was_implicit_) {
    implicit_steps_ += integrator_ == VolumeIntegrator::automatic;
    std::ranges::copy(start_position_, position_world_m.begin());
    std::ranges::copy(start_velocity_, velocity_m_per_s.begin());
    implicit_step(position_world_m, velocity_m_per_s, settings_.step_s, kSweeps, constraints, reactions);
  } else {
    constraints_.finish(reactions);
  }
  last_velocity_.swap(start_velocity_);
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

// m / h^2 + sum_e V (mu |g|^2 + kappa c c^T), c = cof(F) g: the Hessian of the quadratic that descend() minimises.
Mat3 TetSolid::block_n_per_m(VertexId v, std::span<const Vec4f> position_world_m, double step_s) const {
  Mat3 block = 1 / (body_.inverse_mass()[v] * step_s * step_s) * Mat3::Identity();
  for (const std::uint32_t t : body_.stars().of(v)) {
    const Tetrahedron& corners = body_.mesh().tetrahedra[t];
    const std::size_t i = static_cast<std::size_t>(std::ranges::find(corners, v) - corners.begin());
    const TetShape shape = tet_shape(body_.mesh(), corners);
    std::array<Vec3, 3> x;
    for (std::size_t k = 0; k < 3; ++k) x[k] = position_world_m[corners[kTetFaces[i][k]]].head<3>().cast<double>();
    const Vec3 normal = (x[1] - x[0]).cross(x[2] - x[0]) / 6;  // V c = d(volume) / dx, up to its sign
    block += shape.volume_m3 * stiffness_.shear_pa[t] * shape.gradient[i].squaredNorm() * Mat3::Identity() +
             stiffness_.bulk_pa[t] / shape.volume_m3 * normal * normal.transpose();
  }
  return block;
}

void TetSolid::implicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, double step_s,
                             int sweeps, std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  const double h = step_s;
  const ImplicitStart start(h, material_.damping_per_s, settings_.gravity_m_per_s2);
  inertial_.resize(position_world_m.size());
  start_position_.assign(position_world_m.begin(), position_world_m.end());
  for (VertexId v = 0; v < inertial_.size(); ++v) {
    inertial_[v] = position_world_m[v];
    if (body_.inverse_mass()[v] == 0) continue;
    const auto [inertial_m, guess_m] =
        start.displacements(velocity_m_per_s[v].head<3>().cast<double>(), last_velocity_[v].head<3>().cast<double>());
    inertial_[v].head<3>() += inertial_m.cast<float>();
    position_world_m[v].head<3>() += guess_m.cast<float>();
  }
  update_pressures(rows_, false, position_world_m);
  const std::span<float> scratch(scratch_.data()->bulk.data(), scratch_.size() * kLanes);
  corners_of(constraints, corners_);
  held_.begin(constraints, corners_, body_.inverse_mass(), h);
  const HeldPoints::Particles particles{
      [&](VertexId v) -> Vec3 { return position_world_m[v].head<3>().cast<double>(); },
      [&](VertexId v) { return block_n_per_m(v, position_world_m, h); },
      [&](VertexId v, const Vec3& position_by_m, const Vec3& inertial_by_m) {
        position_world_m[v].head<3>() += position_by_m.cast<float>();
        inertial_[v].head<3>() += inertial_by_m.cast<float>();
      }};
  for (int n = 0; n < sweeps; ++n) {
    const float moved2 = descend(rows_, static_cast<float>(h), inertial_, position_world_m, scratch);
    residual_m_ = std::sqrt(double{moved2});
    if (held_.put(particles))
      update_pressures(rows_, false, position_world_m);
    else if (moved2 < static_cast<float>(kStill_m * kStill_m))
      break;
  }
  for (VertexId v = 0; v < inertial_.size(); ++v) {
    if (body_.inverse_mass()[v] == 0) continue;
    const auto displacement = within_speed((position_world_m[v] - start_position_[v]).head<3>().cast<double>(), h);
    if (!displacement && first_bad_vertex_ == kNone) first_bad_vertex_ = v;
    const Vec3 moved = displacement.value_or(Vec3::Zero());
    position_world_m[v].head<3>() = start_position_[v].head<3>() + moved.cast<float>();
    velocity_m_per_s[v].head<3>() = (moved / h).cast<float>();
  }
  held_.finish(velocity_m_per_s, reactions);
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

}  // namespace sectio
