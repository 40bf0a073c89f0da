#include "sim_server/deformation/tetra/tet_springs.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "sim_server/deformation/spring_star.h"
#include "sim_server/deformation/tetra/tet_star.h"

namespace sectio {
namespace {

using Spring = TetSprings::Spring;

double factor_of(const VolumeMaterial& material, std::size_t t) {
  return material.stiffness_factor.empty() ? 1 : material.stiffness_factor[t];
}

// Of the bound at rest: directions change and stretched springs are stiff across, too.
constexpr double kSafety = 0.8;
constexpr double kRoomForDamping = 1.05;
constexpr double kLeastSecondLength = 0.3;  // of a spring between second neighbours, in mean lengths of edges

// Neighbours of every vertex, ascending.
std::vector<std::vector<VertexId>> neighbours_of(const TetMesh& mesh) {
  const TetStars stars(mesh);
  NeighbourRow row(mesh, stars);
  std::vector<std::vector<VertexId>> neighbours(mesh.vertices_body_m.size());
  for (VertexId v = 0; v < neighbours.size(); ++v) {
    row.begin(v);
    for (const auto& entry : row.entries()) neighbours[v].push_back(entry.to);
  }
  return neighbours;
}

// Vertices exactly two edges from v, ascending.
std::vector<VertexId> second_neighbours(VertexId v, const std::vector<std::vector<VertexId>>& neighbours) {
  std::vector<VertexId> reached;
  for (const VertexId w : neighbours[v]) reached.insert(reached.end(), neighbours[w].begin(), neighbours[w].end());
  std::sort(reached.begin(), reached.end());
  reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
  std::erase_if(reached, [&](VertexId w) { return w == v || std::ranges::binary_search(neighbours[v], w); });
  return reached;
}

}  // namespace

TetSprings::TetSprings(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
                       const TetSpringOptions& options)
    : material_(material),
      settings_(std::move(settings)),
      options_(options),
      mass_(masses_by_volume(mesh, material.density_kg_per_m3)),
      inverse_mass_(mass_.size()) {
  for (VertexId v = 0; v < mass_.size(); ++v)
    inverse_mass_[v] = !settings_.fixed.empty() && settings_.fixed[v] ? 0 : 1 / mass_[v];
  make_springs(mesh, options.second_share);
  if (options.calibrate) {
    as_made_ = tensile_test(mesh, springs_);
    for (Spring& s : springs_) s.stiffness_n_per_m *= material.young_pa / as_made_.mean_young_pa;
    calibrated_ = tensile_test(mesh, springs_);
  }
  make_rows(mesh);
}

void TetSprings::make_springs(const TetMesh& mesh, double second_share) {
  const auto neighbours = neighbours_of(mesh);
  const auto length = [&](VertexId a, VertexId b) {
    return (mesh.vertices_body_m[a] - mesh.vertices_body_m[b]).norm();
  };
  std::vector<std::size_t> first(neighbours.size());
  for (VertexId a = 0; a < neighbours.size(); ++a) {
    first[a] = springs_.size();
    for (const VertexId b : neighbours[a])
      if (b > a) springs_.push_back({a, b, 0, length(a, b)});
  }
  edge_count_ = springs_.size();
  double stiff_volume = 0;  // sum of E V
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const double ev = material_.young_pa * factor_of(material_, t) * tet_volume_m3(mesh, mesh.tetrahedra[t]);
    stiff_volume += ev;
    for (const auto& [i, j] : kTetEdges) {
      const auto [a, b] = std::minmax(mesh.tetrahedra[t][i], mesh.tetrahedra[t][j]);
      auto at = springs_.begin() + static_cast<std::ptrdiff_t>(first[a]);
      while (at->b != b) ++at;
      at->stiffness_n_per_m += (1 - second_share) * ev / (at->rest_length_m * at->rest_length_m);
    }
  }
  if (second_share == 0) return;
  std::vector<std::vector<VertexId>> second(neighbours.size());
  double mean_m = 0;
  for (const Spring& s : springs_) mean_m += s.rest_length_m / static_cast<double>(edge_count_);
  // Twins at the tip of a cut are second neighbours without a length.
  for (VertexId a = 0; a < second.size(); ++a) {
    second[a] = second_neighbours(a, neighbours);
    std::erase_if(second[a], [&](VertexId b) { return length(a, b) < kLeastSecondLength * mean_m; });
  }
  // Of the tissue around a vertex; where all is alike, exactly 1.
  std::vector<double> volume(mass_.size(), 0), factor(mass_.size(), 0);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (const VertexId v : mesh.tetrahedra[t]) {
      volume[v] += tet_volume_m3(mesh, mesh.tetrahedra[t]);
      factor[v] += factor_of(material_, t) * tet_volume_m3(mesh, mesh.tetrahedra[t]);
    }
  for (VertexId v = 0; v < factor.size(); ++v) factor[v] /= volume[v];
  double sum = 0;  // of k l^2 before it is what it should be
  for (VertexId a = 0; a < second.size(); ++a)
    for (const VertexId b : second[a]) {
      if (b < a) continue;
      const double l = length(a, b), weight = factor[a] * mass_[a] / static_cast<double>(second[a].size()) +
                                              factor[b] * mass_[b] / static_cast<double>(second[b].size());
      springs_.push_back({a, b, weight / (l * l), l});
      sum += weight;
    }
  for (std::size_t n = edge_count_; n < springs_.size(); ++n)
    springs_[n].stiffness_n_per_m *= second_share * 6 * stiff_volume / sum;
}

