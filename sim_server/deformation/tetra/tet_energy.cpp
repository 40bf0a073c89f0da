#include "sim_server/deformation/tetra/tet_energy.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>

#include "sim_server/deformation/rigid_aggregates.h"

namespace sectio {
namespace {

constexpr double kForceRounding = 6e-8;

// Calls visit(vertex, slice, lane) for each row.
template <class Visit>
void for_rows(const TetRows& rows, const Visit& visit) {
  for (const TetSlice& slice : rows.slices())
    for (std::uint32_t lane = 0; lane < slice.count; ++lane) visit(vertex_at(slice.offset[lane]), slice, lane);
}

Vec4f lane_of(const std::array<std::array<float, kLanes>, 3>& vectors, std::uint32_t lane) {
  Vec4f all;  // stored at once: the processor waits for a load of what was stored in parts
  _mm_store_ps(all.data(), _mm_setr_ps(vectors[0][lane], vectors[1][lane], vectors[2][lane], 0));
  return all;
}

Vec4f cross(const Vec4f& a, const Vec4f& b) {
  const auto turned = [](__m128 v) { return _mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 0, 2, 1)); };  // y z x
  const __m128 u = _mm_load_ps(a.data()), v = _mm_load_ps(b.data());
  Vec4f all;
  _mm_store_ps(all.data(), turned(_mm_sub_ps(_mm_mul_ps(u, turned(v)), _mm_mul_ps(turned(u), v))));
  return all;
}

// to <- to + a b^T, two columns at a time, which are three registers; each factor is a push and a turn.
void add_outer(RigidAggregates::Mat6f& to, const Vec4f& a_push, const Vec4f& a_turn, const Vec4f& b_push,
               const Vec4f& b_turn) {
  using Lanes = Eigen::Array4f;
  const Lanes upper(a_push[0], a_push[1], a_push[2], a_turn[0]), lower(a_push[2], a_turn[0], a_turn[1], a_turn[2]);
  const Lanes both(a_turn[1], a_turn[2], a_push[0], a_push[1]);
  const float b[6] = {b_push[0], b_push[1], b_push[2], b_turn[0], b_turn[1], b_turn[2]};
  const auto at = [&](int n) { return Eigen::Map<Lanes, Eigen::Aligned16>(to.data() + n); };
  for (int k = 0; k < 3; ++k) {
    const float one = b[2 * k], two = b[2 * k + 1];
    at(12 * k) += one * upper;
    at(12 * k + 4) += Lanes(one, one, two, two) * both;
    at(12 * k + 8) += two * lower;
  }
}

}  // namespace

void TetEnergy::changed() {
  stale_ = true;
  ++changes_;
  position_.clear();
}

void TetEnergy::build() {
  stale_ = false;
  const TetMesh& mesh = body_->mesh();
  vertices_.assign(body_->vertex_count(), {});
  elements_.clear();
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& c = mesh.tetrahedra[t];
    if (c == kNoTetrahedron) continue;
    const TetShape shape = tet_shape(mesh, c);
    if (!(shape.volume_m3 > 0) || !shape.gradient[1].allFinite()) continue;  // it can't carry anything
    elements_.push_back({c, shape.gradient, shape.volume_m3, stiffness_->shear_pa[t]});
    for (const VertexId v : c) {
      vertices_[v].rest_m3 += shape.volume_m3;
      vertices_[v].bulk_j += stiffness_->bulk_pa[t] * shape.volume_m3;
    }
  }
}

double TetEnergy::energy_j(std::span<const Vec3> x) {
  if (stale_) build();
  for (Vertex& v : vertices_) v.volume_m3 = 0;
  double energy = 0;
  for (const Element& e : elements_) {
    Mat3 f = Mat3::Zero();
    for (std::size_t k = 1; k < 4; ++k) f += (x[e.corners[k]] - x[e.corners[0]]) * e.gradient[k].transpose();
    const double j = f.determinant();
    energy += e.volume_m3 * e.shear_pa * (0.5 * (f.squaredNorm() - 3) - (j - 1));
    for (const VertexId v : e.corners) vertices_[v].volume_m3 += j * e.volume_m3;
  }
  for (const Vertex& v : vertices_)
    if (v.rest_m3 > 0) energy += 0.125 * v.bulk_j * std::pow(v.volume_m3 / v.rest_m3 - 1, 2);
  return energy;
}

