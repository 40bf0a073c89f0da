#include "sim_server/deformation/rigid_aggregates.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/sort_unique.h"
#include "common/math/disjoint_sets.h"

namespace sectio {
namespace {

constexpr double kNodesInBox = 3;        // along an edge of the first level's boxes
constexpr std::size_t kMostExact = 100;  // groups of the level that is solved exactly
constexpr std::uint32_t kFewToTurn = 4;  // fewer particles have no rotations of their own
constexpr float kLeastTurn = 1e-5f;      // stiffness of a rotation over that of translations

// A u + [d] terms: the modes of a child from those of its parent, u_child = u + theta x d.
RigidAggregates::Mat6f from_parent(const Vec3f& d) {
  RigidAggregates::Mat6f c = RigidAggregates::Mat6f::Identity();
  c.topRightCorner<3, 3>() = -cross_matrix(d);
  return c;
}

using Box = RigidAggregates::Box;

// Numbers the sets, whose members are in `boxes`, along the boxes.
std::vector<std::uint32_t> numbered(DisjointSets& sets, const std::vector<Box>& boxes,
                                    const std::vector<std::uint8_t>& counts, std::uint32_t& count) {
  const auto n_members = static_cast<std::uint32_t>(boxes.size());
  std::vector<std::uint32_t> roots, number(n_members, RigidAggregates::kNoGroup);
  for (std::uint32_t n = 0; n < n_members; ++n)
    if (counts[n] != 0 && sets.root(n) == n) roots.push_back(n);
  std::ranges::stable_sort(roots, {}, [&](std::uint32_t n) { return boxes[n]; });
  count = static_cast<std::uint32_t>(roots.size());
  for (std::uint32_t k = 0; k < count; ++k) number[roots[k]] = k;
  std::vector<std::uint32_t> group(n_members, RigidAggregates::kNoGroup);
  for (std::uint32_t n = 0; n < n_members; ++n)
    if (counts[n] != 0) group[n] = number[sets.root(n)];
  return group;
}

struct Boxes {
  std::vector<Box> of_particle;  // none: no particle is free, or nothing joins them
  double size_m = 0;
};

Boxes boxes_of(const ParticleGraph& graph) {
  const std::size_t count = graph.rest_m.size();
  Eigen::AlignedBox3d box;
  double edges_m = 0, edges = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (graph.is_free[i] == 0) continue;
    box.extend(graph.rest_m[i]);
    for (std::uint32_t n = graph.first[i]; n < graph.first[i + 1]; ++n)
      edges_m += (graph.rest_m[graph.to[n]] - graph.rest_m[i]).norm(), ++edges;
  }
  if (box.isEmpty() || edges == 0) return {};
  const Vec3 size = box.sizes();
  std::array<int, 3> axes{0, 1, 2};  // the longest first: groups are numbered along it, which keeps the envelope small
  std::ranges::stable_sort(axes, [&](int a, int b) { return size[a] > size[b]; });
  Boxes boxes{std::vector<Box>(count, Box{}), 0};
  boxes.size_m = kNodesInBox * 0.8 * edges_m / edges;  // edges are longer than cells: along faces, diagonals
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      boxes.of_particle[i][k] =
          static_cast<int>(std::floor((graph.rest_m[i] - box.min())[axes[k]] / boxes.size_m + 1e-6));
  return boxes;
}

}  // namespace

RigidAggregates::Mat6f* RigidAggregates::Level::block(std::uint32_t row, std::uint32_t column) {
  for (std::uint32_t n = first[row]; n < first[row + 1]; ++n)
    if (columns[n] == column) return &blocks[n];
  return nullptr;
}

RigidAggregates::Mat6f* RigidAggregates::block(std::uint32_t row, std::uint32_t column) {
  return levels_.front().block(row, column);
}

