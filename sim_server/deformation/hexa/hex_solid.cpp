#include "sim_server/deformation/hexa/hex_solid.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/error.h"
#include "common/math/lame.h"
#include "sim_server/deformation/hexa/hex_at_rest.h"
#include "sim_server/deformation/sag.h"
#include "sim_server/deformation/shape_matching.h"

namespace sectio {
namespace {

constexpr double kSafety = 0.8;       // share of the bound at rest that is used: leaves room for deformation
constexpr int kMostRefined = 4;       // most substeps, in multiples of those at rest
constexpr double kSlightFill = 1e-3;  // material at a node, as a share of a cell's, that the integrator disregards
constexpr double kRounding = 1e-9;

HexMaterial hex_material_of(const VolumeMaterial& m) {
  const auto [mu, lambda] = lame(m.young_pa, m.poisson);
  return {mu, lambda + mu, m.density_kg_per_m3};
}

}  // namespace

HexSolid::HexSolid(const TetMesh& mesh, const Grid& grid, const VolumeMaterial& material, VolumeSettings settings,
                   VolumeIntegrator integrator, const HexSolid* from)
    : ExplicitImplicitIntegrator(material, std::move(settings), integrator),
      body_(mesh, material, settings_.fixed),
      hex_material_(hex_material_of(material)),
      maker_(grid) {
  std::vector<std::uint32_t> all(mesh.tetrahedra.size());
  std::iota(all.begin(), all.end(), 0u);
  maker_.look_at(all, mesh, body_.stars(), is_fixed());
  build();
  if (from) {
    inherit(*from->lattice_, cells_before(*lattice_, *from->lattice_, from->mesh()), from->position_, from->velocity_);
    placed_ = from->placed_;
    rest_world_ = from->rest_world_;
    descent_->set_homes(rest_world_);
  } else {
    bound_ = weight_.size();
  }
  share_masses();
}

void HexSolid::change(const TetChange& change) {
  const std::unique_ptr<HexLattice> lattice = std::move(lattice_);
  const std::vector<Vec4f> position = std::move(position_), velocity = std::move(velocity_);
  body_.follow(change);
  if (!change.added_body_m.empty()) bound_ = std::min<std::size_t>(bound_, change.first_added);
  beside_.resize(std::min(beside_.size(), bound_));
  std::vector<std::uint32_t> touched;
  for (const TetEdit& e : change.tetrahedra) touched.push_back(e.id);
  maker_.look_at(touched, mesh(), body_.stars(), is_fixed());
  build();
  const auto origin = [&](std::uint32_t t) {
    const auto at = std::ranges::lower_bound(change.tetrahedra, t, {}, &TetEdit::id);
    return at != change.tetrahedra.end() && at->id == t ? at->origin : t;
  };
  inherit(*lattice, cells_before(*lattice_, *lattice, origin), position, velocity);
  descent_->set_homes(rest_world_);
  share_masses();
  driver_.forget();  // nodes have other numbers
}

// The lattice follows from the tetrahedra, and the springs that hold it from the lattice.
void HexSolid::archive(Archive& a) {
  archive_settings(a);
  Grid grid = maker_.grid();
  a(body_, grid.origin_m, grid.cell_m, beside_);
  if (a.reads()) {
    maker_ = LatticeMaker(grid);
    std::vector<std::uint32_t> all(mesh().tetrahedra.size());
    std::iota(all.begin(), all.end(), 0u);
    maker_.look_at(all, mesh(), body_.stars(), is_fixed());
    build();
  }
  archive_integrator(a);
  a(vertex_inverse_, bound_, last_substeps_, bad_, placed_, rest_world_, position_, velocity_, written_position_,
    written_velocity_);
  if (a.reads()) descent_->set_homes(rest_world_);
}

IntegratorDiagnostics HexSolid::diagnostics() const {
  IntegratorDiagnostics d = ExplicitImplicitIntegrator::diagnostics();
  d.added_mass_fraction = added_mass_fraction_;
  return d;
}

LatticeMaker::IsFixed HexSolid::is_fixed() const {
  if (std::ranges::find(settings_.fixed, std::uint8_t{1}) == settings_.fixed.end()) return {};
  return [this](VertexId v) { return body_.fixed(v); };
}

// Rebuilds all data that depends on the tetrahedra.
void HexSolid::build() {
  lattice_ =
      std::make_unique<HexLattice>(maker_.make(mesh(), [&](std::uint32_t t) { return body_.stiffness_factor(t); }));
  const double h = lattice_->grid.cell_m;
  rows_ = rows_of(*lattice_, hex_material_);
  node_mass_.assign(lattice_->nodes.size(), 0);
  for (const HexCell& cell : lattice_->cells)
    for (const std::uint32_t n : cell.nodes) node_mass_[n] += cell.fill * h * h * h * material_.density_kg_per_m3 / 8;
  weight_.resize(lattice_->points.size());
  beside_.resize(weight_.size(), Vec3::Zero());
  for (VertexId v = 0; v < weight_.size(); ++v) weigh_corners(v);
  const double omega2 = omega2_at_rest(hex_material_, h, rows_.stiffest);
  explicit_limit_s_ = kSafety * damped_limit_s(omega2, material_.damping_per_s);
  substeps_ = last_substeps_ = substeps_for(explicit_limit_s_);
  position_.assign(node_mass_.size(), Vec4f::Zero());
  velocity_ = force_ = position_;
  written_position_.clear();
  hold_nodes(omega2);
}

// Nodes that springs hold get the mass that keeps the springs' frequency below `omega2`; it isn't added mass of tissue.
void HexSolid::hold_nodes(double omega2) {
  std::vector<std::uint8_t> held(node_mass_.size(), 0);
  HexTies ties(clamps_of(*lattice_, material_.young_pa, held), *lattice_);
  find_held(held);
  const std::vector<double> row_sums = ties.row_sums_n_per_m(held.size());
  free_mass_ = effective_masses(*lattice_);
  const double cell_kg = std::pow(lattice_->grid.cell_m, 3) * material_.density_kg_per_m3;
  double kg = 0, added_kg = 0;
  weightless_.clear();
  for (std::size_t n = 0; n < held.size(); ++n) {
    kg += node_mass_[n];
    added_kg += free_mass_[n] * cell_kg - node_mass_[n];
    free_mass_[n] = held[n] != 0 ? 0 : free_mass_[n] * cell_kg + row_sums[n] / omega2;
    if (const double more_kg = free_mass_[n] - node_mass_[n]; more_kg > kRounding * node_mass_[n])
      weightless_.push_back({static_cast<std::uint32_t>(n), static_cast<float>(more_kg)});
  }
  added_mass_fraction_ = kg > 0 ? added_kg / kg : 0;
  descent_ = std::make_unique<HexDescent>(*lattice_, hex_material_, std::move(ties));
  invert_masses();
}

void HexSolid::find_held(std::vector<std::uint8_t>& held) const {
  const TetMesh& mesh = body_.mesh();
  const auto fixed = [&](VertexId v) { return body_.fixed(v); };
  const auto in_fixed_element = [&](VertexId v) {
    return std::ranges::any_of(body_.stars().of(v), [&](std::uint32_t t) {
      const auto& c = mesh.tetrahedra[t];
      const auto count = std::ranges::count_if(c, fixed);
      const auto outside = std::ranges::count_if(c, [&](VertexId w) { return fixed(w) && lattice_->outside[w] != 0; });
      return count == 4 || outside == 3;
    });
  };
  for (VertexId v = 0; v < weight_.size(); ++v) {
    if (!fixed(v) || body_.stars().of(v).empty() || in_fixed_element(v)) continue;
    const auto most = static_cast<std::size_t>(std::ranges::max_element(weight_[v]) - weight_[v].begin());
    held[lattice_->cells[lattice_->points[v].cell].nodes[most]] = 1;
  }
  // Nodes of fixed tissue alone.
  for (std::size_t n = 0; n < held.size(); ++n)
    if (node_mass_[n] == 0) held[n] = 1;
}

void HexSolid::invert_masses() {
  inverse_mass_.clear();
  inverse_mass_float_.clear();
  for (const double m : free_mass_) {
    inverse_mass_.push_back(m > 0 ? 1 / m : 0);
    inverse_mass_float_.push_back(static_cast<float>(inverse_mass_.back()));
  }
}

void HexSolid::inherit(const HexLattice& lattice, std::span<const std::uint32_t> from,
                       const std::vector<Vec4f>& position, const std::vector<Vec4f>& velocity) {
  for (std::uint32_t e = 0; e < from.size(); ++e) {
    const HexCell &cell = lattice_->cells[e], &old = lattice.cells[from[e]];
    for (std::size_t c = 0; c < 8; ++c) {
      const std::uint32_t node = cell.nodes[c];
      if (cell.place == old.place) {
        position_[node] = position[old.nodes[c]];
        velocity_[node] = velocity[old.nodes[c]];
      } else if (position_[node].isZero(0)) {  // a new place: extrapolate from the cell beside it
        HexPoint point;
        for (std::size_t k = 0; k < 3; ++k)
          point.local[static_cast<Eigen::Index>(k)] = lattice_->nodes[node][k] - old.place[k];
        for (std::size_t n = 0; n < 8; ++n) {
          position_[node] += static_cast<float>(point.weight(n)) * position[old.nodes[n]];
          velocity_[node] += static_cast<float>(point.weight(n)) * velocity[old.nodes[n]];
        }
      }
    }
  }
}

void HexSolid::restore(std::span<const Vec4f> nodes_world_m, const Pose& frame, std::span<Vec4f> position_world_m,
                       std::span<Vec4f> velocity_m_per_s) {
  const bool known = nodes_world_m.size() == position_.size();
  for (std::uint32_t n = 0; n < position_.size(); ++n) {
    if (known)
      position_[n] = nodes_world_m[n];
    else
      position_[n].head<3>() = frame.to_world(lattice_->rest_m(n)).cast<float>();
    velocity_[n] = force_[n] = Vec4f::Zero();
  }
  placed_ = true;
  bad_ = false;
  driver_.forget();
  bound_ = weight_.size();
  write_vertices(position_world_m, velocity_m_per_s);
}

void HexSolid::support(std::span<const PointConstraint> constraints) {
  supports_.clear();
  for (const PointConstraint& constraint : constraints) {
    for (std::size_t a = 0; a < 3; ++a) {
      const VertexId v = constraint.v[a];
      if (v == kNone) continue;
      const HexCell& cell = lattice_->cells[lattice_->points[v].cell];
      for (std::size_t c = 0; c < 8; ++c)
        if (std::abs(double{weight_[v][c]}) > kSlight)
          supports_.add(cell.nodes[c], constraint.w[a] * double{weight_[v][c]});
    }
    supports_.finish();
  }
}

void HexSolid::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                    std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  take_up(position_world_m, velocity_m_per_s);
  support(constraints);
  start_position_ = position_;
  start_velocity_ = velocity_;
  const auto back_to_start = [&] {
    position_ = start_position_;
    velocity_ = start_velocity_;
  };
  was_implicit_ = begins_implicit();
  for (int substeps = substeps_; !was_implicit_;) {
    constraints_.begin(constraints, supports_, position_, substeps);
    last_substeps_ = substeps;
    const int needed = explicit_step(substeps);
    if (needed == 0) break;
    back_to_start();
    was_implicit_ = needed > kMostRefined * substeps_ || substeps >= kMostRefined * substeps_;
    substeps = std::min(kMostRefined * substeps_, std::max(needed, 2 * substeps));
  }
  if (was_implicit_) {
    implicit_steps_ += integrator_ == VolumeIntegrator::automatic;
    implicit_step(constraints, reactions);
  } else {
    constraints_.finish(reactions);
  }
  write_vertices(position_world_m, velocity_m_per_s);
}