// Positions as sums of two floats, and the pressures there.
void TetEnergy::place(std::span<const Vec3> x) {
  bool moved = position_.size() != x.size();
  if (moved) {
    position_.assign(x.size(), Vec4f::Zero());
    low_ = force_ = position_;
    double sum = 0;
    const std::vector<Vec3>& rest = body_->mesh().vertices_body_m;
    for_rows(*rows_, [&](VertexId v, const TetSlice& slice, std::uint32_t lane) {
      double forces_n = 0;
      for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.edges; ++e) {
        const TetEdgeColumn& column = rows_->edges()[e];
        forces_n += std::abs(double{column.weight[lane]}) * (rest[vertex_at(column.offset[lane])] - rest[v]).norm();
      }
      for (std::uint32_t f = slice.first_face; f != slice.first_face + slice.faces; ++f) {
        const TetFaceColumn& face = rows_->faces()[f];
        const auto at = [&](const auto& offset) -> const Vec3& { return rest[vertex_at(offset[lane])]; };
        const Vec3 twice_area_m2 = (at(face.b) - at(face.a)).cross(at(face.c) - at(face.a));
        forces_n += 4 * double{slice.pressure_shift[lane]} * twice_area_m2.norm();  // four pressures, from volumes
      }
      sum += forces_n * forces_n;
    });
    rounding_n_ = kForceRounding * std::sqrt(sum);
  }
  for (std::size_t v = 0; v < x.size(); ++v) {
    Vec4f high = position_[v], low = Vec4f::Zero();
    high.head<3>() = x[v].cast<float>();
    low.head<3>() = (x[v] - high.head<3>().cast<double>()).cast<float>();
    moved |= high != position_[v] || low != low_[v];
    position_[v] = high, low_[v] = low;
  }
  if (moved) update_pressures(*rows_, position_, low_);
}

void TetEnergy::add_forces(std::span<const Vec3> x, std::span<Vec3> force_n) {
  place(x);
  elastic_forces(*rows_, position_, low_, force_);
  for (std::size_t v = 0; v < x.size(); ++v) force_n[v] += force_[v].head<3>().cast<double>();
}

void TetEnergy::linearise(std::span<const Vec3> x) {
  place(x);
  sectio::linearise(*rows_, position_, hessian_);
}

void TetEnergy::add_product(std::span<Vec4f> p, std::span<Vec4f> force_n) const {
  sectio::add_product(*rows_, hessian_, p, force_n);
}

void TetEnergy::add_blocks(std::span<Mat3> blocks) const {
  for_rows(*rows_, [&](VertexId v, const TetSlice& slice, std::uint32_t lane) {
    const auto& own = hessian_.slices[static_cast<std::size_t>(&slice - rows_->slices().data())].block;
    const double xx = double{own[0][lane]}, yy = double{own[1][lane]}, zz = double{own[2][lane]};
    const double xy = double{own[3][lane]}, xz = double{own[4][lane]}, yz = double{own[5][lane]};
    Mat3 block;
    block << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    blocks[v] += block;
  });
}

ParticleGraph TetEnergy::graph() const {
  ParticleGraph graph;
  graph.rest_m = body_->mesh().vertices_body_m;
  const std::size_t count = graph.rest_m.size();
  graph.is_free.assign(count, 0);
  graph.first.assign(count + 1, 0);
  const auto for_edges = [&](const auto& visit) {
    for_rows(*rows_, [&](VertexId v, const TetSlice& slice, std::uint32_t lane) {
      for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.edges; ++e)
        if (const VertexId to = vertex_at(rows_->edges()[e].offset[lane]); to != v) visit(v, to);
    });
  };
  for_edges([&](VertexId v, VertexId) {
    ++graph.first[v + 1];
    graph.is_free[v] = body_->inverse_mass()[v] > 0;
  });
  for (std::size_t v = 0; v < count; ++v) graph.first[v + 1] += graph.first[v];
  graph.to.resize(graph.first.back());
  std::vector<std::uint32_t> next(graph.first.begin(), graph.first.end() - 1);
  for_edges([&](VertexId v, VertexId to) { graph.to[next[v]++] = to; });
  return graph;
}

