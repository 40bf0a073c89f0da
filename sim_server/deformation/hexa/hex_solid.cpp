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
constexpr int kFits = 20;             // rounds in which nodes are fitted to their vertices
constexpr double kSlightFill = 1e-2;  // material at a node, as a share of a cell, that the integrator disregards
constexpr int kNewton = 6;
constexpr double kMostBeside = 0.3;  // cells; largest distance of a new vertex's embedding from its rest place
constexpr double kRounding = 1e-9;
constexpr double kSlight = 1e-6;  // a node with less weight than this does not carry a vertex

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

// With N_a the sum of the weights of a node's vertices: 1 / m_v = sum_a w_va N_a / m_a, which is the row sum of the
// matrix that maps impulses on all vertices to velocities.
void HexSolid::share_masses() {
  std::vector<double> weights(node_mass_.size(), 0);
  const auto nodes_of = [&](VertexId v) -> const auto& {
    return lattice_->cells[lattice_->points[v].cell].nodes;
  };
  for (VertexId v = 0; v < weight_.size(); ++v)
    for (std::size_t c = 0; c < 8 && lattice_->outside[v] != 0; ++c)
      weights[nodes_of(v)[c]] += std::abs(double{weight_[v][c]});
  vertex_inverse_.assign(weight_.size(), 0);
  for (VertexId v = 0; v < weight_.size(); ++v) {
    if (body_.fixed(v) || body_.stars().of(v).empty()) continue;
    for (std::size_t c = 0; c < 8; ++c) {
      const double w = std::abs(double{weight_[v][c]});
      if (w < kSlight) continue;
      vertex_inverse_[v] += w * std::max(1.0, weights[nodes_of(v)[c]]) * inverse_mass_[nodes_of(v)[c]];
    }
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

Vec3 HexSolid::carried(VertexId v, std::span<const Vec4f> nodes) const {
  const HexCell& cell = lattice_->cells[lattice_->points[v].cell];
  Vec4f sum = Vec4f::Zero();
  for (std::size_t c = 0; c < 8; ++c) sum += weight_[v][c] * nodes[cell.nodes[c]];
  return sum.head<3>().cast<double>();
}

void HexSolid::place(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) {
  placed_ = true;
  std::vector<MatchedPoint> matched;
  Vec3 drift = Vec3::Zero();
  double total = 0;
  for (VertexId v = 0; v < position_world_m.size(); ++v) {
    matched.push_back({mesh().vertices_body_m[v], position_world_m[v].head<3>().cast<double>(), body_.mass_kg(v)});
    drift += body_.mass_kg(v) * velocity_m_per_s[v].head<3>().cast<double>();
    total += body_.mass_kg(v);
  }
  const Pose frame = rest_world_ = match_shape(matched, Pose{});
  descent_->set_homes(rest_world_);
  for (std::uint32_t n = 0; n < position_.size(); ++n) {
    position_[n].head<3>() = frame.to_world(lattice_->rest_m(n)).cast<float>();
    velocity_[n].head<3>() = (drift / total).cast<float>();
  }
  std::vector<Vec3> residual(2 * position_.size());
  std::vector<double> weight(position_.size());
  for (int round = 0; round < kFits; ++round) {
    std::ranges::fill(residual, Vec3::Zero());
    std::ranges::fill(weight, 0.0);
    for (VertexId v = 0; v < position_world_m.size(); ++v) {
      const Vec3 dx = position_world_m[v].head<3>().cast<double>() - carried(v, position_);
      const Vec3 dv = velocity_m_per_s[v].head<3>().cast<double>() - carried(v, velocity_);
      const HexCell& cell = lattice_->cells[lattice_->points[v].cell];
      for (std::size_t c = 0; c < 8; ++c) {
        const double w = body_.mass_kg(v) * std::max(0.0, double{weight_[v][c]});
        weight[cell.nodes[c]] += w;
        residual[2 * cell.nodes[c]] += w * dx;
        residual[2 * cell.nodes[c] + 1] += w * dv;
      }
    }
    for (std::size_t n = 0; n < weight.size(); ++n) {
      if (!(weight[n] > 0)) continue;
      position_[n].head<3>() += (residual[2 * n] / weight[n]).cast<float>();
      velocity_[n].head<3>() += (residual[2 * n + 1] / weight[n]).cast<float>();
    }
  }
  for (std::size_t n = 0; n < velocity_.size(); ++n)
    if (inverse_mass_[n] == 0) velocity_[n].setZero();
}

void HexSolid::weigh_corners(VertexId v) {
  HexPoint point = lattice_->points[v];
  point.local += beside_[v];
  for (std::size_t c = 0; c < 8; ++c) weight_[v][c] = static_cast<float>(point.weight(c));
}

// Solves sum_c w_c(s) x_c = x for s by Newton's method.
void HexSolid::bind_new(std::span<const Vec4f> position_world_m) {
  if (bound_ == weight_.size()) return;
  for (; bound_ < weight_.size(); ++bound_) {
    const auto v = static_cast<VertexId>(bound_);
    if (body_.stars().of(v).empty()) continue;
    HexPoint point = lattice_->points[v];
    const auto& nodes = lattice_->cells[point.cell].nodes;
    const Vec3 at = position_world_m[v].head<3>().cast<double>();
    for (int n = 0; n < kNewton; ++n) {
      Vec3 missing = at;
      Mat3 slope = Mat3::Zero();
      for (std::size_t c = 0; c < 8; ++c) {
        const Vec3 x = position_[nodes[c]].head<3>().cast<double>();
        missing -= point.weight(c) * x;
        for (std::size_t k = 0; k < 3; ++k) {
          HexPoint end = point;
          end.local[static_cast<Eigen::Index>(k)] = 1;
          const std::size_t bit = std::size_t{1} << k;
          slope.col(static_cast<Eigen::Index>(k)) += ((c & bit) != 0 ? 1 : -1) * end.weight(c | bit) * x;
        }
      }
      point.local += slope.inverse() * missing;
    }
    const Vec3 beside = point.local - lattice_->points[v].local;
    if (!(beside.norm() < kMostBeside)) continue;
    beside_[v] = beside;
    weigh_corners(v);
  }
  share_masses();
}

void HexSolid::read_vertices(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) {
  if (written_position_.empty()) return;
  for (VertexId v = 0; v < position_world_m.size(); ++v) {
    if (position_world_m[v] == written_position_[v] && velocity_m_per_s[v] == written_velocity_[v]) continue;
    Vec4f dx = position_world_m[v] - written_position_[v], dv = velocity_m_per_s[v] - written_velocity_[v];
    dx.w() = dv.w() = 0;
    if (!(vertex_inverse_[v] > 0)) continue;
    const HexCell& cell = lattice_->cells[lattice_->points[v].cell];
    for (std::size_t c = 0; c < 8; ++c) {
      const std::uint32_t n = cell.nodes[c];
      const auto share = static_cast<float>(double{weight_[v][c]} * inverse_mass_[n] / vertex_inverse_[v]);
      position_[n] += share * dx;
      velocity_[n] += share * dv;
    }
  }
}

void HexSolid::nodes_of(VertexId v, std::vector<NodeShare>& nodes) const {
  nodes.clear();
  for (std::size_t c = 0; c < 8; ++c)
    if (const double w{weight_[v][c]}; std::abs(w) > kSlight)
      nodes.push_back({lattice_->cells[lattice_->points[v].cell].nodes[c], w});
}

void HexSolid::nudge(std::span<const NodeChange> changes, std::span<Vec4f> position_world_m,
                     std::span<Vec4f> velocity_m_per_s) {
  take_up(position_world_m, velocity_m_per_s);
  apply(changes, position_, velocity_);
  write_vertices(position_world_m, velocity_m_per_s);
}

void HexSolid::write_vertices(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  for (VertexId v = 0; v < position_world_m.size(); ++v) {
    const auto& nodes = lattice_->cells[lattice_->points[v].cell].nodes;
    const std::array<float, 8>& w = weight_[v];
    Vec4f x = w[0] * position_[nodes[0]], u = w[0] * velocity_[nodes[0]];
    for (std::size_t c = 1; c < 8; ++c) {
      x += w[c] * position_[nodes[c]];
      u += w[c] * velocity_[nodes[c]];
    }
    x.w() = u.w() = 0;
    position_world_m[v] = x;
    velocity_m_per_s[v] = u;
  }
  written_position_.assign(position_world_m.begin(), position_world_m.end());
  written_velocity_.assign(velocity_m_per_s.begin(), velocity_m_per_s.end());
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