void RigidAggregates::divide(const ParticleGraph& graph) {
  levels_.clear();
  const auto count = static_cast<std::uint32_t>(graph.rest_m.size());
  group_.assign(count, kNoGroup);
  arm_.assign(count, Vec4f::Zero());
  const auto [boxes, size_m] = boxes_of(graph);
  if (boxes.empty()) return;
  box_m_ = size_m;
  DisjointSets joined(count);
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t n = graph.first[i]; n < graph.first[i + 1]; ++n) {
      const std::uint32_t j = graph.to[n];
      if (graph.is_free[i] != 0 && graph.is_free[j] != 0 && boxes[i] == boxes[j]) joined.join(i, j);
    }
  std::uint32_t groups = 0;
  group_ = numbered(joined, boxes, graph.is_free, groups);
  std::vector<Box> box_of(groups);
  levels_.resize(1);
  levels_[0].particles.assign(groups, 0);
  for (std::uint32_t i = 0; i < count; ++i)
    if (group_[i] != kNoGroup) box_of[group_[i]] = boxes[i], ++levels_[0].particles[group_[i]];
  lay_out(graph);
  while (levels_.back().particles.size() > kMostExact && add_level(box_of)) {
  }
  for (Level& level : levels_) {
    const std::size_t n = level.particles.size();
    level.centre.resize(n), level.offset.resize(n), level.inverse.resize(n);
    level.force.resize(n), level.move.resize(n);
    level.blocks.resize(level.columns.size());
  }
  lay_out_envelope();
}

// Joins groups in boxes that are twice as wide. False: none were beside each other.
bool RigidAggregates::add_level(std::vector<Box>& box_of) {
  Level& fine = levels_.back();
  const auto n = static_cast<std::uint32_t>(fine.particles.size());
  for (Box& b : box_of)
    for (int& k : b) k /= 2;
  DisjointSets joined(n);
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t e = fine.first[a]; e < fine.first[a + 1]; ++e)
      if (box_of[a] == box_of[fine.columns[e]]) joined.join(a, fine.columns[e]);
  std::uint32_t coarse = 0;
  fine.parent = numbered(joined, box_of, std::vector<std::uint8_t>(n, 1), coarse);
  if (coarse == n) {
    fine.parent.clear();
    return false;
  }
  Level next;
  next.particles.assign(coarse, 0);
  std::vector<Box> next_box(coarse);
  std::vector<std::vector<std::uint32_t>> columns(coarse);
  for (std::uint32_t a = 0; a < n; ++a) {
    next.particles[fine.parent[a]] += fine.particles[a];
    next_box[fine.parent[a]] = box_of[a];
    for (std::uint32_t e = fine.first[a]; e < fine.first[a + 1]; ++e) {
      const auto [row, column] = std::minmax(fine.parent[a], fine.parent[fine.columns[e]]);
      columns[row].push_back(column);
    }
  }
  next.first.assign(1, 0);
  for (auto& row : columns) {
    sort_unique(row);
    next.columns.insert(next.columns.end(), row.begin(), row.end());
    next.first.push_back(static_cast<std::uint32_t>(next.columns.size()));
  }
  box_of = std::move(next_box);
  levels_.push_back(std::move(next));
  return true;
}

// The last level's matrix is kept from the first block of each column on.
void RigidAggregates::lay_out_envelope() {
  const Level& last = levels_.back();
  const std::size_t n = last.particles.size();
  envelope_ = {};
  envelope_.first.resize(n);
  std::iota(envelope_.first.begin(), envelope_.first.end(), 0u);
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t e = last.first[a]; e < last.first[a + 1]; ++e)
      envelope_.first[last.columns[e]] = std::min(envelope_.first[last.columns[e]], a);
  envelope_.start.assign(1, 0);
  for (std::uint32_t a = 0; a < n; ++a) envelope_.start.push_back(envelope_.start.back() + a - envelope_.first[a] + 1);
  envelope_.blocks.resize(envelope_.start.back());
  envelope_.solution.resize(n);
}