int HexSolid::explicit_step(int substeps) {
  const double h = settings_.step_s / substeps;
  const VelocityUpdate update = velocity_update(h);
  const double cell_kg = std::pow(lattice_->grid.cell_m, 3) * material_.density_kg_per_m3;
  const auto slight_kg = static_cast<float>(kSlightFill * cell_kg);
  const Vec3f gravity = settings_.gravity_m_per_s2.cast<float>();
  std::ranges::fill(force_, Vec4f::Zero());
  for (int substep = 0; substep < substeps; ++substep) {
    const bool look = substep % kBoundEvery == 0;
    const double omega2 = double{add_forces(rows_, look, position_, force_)};
    descent_->ties().add_forces(position_, force_);
    for (const auto& [node, kg] : weightless_) force_[node].head<3>() -= kg * gravity;
    if (look) {
      margin_ = damped_limit_s(omega2, material_.damping_per_s) / h;
      const double limit = margin_ * h / kLeastMargin;
      if (!(limit >= h))
        return limit > 0 ? static_cast<int>(std::min(1e6, std::ceil(settings_.step_s / limit))) : 1 << 20;
    }
    const VelocityOutcome outcome =
        move_nodes(update, static_cast<float>(h), slight_kg, inverse_mass_float_, force_, velocity_, position_);
    if (outcome.clamped > 0 || outcome.not_finite != kNone) return 1 << 20;
    constraints_.project_substep(substep, h, inverse_mass_, position_, velocity_);
  }
  return 0;
}

