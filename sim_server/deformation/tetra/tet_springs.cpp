#include "sim_server/deformation/tetra/tet_springs.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "sim_server/deformation/spring_star.h"

namespace sectio {
namespace {

using Spring = TetSprings::Spring;

constexpr double kRoomForDamping = 1.05;
constexpr double kLeastSecondLength = 0.3;  // of a spring between second neighbours, in mean lengths of edges

}  // namespace

TetSprings::TetSprings(const TetMesh& mesh, const VolumeMaterial& material, VolumeSettings settings,
                       const TetSpringOptions& options)
    : VolumeModel(material, std::move(settings)),
      body_(mesh, material, settings_.fixed),
      options_(options),
      neighbours_(mesh.vertices_body_m.size()),
      second_(neighbours_.size()),
      stiff_mass_(neighbours_.size(), 0) {
  const std::uint32_t vertices = body_.vertex_count();
  for (VertexId v = 0; v < vertices; ++v) find_neighbours(v);
  if (options_.second_share > 0) {
    double length_m = 0;
    for (const Spring& s : springs()) length_m += s.rest_length_m / static_cast<double>(edge_count());
    if (!(options_.least_second_m > 0)) options_.least_second_m = kLeastSecondLength * length_m;
    for (VertexId v = 0; v < vertices; ++v) find_second_neighbours(v);
  }
  if (options_.calibrate && !material_.stiffness_factor.empty()) {
    // Young's modulus is that of tissue with factor 1, and the net is tested as if all of it were.
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
  omega2_.set(with_room(vertices), 0);
  for (VertexId v = 0; v < vertices; ++v) weigh(v, settings_.least_part_s);
  parts_ = parts_for(part_limit_s());
  std::vector<std::uint32_t> degree(vertices);
  for (VertexId v = 0; v < vertices; ++v)
    degree[v] = static_cast<std::uint32_t>(neighbours_[v].size() + second_[v].size());
  rows_.layout(degree);
  for (VertexId v = 0; v < vertices; ++v) write(v);
}

void TetSprings::find_neighbours(VertexId v) {
  std::vector<VertexId>& found = neighbours_[v];
  found.clear();
  stiff_mass_[v] = 0;
  for (const std::uint32_t t : body_.stars().of(v))
    stiff_mass_[v] += 0.25 * material_.density_kg_per_m3 * body_.stiffness_factor(t) *
                      tet_volume_m3(body_.mesh(), body_.mesh().tetrahedra[t]);
  for (const std::uint32_t t : body_.stars().of(v))
    for (const VertexId w : body_.mesh().tetrahedra[t])
      if (w != v) found.push_back(w);
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

// Vertices exactly two edges from v; whether they are other ones than before.
bool TetSprings::find_second_neighbours(VertexId v) {
  std::vector<VertexId> reached;
  for (const VertexId w : neighbours_[v]) reached.insert(reached.end(), neighbours_[w].begin(), neighbours_[w].end());
  std::ranges::sort(reached);
  reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
  const std::vector<Vec3>& x = body_.mesh().vertices_body_m;
  std::erase_if(reached, [&](VertexId w) {
    return w == v || std::ranges::binary_search(neighbours_[v], w) || (x[v] - x[w]).norm() < options_.least_second_m;
  });
  if (reached == second_[v]) return false;
  second_[v] = std::move(reached);
  return true;
}

void TetSprings::gather(VertexId v, std::vector<Half>& row) const {
  const std::vector<Vec3>& x = body_.mesh().vertices_body_m;
  row.clear();
  for (const VertexId w : neighbours_[v]) row.push_back({w, 0, (x[v] - x[w]).norm(), false});
  for (const std::uint32_t t : body_.stars().of(v)) {
    const Tetrahedron& c = body_.mesh().tetrahedra[t];
    const double ev = material_.young_pa * body_.stiffness_factor(t) * tet_volume_m3(body_.mesh(), c);
    for (const VertexId w : c) {
      if (w == v) continue;
      Half& half = row[static_cast<std::size_t>(std::ranges::lower_bound(neighbours_[v], w) - neighbours_[v].begin())];
      half.stiffness_n_per_m += (1 - options_.second_share) * ev / (half.rest_length_m * half.rest_length_m);
    }
  }
  // k l^2 is 6 beta E / rho (m_i / d_i + m_j / d_j), with masses that count as often as the tissue is stiff: all
  // together 6 beta sum of E V.
  const double scale = 6 * options_.second_share * material_.young_pa / material_.density_kg_per_m3;
  const auto share = [&](VertexId i) { return stiff_mass_[i] / static_cast<double>(second_[i].size()); };
  for (const VertexId w : second_[v]) {
    const double l = (x[v] - x[w]).norm();
    row.push_back({w, scale * (share(std::min(v, w)) + share(std::max(v, w))) / (l * l), l, true});
  }
  for (Half& half : row) half.stiffness_n_per_m *= options_.correction;
}

std::vector<TetSprings::Spring> TetSprings::springs() const {
  std::vector<Spring> springs, second;
  for (VertexId v = 0; v < body_.vertex_count(); ++v) {
    gather(v, half_);
    for (const Half& half : half_)
      if (half.to > v)
        (half.second ? second : springs).push_back({v, half.to, half.stiffness_n_per_m, half.rest_length_m});
  }
  springs.insert(springs.end(), second.begin(), second.end());
  return springs;
}

std::size_t TetSprings::edge_count() const {
  std::size_t halves = 0;
  for (const auto& row : neighbours_) halves += row.size();
  return halves / 2;
}

void TetSprings::weigh(VertexId v, double part_s) {
  gather(v, half_);
  Mat3 own = Mat3::Zero();
  for (const Half& half : half_) {
    const Vec3 n = (body_.mesh().vertices_body_m[half.to] - body_.mesh().vertices_body_m[v]) / half.rest_length_m;
    own += half.stiffness_n_per_m * n * n.transpose();
  }
  const double stiffness = 2 * largest_eigenvalue_bound(own), h = kRoomForDamping * part_s / kSafety;
  if (!body_.fixed(v)) body_.weigh_at_least(v, 0.25 * h * h * stiffness);
  omega2_.set(v, stiffness * body_.inverse_mass()[v]);
}

void TetSprings::write(VertexId v) {
  gather(v, half_);
  std::vector<HalfEdge> half_edges;
  for (const Half& half : half_)
    half_edges.push_back({half.to, static_cast<float>(half.stiffness_n_per_m),
                          static_cast<float>(half.stiffness_n_per_m * half.rest_length_m)});
  std::ranges::sort(half_edges, {}, &HalfEdge::to);
  VertexRow row;
  row.step_over_mass = static_cast<float>(settings_.step_s / parts_ * body_.inverse_mass()[v]);
  row.gravity_share = static_cast<float>(body_.mass_kg(v) * body_.inverse_mass()[v]);
  rows_.set(v, row, half_edges);
}

void TetSprings::change(const TetChange& change) {
  const std::vector<VertexId> touched = body_.follow(change);
  for (auto* lists : {&neighbours_, &second_}) resize_slots(*lists, body_.vertex_count(), {});
  resize_slots(stiff_mass_, body_.vertex_count(), 0.0);
  for (const VertexId v : touched) find_neighbours(v);
  const auto with_all = [](std::vector<VertexId> of, const std::vector<std::vector<VertexId>>& lists) {
    for (std::size_t n = 0, size = of.size(); n < size; ++n)
      of.insert(of.end(), lists[of[n]].begin(), lists[of[n]].end());
    std::ranges::sort(of);
    of.erase(std::unique(of.begin(), of.end()), of.end());
    return of;
  };
  std::vector<VertexId> rows = touched;
  if (options_.second_share > 0) {
    // A way of two edges that came or went has an edge with both ends touched. Then the share of every spring changes.
    for (const VertexId v : with_all(touched, neighbours_))
      if (find_second_neighbours(v)) rows.push_back(v);
    rows = with_all(std::move(rows), second_);
  }
  const double part_s = std::max(settings_.least_part_s, settings_.step_s / parts_);
  for (const VertexId v : rows) {
    if (body_.stars().of(v).empty()) {
      rows_.remove(v);
      omega2_.set(v, 0);
      continue;
    }
    weigh(v, part_s);
    write(v);
  }
  if (rows_.wants_compaction()) rows_.compact();
}

void TetSprings::step(std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                      std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  const double h = settings_.step_s / parts_;
  VelocityUpdate update = velocity_update(h);
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
    constraints_.project_part(part, h, body_.inverse_mass(), position_world_m, velocity_m_per_s);
  }
  constraints_.finish(reactions);
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