// Groups have a block when a particle, held or not, is in or beside both.
void RigidAggregates::lay_out(const ParticleGraph& graph) {
  Level& level = levels_.front();
  std::vector<std::vector<std::uint32_t>> columns(level.particles.size());
  for (std::uint32_t a = 0; a < columns.size(); ++a) columns[a].push_back(a);
  std::vector<std::uint32_t> around;
  for (std::uint32_t i = 0; i < group_.size(); ++i) {
    around.assign(1, group_[i]);
    for (std::uint32_t n = graph.first[i]; n < graph.first[i + 1]; ++n) around.push_back(group_[graph.to[n]]);
    sort_unique(around);
    for (std::size_t a = 0; a < around.size(); ++a)
      for (std::size_t b = a + 1; b < around.size() && around[b] != kNoGroup; ++b) {
        auto& row = columns[around[a]];
        if (std::ranges::find(row, around[b]) == row.end()) row.push_back(around[b]);
      }
  }
  level.first.assign(1, 0);
  level.columns.clear();
  for (auto& row : columns) {
    std::ranges::sort(row);
    level.columns.insert(level.columns.end(), row.begin(), row.end());
    level.first.push_back(static_cast<std::uint32_t>(level.columns.size()));
  }
}

void RigidAggregates::begin(std::span<const Vec3> position_m) {
  const double scale = 1 / box_m_;
  std::vector<Vec3> centre(levels_.front().particles.size(), Vec3::Zero());
  for (std::uint32_t i = 0; i < group_.size(); ++i)
    if (group_[i] != kNoGroup) centre[group_[i]] += scale * position_m[i];
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    Level& level = levels_[k];
    std::vector<Vec3> parents(k + 1 < levels_.size() ? levels_[k + 1].particles.size() : 0, Vec3::Zero());
    for (std::size_t a = 0; a < centre.size(); ++a) {
      if (!parents.empty()) parents[level.parent[a]] += centre[a];
      centre[a] /= level.particles[a];
      level.centre[a] = centre[a].cast<float>();
    }
    if (k == 0)
      for (std::uint32_t i = 0; i < group_.size(); ++i) {
        const std::uint32_t a = group_[i];
        if (a != kNoGroup && level.particles[a] >= kFewToTurn)
          arm_[i].head<3>() = (scale * position_m[i] - centre[a]).cast<float>();
        else
          arm_[i].setZero();
      }
    for (Mat6f& block : level.blocks) block.setZero();
    centre = std::move(parents);
  }
  for (std::size_t k = 0; k + 1 < levels_.size(); ++k)
    for (std::size_t a = 0; a < levels_[k].centre.size(); ++a)
      levels_[k].offset[a] = levels_[k].centre[a] - levels_[k + 1].centre[levels_[k].parent[a]];
}

void RigidAggregates::begin_with_kept() {
  levels_.front().blocks = kept_;
  for (Level& level : std::span(levels_).subspan(1))
    for (Mat6f& block : level.blocks) block.setZero();
}

void RigidAggregates::coarsen(std::size_t k) {
  Level &fine = levels_[k], &coarse = levels_[k + 1];
  for (std::uint32_t a = 0; a < fine.parent.size(); ++a) {
    const Mat6f left = from_parent(fine.offset[a]).transpose();
    for (std::uint32_t n = fine.first[a]; n < fine.first[a + 1]; ++n) {
      const std::uint32_t b = fine.columns[n];
      const Mat6f share = left * fine.blocks[n] * from_parent(fine.offset[b]);
      const std::uint32_t row = fine.parent[a], column = fine.parent[b];
      Mat6f& to = *coarse.block(std::min(row, column), std::max(row, column));
      if (row < column || a == b)
        to += share;
      else if (row > column)
        to += share.transpose();
      else
        to += share + share.transpose();
    }
  }
}

void RigidAggregates::finish() {
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    Level& level = levels_[k];
    if (k + 1 < levels_.size()) coarsen(k);
    for (std::size_t a = 0; a < level.inverse.size(); ++a) {
      Mat6f& own = level.blocks[level.first[a]];
      const float least = kLeastTurn * own.topLeftCorner<3, 3>().trace();
      own.diagonal().tail<3>().array() += least;
      if (k + 1 < levels_.size()) level.inverse[a] = own.cast<double>().llt().solve(Mat6::Identity()).cast<float>();
    }
  }
  factor();
}