void HexSolid::implicit_step(std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  driver_.step(*descent_, motion(), {node_mass_, inverse_mass_, position_, velocity_}, constraints, supports_,
               reactions, [this](double step_s, std::span<const Vec3> inertial, std::span<Vec3> position) {
                 for (int n = 0; n < kSmoothing; ++n) descent_->sweep(step_s, free_mass_, inertial, position);
               });
}

double HexSolid::elastic_energy_j(std::span<const Vec4f> node_position_world_m) const {
  std::vector<Vec3> x;
  for (const Vec4f& p : node_position_world_m) x.push_back(p.head<3>().cast<double>());
  return descent_->elastic_energy_j(x);
}

void HexSolid::elastic_forces_n(std::span<const Vec4f> node_position_world_m, std::span<Vec3> force_n) const {
  std::vector<Vec4f> force(node_position_world_m.size(), Vec4f::Zero());
  add_forces(rows_, false, node_position_world_m, force);
  descent_->ties().add_forces(node_position_world_m, force);
  for (std::size_t n = 0; n < force.size(); ++n) force_n[n] = force[n].head<3>().cast<double>();
}

double HexSolid::energy_j(std::span<const Vec4f>, std::span<const Vec4f>) const {
  double energy = elastic_energy_j(position_);
  for (std::size_t n = 0; n < position_.size(); ++n) {
    energy += 0.5 * node_mass_[n] * velocity_[n].head<3>().cast<double>().squaredNorm();
    energy -= node_mass_[n] * settings_.gravity_m_per_s2.dot(position_[n].head<3>().cast<double>());
  }
  return energy;
}

