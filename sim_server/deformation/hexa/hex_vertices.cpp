// The vertices that a lattice carries: how they follow its nodes, and how nodes take what is done to vertices.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/shape_matching.h"

namespace sectio {
namespace {

constexpr int kFits = 20;  // rounds in which nodes are fitted to their vertices
constexpr int kNewton = 6;
constexpr double kMostBeside = 0.3;  // cells; largest distance of a new vertex's embedding from its rest place

}  // namespace

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

void HexSolid::take_up(std::span<const Vec4f> position_world_m, std::span<const Vec4f> velocity_m_per_s) {
  if (!placed_) place(position_world_m, velocity_m_per_s);
  bind_new(position_world_m);
  read_vertices(position_world_m, velocity_m_per_s);
}

void HexSolid::nodes_of(VertexId v, std::vector<NodeShare>& nodes) const {
  nodes.clear();
  for (std::size_t c = 0; c < 8; ++c)
    if (const double w{weight_[v][c]}; std::abs(w) > kSlight)
      nodes.push_back({lattice_->cells[lattice_->points[v].cell].nodes[c], w});
}

NodeMotion HexSolid::node(std::span<const Vec4f>, std::uint32_t n) const {
  return {velocity_[n].head<3>().cast<double>(), inverse_mass_[n]};
}

void HexSolid::nudge(std::span<const NodeChange> changes, std::span<Vec4f> position_world_m,
                     std::span<Vec4f> velocity_m_per_s) {
  take_up(position_world_m, velocity_m_per_s);
  for (const NodeChange& c : changes) {
    velocity_[c.node].head<3>() += c.faster_by_m_per_s.cast<float>();
    position_[c.node].head<3>() += c.moved_by_m.cast<float>();
  }
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

}  // namespace sectio
