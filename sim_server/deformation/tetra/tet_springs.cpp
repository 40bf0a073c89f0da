#include "sim_server/deformation/tetra/tet_springs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/error.h"
#include "sim_server/deformation/sag.h"
#include "sim_server/deformation/spring_star.h"

namespace sectio {
namespace {

using Spring = TetSprings::Spring;

constexpr double kRoomForDamping = 1.05;
constexpr double kLeastSecondLength = 0.3;  // shortest spring between second neighbours, in mean lengths of edges

}  // namespace

TetSprings::TetSprings(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
                       const TetSpringOptions& options)
    : VolumeModel(material, std::move(settings)),
      body_(mesh, material, settings_.fixed),
      options_(options),
      net_(body_, material, options.second_share) {
  if (options_.second_share > 0) {
    double length_m = 0;
    const auto edges = static_cast<double>(edge_count());
    for (const Spring& s : springs()) length_m += s.rest_length_m / edges;
    if (!(options_.least_second_m > 0)) options_.least_second_m = kLeastSecondLength * length_m;
    net_.find_second(options_.least_second_m);
  }
  if (options_.calibrate && !material_.stiffness_factor.empty()) {
    // Young's modulus is that of tissue with factor 1, so the net is tested as if all tissue had this factor.
    VolumeMaterial even = material_;
    even.stiffness_factor.clear();
    const TetSprings net(mesh, even, settings_, options_);
    options_ = net.options_;
    as_made_ = net.as_made_;
    calibrated_ = net.calibrated_;
  } else if (options_.calibrate) {
    as_made_ = tensile_test(mesh, springs());
    options_.correction *= material_.young_pa / as_made_.mean_young_pa;
    calibrated_ = tensile_test(mesh, springs());
  }
  std::vector<VertexId> all(body_.vertex_count());
  std::iota(all.begin(), all.end(), VertexId{0});
  omega2_.set(with_room(all.size()), 0);
  settings_.least_substep_s = body_.weigh_for(settings_.least_substep_s, [&](double substep_s) {
    weigh_all(all, substep_s, [](VertexId, const SpringsAtVertex&) {});
  });
  substeps_ = substeps_for(substep_limit_s());
  std::vector<std::uint32_t> degree;
  degree.reserve(all.size());
  for (const VertexId v : all) degree.push_back(static_cast<std::uint32_t>(net_.degree(v)));
  rows_.layout(degree);
  for (const VertexId v : all) {
    net_.springs_at(v, options_.correction, at_);
    write(v, at_);
    write_mass(v);
  }
}

std::vector<TetSprings::Spring> TetSprings::springs() const {
  std::vector<Spring> springs, second;
  SpringsAtVertex at;
  for (VertexId v = 0; v < body_.vertex_count(); ++v) {
    net_.springs_at(v, options_.correction, at);
    const std::vector<bool> edge = net_.edges_at(v);
    for (std::size_t n = 0; n < at.to.size(); ++n)
      if (at.to[n] > v) (edge[n] ? springs : second).push_back({v, at.to[n], at.stiffness(n), at.length(n)});
  }
  springs.insert(springs.end(), second.begin(), second.end());
  return springs;
}

void TetSprings::weigh(std::span<const VertexId> rows, const FourSymmetric& sum_n_per_m, double substep_s) {
  const Eigen::Array4d bounds = largest_eigenvalue_bounds(sum_n_per_m);
  const double h = kRoomForDamping * substep_s / kSafety;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const VertexId v = rows[n];
    const double stiffness = 2 * bounds[static_cast<Eigen::Index>(n)];
    if (!body_.fixed(v)) body_.weigh_at_least(v, 0.25 * h * h * stiffness);
    omega2_.set(v, stiffness * body_.inverse_mass()[v]);
  }
}

void TetSprings::write(VertexId v, const SpringsAtVertex& springs) {
  half_edges_.clear();
  for (std::size_t n = 0; n < springs.to.size(); ++n)
    half_edges_.push_back({springs.to[n], static_cast<float>(springs.stiffness(n)),
                           static_cast<float>(springs.stiffness(n) * springs.length(n))});
  rows_.set(v, {}, half_edges_);
}

// Writes the springs of a row whose other ends have changed, where v itself has not.
void TetSprings::write_changed(VertexId v, const SpringsAtVertex& springs) {
  for (std::uint32_t n = 0; n < springs.to.size(); ++n)
    if (net_.has_changed(springs.to[n]))
      rows_.set_constants(v, n, static_cast<float>(springs.stiffness(n)),
                          static_cast<float>(springs.stiffness(n) * springs.length(n)));
}