std::vector<Vec3> HexSolid::sag_of_nodes_m(const Vec3& gravity_body_m_per_s2) {
  std::vector<Vec3> rest_m;
  for (std::uint32_t n = 0; n < node_mass_.size(); ++n) rest_m.push_back(lattice_->rest_m(n));
  const HexAtRest at_rest(*lattice_, hex_material_);
  SagProblem problem{node_mass_, inverse_mass_, gravity_body_m_per_s2, std::vector<Mat3>(rest_m.size(), Mat3::Zero()),
                     [&](std::span<Vec4f> p_m, std::span<Vec4f> force_n) {
                       at_rest.add_product(p_m, force_n);
                       descent_->ties().add_product(p_m, force_n);
                     }};
  for (std::uint32_t n = 0; n < rest_m.size(); ++n)
    problem.blocks_n_per_m[n] = descent_->block(n, rest_m).stiffness_n_per_m;
  return sectio::sag_m(problem);
}

std::vector<Vec3> HexSolid::sag_m(const Vec3& gravity_body_m_per_s2) {
  const std::vector<Vec3> nodes = sag_of_nodes_m(gravity_body_m_per_s2);
  std::vector<Vec3> moved(nodes.empty() ? 0 : weight_.size(), Vec3::Zero());
  for (VertexId v = 0; v < moved.size(); ++v)
    for (std::size_t c = 0; c < 8; ++c)
      moved[v] += double{weight_[v][c]} * nodes[lattice_->cells[lattice_->points[v].cell].nodes[c]];
  return moved;
}

}  // namespace sectio