// A = L L^T by rows: L_ij = (A_ij - sum_k L_ik L_jk^T) L_jj^-T.
void RigidAggregates::factor() {
  const Level& last = levels_.back();
  Envelope& e = envelope_;
  for (Mat6& block : e.blocks) block.setZero();
  for (std::uint32_t a = 0; a < e.first.size(); ++a)
    for (std::uint32_t n = last.first[a]; n < last.first[a + 1]; ++n) {
      const std::uint32_t row = last.columns[n];
      e.blocks[e.start[row] + a - e.first[row]] = last.blocks[n].cast<double>().transpose();
    }
  for (std::uint32_t i = 0; i < e.first.size(); ++i) {
    Mat6* const row = e.blocks.data() + e.start[i];  // row[j - first[i]]
    for (std::uint32_t j = e.first[i]; j <= i; ++j) {
      const Mat6* const other = e.blocks.data() + e.start[j];
      Mat6& block = row[j - e.first[i]];
      for (std::uint32_t k = std::max(e.first[i], e.first[j]); k < j; ++k)
        block.noalias() -= row[k - e.first[i]] * other[k - e.first[j]].transpose();
      if (j < i)
        other[j - e.first[j]].triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(block);
      else
        block = Mat6(block.llt().matrixL());
    }
  }
}

void RigidAggregates::solve(const std::vector<Vec6f>& force, std::vector<Vec6f>& move) {
  Envelope& e = envelope_;
  for (std::uint32_t i = 0; i < e.first.size(); ++i) {
    const Mat6* const row = e.blocks.data() + e.start[i];
    auto& x = e.solution[i] = force[i].cast<double>();
    for (std::uint32_t j = e.first[i]; j < i; ++j) x.noalias() -= row[j - e.first[i]] * e.solution[j];
    row[i - e.first[i]].triangularView<Eigen::Lower>().solveInPlace(x);
  }
  for (auto i = static_cast<std::uint32_t>(e.first.size()); i-- > 0;) {
    const Mat6* const row = e.blocks.data() + e.start[i];
    auto& x = e.solution[i];
    row[i - e.first[i]].triangularView<Eigen::Lower>().transpose().solveInPlace(x);
    for (std::uint32_t j = e.first[i]; j < i; ++j) e.solution[j].noalias() -= row[j - e.first[i]].transpose() * x;
    move[i] = x.cast<float>();
  }
}

void RigidAggregates::add_correction(std::span<const Vec4f> r, std::span<Vec4f> z) {
  Level& fine = levels_.front();
  for (Vec6f& f : fine.force) f.setZero();
  for (std::uint32_t i = 0; i < group_.size(); ++i) {
    if (group_[i] == kNoGroup) continue;
    const Vec3f own = r[i].head<3>();
    Vec6f& f = fine.force[group_[i]];
    f.head<3>() += own;
    f.tail<3>() += arm_[i].head<3>().cross(own);
  }
  for (std::size_t k = 0; k + 1 < levels_.size(); ++k) {
    Level &level = levels_[k], &next = levels_[k + 1];
    for (Vec6f& f : next.force) f.setZero();
    for (std::size_t a = 0; a < level.force.size(); ++a) {
      level.move[a].noalias() = level.inverse[a] * level.force[a];
      const Vec3f push = level.force[a].head<3>();
      Vec6f& f = next.force[level.parent[a]];
      f += level.force[a];
      f.tail<3>() += level.offset[a].cross(push);
    }
  }
  solve(levels_.back().force, levels_.back().move);
  for (std::size_t k = levels_.size() - 1; k-- > 0;) {
    Level& level = levels_[k];
    for (std::size_t a = 0; a < level.move.size(); ++a) {
      const Vec6f& up = levels_[k + 1].move[level.parent[a]];
      const Vec3f turn = up.tail<3>();
      level.move[a] += up;
      level.move[a].head<3>() += turn.cross(level.offset[a]);
    }
  }
  for (std::uint32_t i = 0; i < group_.size(); ++i) {
    if (group_[i] == kNoGroup) continue;
    const Vec6f& m = fine.move[group_[i]];
    const Vec3f turn = m.tail<3>();
    z[i].head<3>() += m.head<3>() + turn.cross(arm_[i].head<3>());
  }
}

}  // namespace sectio
