#include "sim_server/deformation/hexa/grid_pieces.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kOnPlane = 1e-9;  // cells

template <std::size_t N>
using Simplex = std::array<Vec3, N>;

double size_of(const Simplex<4>& s) {
  return std::abs((s[1] - s[0]).cross(s[2] - s[0]).dot(s[3] - s[0])) / 6;
}
double size_of(const Simplex<3>& s) {
  return 0.5 * (s[1] - s[0]).cross(s[2] - s[0]).norm();
}

// Bisects an edge that crosses the plane, and goes on with both halves, which have one crossed edge less.
template <std::size_t N>
void bisect(const Simplex<N>& s, int axis, double plane, std::vector<Simplex<N>>& out) {
  std::size_t low = N, high = N;
  for (std::size_t i = 0; i < N; ++i) {
    if (s[i][axis] < plane) low = i;
    if (s[i][axis] > plane) high = i;
  }
  if (low == N || high == N) {
    out.push_back(s);
    return;
  }
  const Vec3 &a = s[low], &b = s[high];
  Vec3 n = a + (plane - a[axis]) / (b[axis] - a[axis]) * (b - a);
  n[axis] = plane;
  Simplex<N> half = s;
  half[high] = n;
  bisect(half, axis, plane, out);
  half = s;
  half[low] = n;
  bisect(half, axis, plane, out);
}

template <std::size_t N>
void pieces(const Simplex<N>& whole, std::vector<GridPiece>& out) {
  thread_local std::vector<Simplex<N>> now, next;
  now.assign(1, whole);
  for (int axis = 0; axis < 3; ++axis) {
    double least = whole[0][axis], most = least;
    for (const Vec3& x : whole) least = std::min(least, x[axis]), most = std::max(most, x[axis]);
    for (double plane = std::floor(least) + 1; plane < most; ++plane) {
      next.clear();
      for (const Simplex<N>& s : now) bisect(s, axis, plane, next);
      now.swap(next);
    }
  }
  out.clear();
  for (const Simplex<N>& s : now) {
    Vec3 centroid = Vec3::Zero();
    for (const Vec3& x : s) centroid += x / double(N);
    GridPiece piece;
    for (std::size_t k = 0; k < 3; ++k)
      piece.cell[k] = static_cast<int>(std::floor(centroid[static_cast<Eigen::Index>(k)]));
    const auto at = std::lower_bound(out.begin(), out.end(), piece.cell,
                                     [](const GridPiece& p, const GridPlace& cell) { return p.cell < cell; });
    const auto same = at != out.end() && at->cell == piece.cell ? at : out.insert(at, piece);
    same->size += size_of(s);
    same->centroid += size_of(s) * centroid;
  }
  for (GridPiece& p : out)
    if (p.size > 0) p.centroid /= p.size;
}

}  // namespace

Vec3 Grid::at(const Vec3& x_m) const {
  Vec3 u = (x_m - origin_m) / cell_m;
  for (double& c : u)
    if (std::abs(c - std::round(c)) < kOnPlane) c = std::round(c);
  return u;
}

void pieces_of(const std::array<Vec3, 4>& tetrahedron, std::vector<GridPiece>& out) {
  pieces(tetrahedron, out);
}
void pieces_of(const std::array<Vec3, 3>& triangle, std::vector<GridPiece>& out) {
  pieces(triangle, out);
}

}  // namespace sectio
