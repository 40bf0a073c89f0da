// A body-centred cubic lattice: numbering of its points, edges and tetrahedra. Internal to the mesher.
//
// Points have doubled coordinates, all even (corners) or all odd (centres). Each owns seven of its fourteen edges: the
// long ones to the next point of its kind along x, y and z, and four short ones to points with a larger x.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "common/core/error.h"
#include "common/math/intersect.h"
#include "common/mesh/tet_mesh.h"

namespace sectio {

class Lattice {
 public:
  using Place = std::array<int, 3>;  // doubled coordinates

  Lattice(const Box3& box, double cell_m) : half_m_(0.5 * cell_m) {
    // A margin of a whole cell around the box. Odd multiples, as surfaces often end at round numbers.
    const Vec3 margin(1.137 * cell_m, 1.219 * cell_m, 1.171 * cell_m);
    origin_m_ = box.min() - margin;
    const Vec3 size = box.sizes() + 2 * margin;
    double slots = 2;
    for (std::size_t i = 0; i < 3; ++i) {
      const double cells = std::ceil(size[static_cast<Eigen::Index>(i)] / cell_m);
      slots *= cells + 1;
      if (!(slots < 5e6)) throw InputError("cells of the lattice too small: more than 5 million points");
      cells_[i] = static_cast<int>(cells);
    }
  }

  std::size_t slots() const { return 2u * static_cast<std::size_t>(cells_[0] + 1) * (cells_[1] + 1) * (cells_[2] + 1); }

  std::uint32_t slot(const Place& p) const {
    return static_cast<std::uint32_t>(
        (((p[0] >> 1) * (cells_[1] + 1) + (p[1] >> 1)) * (cells_[2] + 1) + (p[2] >> 1)) * 2 + (p[0] & 1));
  }
  Place place(std::uint32_t slot) const {
    const int odd = static_cast<int>(slot & 1);
    int rest = static_cast<int>(slot >> 1);
    const int k = rest % (cells_[2] + 1);
    rest /= cells_[2] + 1;
    return {2 * (rest / (cells_[1] + 1)) + odd, 2 * (rest % (cells_[1] + 1)) + odd, 2 * k + odd};
  }
  Vec3 point(const Place& p) const { return origin_m_ + half_m_ * Vec3(p[0], p[1], p[2]); }
  Vec3 point(std::uint32_t slot) const { return point(place(slot)); }

  static bool is_long(std::uint64_t edge) { return edge % 7 < 3; }
  std::pair<std::uint32_t, std::uint32_t> ends(std::uint64_t edge) const {
    const auto a = static_cast<std::uint32_t>(edge / 7);
    return {a, slot(plus(place(a), kSteps[edge % 7]))};
  }
  std::uint64_t edge_between(std::uint32_t a, std::uint32_t b) const {
    const Place p = place(a), q = place(b);
    const Place d{q[0] - p[0], q[1] - p[1], q[2] - p[2]}, back{-d[0], -d[1], -d[2]};
    for (std::uint64_t n = 0; n < 7; ++n) {
      if (kSteps[n] == d) return 7 * std::uint64_t{a} + n;
      if (kSteps[n] == back) return 7 * std::uint64_t{b} + n;
    }
    SECTIO_ASSERT(false, "the two points are no neighbours");
    return 0;
  }

  // Calls visit(edge, a, b) for all edges at a point.
  template <class Visit>
  void for_edges_at(std::uint32_t v, Visit visit) const {
    const Place p = place(v);
    for (std::uint64_t n = 0; n < 7; ++n) {
      const Place ahead = plus(p, kSteps[n]);
      const Place behind{p[0] - kSteps[n][0], p[1] - kSteps[n][1], p[2] - kSteps[n][2]};
      if (contains(ahead)) visit(7 * std::uint64_t{v} + n, v, slot(ahead));
      if (contains(behind)) visit(7 * std::uint64_t{slot(behind)} + n, slot(behind), v);
    }
  }

  // Calls visit(edge, p, q) for all edges whose boxes might meet the box.
  template <class Visit>
  void for_edges_near(const Box3& box, Visit visit) const {
    constexpr double kRounding = 1e-6;
    const Vec3 low = (box.min() - origin_m_) / half_m_, high = (box.max() - origin_m_) / half_m_;
    for (std::uint64_t n = 0; n < 7; ++n) {
      Place from, to;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        from[i] = std::max(0, static_cast<int>(std::ceil(low[k] - std::max(0, kSteps[n][i]) - kRounding)));
        to[i] = std::min(2 * cells_[i], static_cast<int>(std::floor(high[k] - std::min(0, kSteps[n][i]) + kRounding)));
      }
      for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1] + ((from[1] ^ x) & 1); y <= to[1]; y += 2)
          for (int z = from[2] + ((from[2] ^ x) & 1); z <= to[2]; z += 2) {
            const Place p{x, y, z}, q = plus(p, kSteps[n]);
            if (contains(p) && contains(q)) visit(7 * std::uint64_t{slot(p)} + n, point(p), point(q));
          }
    }
  }

  // Calls visit(point, earlier point, edge between them) for all points but the first, each after the point that it is
  // reached from.
  template <class Visit>
  void for_points(Visit visit) const {
    for (int i = 0; i <= cells_[0]; ++i)
      for (int j = 0; j <= cells_[1]; ++j)
        for (int k = 0; k <= cells_[2]; ++k) {
          const Place p{2 * i, 2 * j, 2 * k};
          const std::uint64_t axis = k > 0 ? 2 : j > 0 ? 1 : 0;
          Place before = p;
          before[axis] -= 2;
          if (contains(before)) visit(slot(p), slot(before), 7 * std::uint64_t{slot(before)} + axis);
          const Place centre = plus(p, kSteps[3]);
          if (contains(centre)) visit(slot(centre), slot(p), 7 * std::uint64_t{slot(p)} + 3);
        }
  }

  // Calls visit(tetrahedron) for all tetrahedra, positively oriented, corners by slot.
  template <class Visit>
  void for_tetrahedra(Visit visit) const {
    for (int i = 0; i < cells_[0]; ++i)
      for (int j = 0; j < cells_[1]; ++j)
        for (int k = 0; k < cells_[2]; ++k)
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const Place c{2 * i + 1, 2 * j + 1, 2 * k + 1};
            Place next = c;
            next[axis] += 2;
            if (!contains(next)) continue;
            const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
            constexpr int kAround[5][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}, {1, 1}};
            for (std::size_t m = 0; m < 4; ++m) {
              Place q = c, r = c;
              ++q[axis], ++r[axis];
              q[u] += kAround[m][0], q[w] += kAround[m][1];
              r[u] += kAround[m + 1][0], r[w] += kAround[m + 1][1];
              visit(Tetrahedron{slot(c), slot(next), slot(q), slot(r)});
            }
          }
  }

 private:
  static constexpr Place kSteps[7] = {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};

  static Place plus(const Place& p, const Place& d) { return {p[0] + d[0], p[1] + d[1], p[2] + d[2]}; }
  // Along each axis there are corners 0 .. cells and centres 0 .. cells - 1.
  bool contains(const Place& p) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (p[i] < 0 || p[i] > 2 * cells_[i]) return false;
    return true;
  }

  Vec3 origin_m_;
  double half_m_;
  std::array<int, 3> cells_{};
};

}  // namespace sectio