void TetSprings::write_mass(VertexId v) {
  const double inverse = body_.inverse_mass()[v];
  rows_.set_mass(v, static_cast<float>(settings_.step_s / substeps_ * inverse),
                 static_cast<float>(body_.mass_kg(v) * inverse));
}

template <class With>
void TetSprings::weigh_all(std::span<const VertexId> rows, double substep_s, const With& with_springs) {
  for (std::size_t first = 0; first < rows.size(); first += 4) {
    const std::span four = rows.subspan(first, std::min<std::size_t>(4, rows.size() - first));
    FourSymmetric sums;
    sums.fill(Eigen::Array4d::Zero());
    for (std::size_t n = 0; n < four.size(); ++n) {
      net_.springs_at(four[n], options_.correction, at_);
      with_springs(four[n], at_);
      const auto sum = at_.sum_n_per_m();
      for (std::size_t k = 0; k < sum.size(); ++k) sums[k][static_cast<Eigen::Index>(n)] = sum[k];
    }
    weigh(four, sums, substep_s);
  }
}

void TetSprings::change(const TetChange& change) {
  net_.follow(body_, body_.follow(change));
  weigh_all(net_.reached(), part_s(substeps_), [&](VertexId v, const SpringsAtVertex& springs) {
    if (springs.to.empty())
      rows_.remove(v);
    else if (net_.has_changed(v))
      write(v, springs);
    else
      write_changed(v, springs);
  });
  for (const VertexId v : net_.reached())
    if (rows_.contains(v)) write_mass(v);
  while (body_.is_heavy() && may_divide()) divide();
  if (rows_.wants_compaction()) rows_.compact();
}

// Twice as many substeps, which need a quarter of the added mass.
void TetSprings::divide() {
  ++divided_;
  substeps_ *= 2;
  body_.shed_added_mass();
  std::vector<VertexId> all;
  for (VertexId v = 0; v < body_.vertex_count(); ++v)
    if (rows_.contains(v)) all.push_back(v);
  weigh_all(all, part_s(substeps_), [](VertexId, const SpringsAtVertex&) {});
  for (const VertexId v : all) write_mass(v);
}

void TetSprings::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                      std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  was_implicit_ = substep_limit_s() / kSafety < settings_.step_s / substeps_ || (stable_for_ > 0 && stable_for_-- > 0);
  if (!was_implicit_) {
    start_position_.assign(position_world_m.begin(), position_world_m.end());
    start_velocity_.assign(velocity_m_per_s.begin(), velocity_m_per_s.end());
    constraints_.begin(constraints, position_world_m, substeps_);
    if (explicit_step(position_world_m, velocity_m_per_s)) return constraints_.finish(reactions);
    was_implicit_ = true;
    std::ranges::copy(start_position_, position_world_m.begin());
    std::ranges::copy(start_velocity_, velocity_m_per_s.begin());
  }
  ++implicit_steps_;
  masses_.resize(body_.vertex_count());
  for (VertexId v = 0; v < masses_.size(); ++v) masses_[v] = body_.mass_kg(v);
  corners_of(constraints, corners_);
  energy_.read(rows_, body_.vertex_count());
  driver_.step(energy_, {settings_.step_s, material_.damping_per_s, settings_.gravity_m_per_s2, kMaxSpeed_m_per_s},
               {masses_, body_.inverse_mass(), position_world_m, velocity_m_per_s}, constraints, corners_, reactions);
}

// False when the step must be undone.
bool TetSprings::explicit_step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  const double h = settings_.step_s / substeps_;
  VelocityUpdate update = velocity_update(h);
  update.damper_s = static_cast<float>(options_.damper_s);
  for (int substep = 0; substep < substeps_; ++substep) {
    if (options_.damper_s > 0) {
      before_.assign(velocity_m_per_s.begin(), velocity_m_per_s.end());
      update.velocity_before = before_;
    }
    const VelocityOutcome outcome = update_velocities(rows_, update, position_world_m, velocity_m_per_s);
    clamped_ += outcome.clamped;
    if (outcome.clamped > 0 || outcome.not_finite != kNone) return false;
    update_positions(static_cast<float>(h), velocity_m_per_s, position_world_m);
    constraints_.project_substep(substep, h, body_.inverse_mass(), position_world_m, velocity_m_per_s);
  }
  return true;
}

