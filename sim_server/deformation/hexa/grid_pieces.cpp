#include "sim_server/deformation/hexa/grid_pieces.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace sectio {
namespace {

constexpr double kOnPlane = 1e-5;  // cells; files have coordinates in single precision

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

// The parts of a simplex, each in one cell; valid until the next call.
template <std::size_t N>
std::span<const Simplex<N>> cut_up(const Simplex<N>& whole) {
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
  return now;
}

template <std::size_t N>
Vec3 centroid_of(const Simplex<N>& s) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& x : s) sum += x / double(N);
  return sum;
}

GridPlace cell_at(const Vec3& x) {
  GridPlace cell;
  for (std::size_t k = 0; k < 3; ++k) cell[k] = static_cast<int>(std::floor(x[static_cast<Eigen::Index>(k)]));
  return cell;
}

// The mean squares over a simplex: (sum x_i^2 + (sum x_i)^2) / (N (N + 1)).
template <std::size_t N>
Vec3 mean_squares(const Simplex<N>& s, const GridPlace& from) {
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (const Vec3& x : s) {
    const Vec3 y = x - Vec3(from[0], from[1], from[2]);
    sum += y;
    squares += y.cwiseProduct(y);
  }
  return (squares + sum.cwiseProduct(sum)) / double(N * (N + 1));
}

template <std::size_t N>
void pieces(const Simplex<N>& whole, std::vector<GridPiece>& out) {
  out.clear();
  for (const Simplex<N>& s : cut_up(whole)) {
    const Vec3 centroid = centroid_of(s);
    GridPiece piece;
    piece.cell = cell_at(centroid);
    const auto at = std::lower_bound(out.begin(), out.end(), piece.cell,
                                     [](const GridPiece& p, const GridPlace& cell) { return p.cell < cell; });
    const auto same = at != out.end() && at->cell == piece.cell ? at : out.insert(at, piece);
    const double size = size_of(s);
    same->size += size;
    same->centroid += size * centroid;
    same->square += size * mean_squares(s, piece.cell);
  }
  for (GridPiece& p : out) {
    if (!(p.size > 0)) continue;
    p.centroid /= p.size;
    p.square /= p.size;
  }
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
void triangles_of(const std::array<Vec3, 3>& triangle, std::vector<GridTriangle>& out) {
  out.clear();
  for (const std::array<Vec3, 3>& part : cut_up(triangle)) out.push_back({cell_at(centroid_of(part)), part});
}

}  // namespace sectio
