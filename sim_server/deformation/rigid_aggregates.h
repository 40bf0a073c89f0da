// The coarse levels of a preconditioner: groups of particles that move rigidly (smoothed out by the 3 x 3 blocks of the
// diagonal, which the caller has). A group is what hangs together inside a box of the shape at rest, so that a cut
// divides groups; boxes of the next level are twice as wide, until there are few groups. With R the rigid modes of all
// groups of a level about the present places, and A the matrix,
//
//   z = sum over the levels of R (R^T A R)^-1 R^T r
//
// where the last level is solved exactly (Cholesky in an envelope of 6 x 6 blocks), and the others group by group. The
// matrix is made anew for each linearisation: nothing is stale after a cut, or after a turn. Deterministic.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// Particles at rest, and which of them hang together. Held ones take no part.
struct ParticleGraph {
  std::vector<Vec3> rest_m;
  std::vector<std::uint8_t> is_free;
  std::vector<std::uint32_t> first, to;  // by particle: its neighbours are to[first[i]] .. to[first[i + 1]]
};

// [a]x: the product with it is the cross product with a, of which only the first three components count.
template <class Vector>
Eigen::Matrix3f cross_matrix(const Eigen::MatrixBase<Vector>& a) {
  Eigen::Matrix3f m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

class RigidAggregates {
 public:
  using Box = std::array<int, 3>;  // its place, in boxes
  using Mat6f = Eigen::Matrix<float, 6, 6>;
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  using Vec6f = Eigen::Matrix<float, 6, 1>;
  static constexpr std::uint32_t kNoGroup = ~0u;

  // Groups the particles anew. O(n log n).
  void divide(const ParticleGraph& graph);
  bool empty() const { return levels_.empty(); }

  // A new matrix, for modes about these places; then the shares of A are added, and the levels made ready.
  void begin(std::span<const Vec3> position_m);
  std::uint32_t group(std::uint32_t particle) const { return group_[particle]; }
  // The place of a particle from the centre of its group, scaled. The fourth component is 0.
  const Vec4f& arm(std::uint32_t particle) const { return arm_[particle]; }
  // The block of two groups, row <= column; nullptr when no particle is a neighbour of both.
  Mat6f* block(std::uint32_t row, std::uint32_t column);
  // The matrix as it was at keep(), before finish(): shares that stay need not be added again.
  void keep() { kept_ = levels_.front().blocks; }
  void begin_with_kept();
  void finish();

  // z <- z + the corrections of all levels; fourth components stay.
  void add_correction(std::span<const Vec4f> r_n, std::span<Vec4f> z_m);

 private:
  struct Level {
    std::vector<std::uint32_t> parent;          // by group; empty on the last level
    std::vector<Vec3f> centre, offset;          // offset: from the centre of the parent; scaled
    std::vector<std::uint32_t> first, columns;  // by group: the groups >= it that it has a block with, itself first
    std::vector<Mat6f> blocks, inverse;
    std::vector<Vec6f> force, move;
    std::vector<std::uint32_t> particles;  // by group: how many

    Mat6f* block(std::uint32_t row, std::uint32_t column);
  };
  // The matrix of the last level, by rows from the first block that isn't empty.
  struct Envelope {
    std::vector<std::uint32_t> first;
    std::vector<std::size_t> start;
    std::vector<Mat6> blocks;
    std::vector<Eigen::Matrix<double, 6, 1>> solution;
  };
  void lay_out(const ParticleGraph& graph);
  bool add_level(std::vector<Box>& box_of);
  void lay_out_envelope();
  void coarsen(std::size_t level);
  void factor();
  void solve(const std::vector<Vec6f>& force, std::vector<Vec6f>& move);

  double box_m_ = 0;  // on the first level
  std::vector<std::uint32_t> group_;
  std::vector<Vec4f> arm_;
  std::vector<Level> levels_;
  std::vector<Mat6f> kept_;  // blocks of the first level
  Envelope envelope_;
};

}  // namespace sectio