// The shares of a row in the blocks of its group. With R = [I, - [r]x] the modes at a vertex, A = l I + [s]x, and by
// group: sums of l, of s, and of A [r]x.
void TetEnergy::add_to(RigidAggregates& coarse) const {
  struct Sums {
    std::uint32_t group;
    float l = 0, along = 0;                                                  // along: s.r
    Vec4f s = Vec4f::Zero(), arm = Vec4f::Zero();                            // arm: l r
    Eigen::Matrix<float, 4, 3> across = Eigen::Matrix<float, 4, 3>::Zero();  // r s^T
    Vec4f push = Vec4f::Zero(), turn = Vec4f::Zero();                        // R^T g
  };
  std::vector<Sums> sums;
  for_rows(*rows_, [&](VertexId v, const TetSlice& slice, std::uint32_t lane) {
    sums.clear();
    const std::uint32_t own = coarse.group(v);
    const auto add = [&](std::uint32_t group, float l, const Vec4f& s, const Vec4f& g, const Vec4f& arm) {
      auto to = std::ranges::find(sums, group, &Sums::group);
      if (to == sums.end()) to = sums.insert(to, Sums{group});
      if (own != RigidAggregates::kNoGroup && group >= own) {
        to->l += l;
        to->s += s;
        to->arm += l * arm;
        for (int k = 0; k < 3; ++k) to->across.col(k) += s[k] * arm;
        to->along += s.dot(arm);
      }
      to->push += g;
      to->turn += cross(arm, g);
    };
    const TetHessianSlice& block = hessian_.slices[static_cast<std::size_t>(&slice - rows_->slices().data())];
    if (own != RigidAggregates::kNoGroup)
      add(own, slice.weight_sum[lane], Vec4f::Zero(), lane_of(block.g, lane), coarse.arm(v));
    for (std::uint32_t e = slice.first_edge; e != slice.first_edge + slice.edges; ++e) {
      const VertexId to = vertex_at(rows_->edges()[e].offset[lane]);
      const std::uint32_t group = coarse.group(to);
      if (to == v || group == RigidAggregates::kNoGroup) continue;
      const TetHessianColumn& column = hessian_.columns[e];
      add(group, -rows_->edges()[e].weight[lane], lane_of(column.s, lane), lane_of(column.g, lane), coarse.arm(to));
    }
    for (const Sums& a : sums) {
      if (own != RigidAggregates::kNoGroup && a.group >= own) {
        RigidAggregates::Mat6f& to = *coarse.block(own, a.group);
        const Eigen::Matrix3f straight = a.l * Eigen::Matrix3f::Identity() + cross_matrix(a.s);
        // (l I + [s]x) [r]x = l [r]x + r s^T - (s.r) I
        const Eigen::Matrix3f turned =
            cross_matrix(a.arm) + a.across.topRows<3>() - a.along * Eigen::Matrix3f::Identity();
        const Eigen::Matrix3f arm = cross_matrix(coarse.arm(v));
        to.topLeftCorner<3, 3>() += straight;
        to.topRightCorner<3, 3>() -= turned;
        to.bottomLeftCorner<3, 3>() += arm.lazyProduct(straight);
        to.bottomRightCorner<3, 3>() -= arm.lazyProduct(turned);
      }
      for (const Sums& b : sums)
        if (a.group <= b.group) add_outer(*coarse.block(a.group, b.group), a.push, a.turn, b.push, b.turn);
    }
  });
}

}  // namespace sectio