double TetSprings::elastic_energy_j(std::span<const Vec4f> position_world_m) const {
  double energy = 0;
  for (const Spring& s : springs()) {
    const double l = (position_world_m[s.b] - position_world_m[s.a]).head<3>().cast<double>().norm();
    energy += 0.5 * s.stiffness_n_per_m * (l - s.rest_length_m) * (l - s.rest_length_m);
  }
  return energy;
}

void TetSprings::elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const {
  SpringRows rows = rows_;
  for (VertexId v = 0; v < body_.vertex_count(); ++v) {
    if (!rows_.contains(v)) continue;
    std::vector<HalfEdge> half_edges;
    for (std::uint32_t n = 0; n < rows_.degree(v); ++n) half_edges.push_back(rows_.half_edge(v, n));
    VertexRow row;
    row.step_over_mass = 1;
    rows.set(v, row, half_edges);
  }
  std::vector<Vec4f> velocity(force_n.size(), Vec4f::Zero());
  VelocityUpdate update;
  update.max_speed_m_per_s = 1e18f;
  update_velocities(rows, update, position_world_m, velocity);
  for (std::size_t v = 0; v < force_n.size(); ++v) force_n[v] = velocity[v].head<3>().cast<double>();
}

TensileTest tensile_test(const TetMesh& mesh, std::span<const Spring> springs) {
  const std::size_t n = mesh.vertices_body_m.size();
  std::vector<TetShape> shapes;
  double volume = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    shapes.push_back(tet_shape(mesh, t));
    volume += shapes.back().volume_m3;
  }
  using Field = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  const auto size = static_cast<Eigen::Index>(n);
  std::vector<Vec3> direction;
  for (const Spring& s : springs)
    direction.push_back((mesh.vertices_body_m[s.b] - mesh.vertices_body_m[s.a]) / s.rest_length_m);
  const auto stiffness_times = [&](const Field& u) {
    Field out = Field::Zero(size, 3);
    for (std::size_t k = 0; k < springs.size(); ++k) {
      const Spring& s = springs[k];
      const double along = s.stiffness_n_per_m * (u.row(s.b) - u.row(s.a)).dot(direction[k].transpose());
      out.row(s.a) -= along * direction[k].transpose();
      out.row(s.b) += along * direction[k].transpose();
    }
    return out;
  };
  TensileTest test;
  double compliance = 0, poisson = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    // The forces of a uniform unit stress along the axis are in equilibrium on any shape.
    Field r = Field::Zero(size, 3);
    for (std::size_t t = 0; t < shapes.size(); ++t)
      for (std::size_t k = 0; k < 4; ++k)
        r(mesh.tetrahedra[t][k], axis) += shapes[t].volume_m3 * shapes[t].gradient[k][axis];
    Field u = Field::Zero(size, 3), p = r;
    double r2 = r.squaredNorm();
    const double enough = 1e-12 * r2;
    for (int i = 0; i < 2000 && r2 > enough; ++i) {
      const Field kp = stiffness_times(p);
      const double step = r2 / p.cwiseProduct(kp).sum();
      u += step * p;
      r -= step * kp;
      const double next = r.squaredNorm();
      p = r + (next / r2) * p;
      r2 = next;
    }
    Vec3 strain = Vec3::Zero();
    for (std::size_t t = 0; t < shapes.size(); ++t)
      for (std::size_t k = 0; k < 4; ++k)
        strain +=
            shapes[t].volume_m3 / volume * u.row(mesh.tetrahedra[t][k]).transpose().cwiseProduct(shapes[t].gradient[k]);
    test.young_pa[static_cast<std::size_t>(axis)] = 1 / strain[axis];
    compliance += strain[axis] / 3;
    poisson -= (strain.sum() - strain[axis]) / (2 * strain[axis]) / 3;
  }
  test.mean_young_pa = 1 / compliance;
  test.mean_poisson = poisson;
  return test;
}

std::vector<Vec3> TetSprings::sag_m(const Vec3& gravity_body_m_per_s2) {
  std::vector<double> mass_kg;
  for (VertexId v = 0; v < body_.vertex_count(); ++v) mass_kg.push_back(body_.mass_kg(v));
  energy_.read(rows_, body_.vertex_count());
  return sectio::sag_m(energy_, mesh().vertices_body_m, mass_kg, body_.inverse_mass(), gravity_body_m_per_s2);
}

}  // namespace sectio