void TetSprings::make_rows(const TetMesh& mesh) {
  std::vector<std::uint32_t> degree(mass_.size(), 0);
  std::vector<Mat3> own(mass_.size(), Mat3::Zero());
  std::vector<std::vector<HalfEdge>> half_edges(mass_.size());
  for (const Spring& s : springs_) {
    ++degree[s.a], ++degree[s.b];
    const Vec3 n = (mesh.vertices_body_m[s.b] - mesh.vertices_body_m[s.a]) / s.rest_length_m;
    own[s.a] += s.stiffness_n_per_m * n * n.transpose();
    own[s.b] += s.stiffness_n_per_m * n * n.transpose();
    const auto k = static_cast<float>(s.stiffness_n_per_m);
    const auto k_l0 = static_cast<float>(s.stiffness_n_per_m * s.rest_length_m);
    half_edges[s.a].push_back({s.b, k, k_l0});
    half_edges[s.b].push_back({s.a, k, k_l0});
  }
  double omega2 = 0, added = 0, total = 0;
  for (VertexId v = 0; v < mass_.size(); ++v) {
    total += mass_[v];
    const double part_s = kRoomForDamping * settings_.least_part_s / kSafety;
    const double heavy = 0.5 * largest_eigenvalue_bound(own[v]) * part_s * part_s;
    if (inverse_mass_[v] == 0 || heavy <= mass_[v]) continue;
    inverse_mass_[v] = 1 / heavy;
    added += heavy - mass_[v];
  }
  added_mass_fraction_ = added / total;
  for (VertexId v = 0; v < mass_.size(); ++v)
    omega2 = std::max(omega2, 2 * largest_eigenvalue_bound(own[v]) * inverse_mass_[v]);
  part_limit_s_ = kSafety * damped_limit_s(omega2);
  parts_ = std::max(1, static_cast<int>(std::min(1000.0, std::ceil(settings_.step_s / part_limit_s_))));
  rows_.layout(degree);
  for (VertexId v = 0; v < mass_.size(); ++v) {
    std::ranges::sort(half_edges[v], {}, &HalfEdge::to);
    VertexRow row;
    row.step_over_mass = static_cast<float>(settings_.step_s / parts_ * inverse_mass_[v]);
    row.gravity_share = static_cast<float>(mass_[v] * inverse_mass_[v]);
    rows_.set(v, row, half_edges[v]);
  }
}

// omega h <= 2 (sqrt(1 + zeta^2) - zeta) with zeta = (alpha / omega + damper_s omega) / 2.
double TetSprings::damped_limit_s(double omega2) const {
  const double omega = std::sqrt(omega2);
  const double zeta = 0.5 * (material_.damping_per_s / omega + options_.damper_s * omega);
  return omega2 > 0 ? 2 * (std::sqrt(1 + zeta * zeta) - zeta) / omega : HUGE_VAL;
}

void TetSprings::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                      std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  const double h = settings_.step_s / parts_;
  VelocityUpdate update;
  update.damping_factor = static_cast<float>(1 - material_.damping_per_s * h);
  update.gravity_step = (h * settings_.gravity_m_per_s2).cast<float>();
  update.max_speed_m_per_s = static_cast<float>(kMaxVolumeSpeed_m_per_s);
  update.damper_s = static_cast<float>(options_.damper_s);
  constraints_.begin(constraints, position_world_m, parts_);
  for (int part = 0; part < parts_; ++part) {
    if (options_.damper_s > 0) {
      before_.assign(velocity_m_per_s.begin(), velocity_m_per_s.end());
      update.velocity_before = before_;
    }
    const VelocityOutcome outcome = update_velocities(rows_, update, position_world_m, velocity_m_per_s);
    clamped_ += outcome.clamped;
    if (first_bad_vertex_ == kNone) first_bad_vertex_ = outcome.not_finite;
    update_positions(static_cast<float>(h), velocity_m_per_s, position_world_m);
    constraints_.project_part(part, h, inverse_mass_, position_world_m, velocity_m_per_s);
  }
  constraints_.finish(reactions);
}

double TetSprings::elastic_energy_j(std::span<const Vec4f> position_world_m) const {
  double energy = 0;
  for (const Spring& s : springs_) {
    const double l = (position_world_m[s.b] - position_world_m[s.a]).head<3>().cast<double>().norm();
    energy += 0.5 * s.stiffness_n_per_m * (l - s.rest_length_m) * (l - s.rest_length_m);
  }
  return energy;
}

void TetSprings::elastic_forces_n(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n) const {
  SpringRows rows = rows_;
  for (VertexId v = 0; v < mass_.size(); ++v) {
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
    // The forces of a uniform unit stress along the axis are in balance on any shape.
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

}  // namespace sectio
