#include "sim_server/deformation/hexa/hex_lattice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/sort_unique.h"
#include "common/math/disjoint_sets.h"

namespace sectio {
namespace {

constexpr double kLeastVolume = 1e-9;  // in cells; smaller shares of a tetrahedron are rounding
constexpr double kLeastArea = 1e-9;    // in faces of a cell
constexpr double kLeastSpread = 0.05;  // so that the far corners of a crumb's cell don't drift

bool earlier(const GridPlace& a, const GridPlace& b) {
  return std::tuple(a[2], a[1], a[0]) < std::tuple(b[2], b[1], b[0]);
}

// The axis along which b is the next place after a, or 3.
std::size_t next_along(const GridPlace& a, const GridPlace& b) {
  std::size_t axis = 3;
  for (std::size_t k = 0; k < 3; ++k) {
    if (a[k] == b[k]) continue;
    if (b[k] != a[k] + 1 || axis != 3) return 3;
    axis = k;
  }
  return axis;
}

Vec3 centre(const TetMesh& mesh, const Grid& grid, std::uint32_t t) {
  Vec3 sum = Vec3::Zero();
  for (const VertexId v : mesh.tetrahedra[t]) sum += 0.25 * grid.at(mesh.vertices_body_m[v]);
  return sum;
}

std::uint32_t across(std::uint32_t t, std::size_t corner, const TetMesh& mesh, const TetStars& stars) {
  const Tetrahedron& c = mesh.tetrahedra[t];
  const auto& [i, j, k] = kTetFaces[corner];
  for (const std::uint32_t u : stars.of(c[i]))
    if (u != t && corner_of(mesh.tetrahedra[u], c[j]) < 4 && corner_of(mesh.tetrahedra[u], c[k]) < 4) return u;
  return kNone;
}

std::uint32_t number_of(std::span<const HexShare> shares, const GridPlace& place) {
  const auto at = std::ranges::find(shares, place, &HexShare::place);
  return at == shares.end() ? kNone : static_cast<std::uint32_t>(at - shares.begin());
}

// Assembles the cells and nodes of a lattice from shares and their contacts.
class Assembly {
 public:
  explicit Assembly(HexLattice& lattice) : lattice_(lattice), together_(lattice.shares.size()) {}

  void join(std::uint32_t a, std::uint32_t b) { together_.join(a, b); }
  void meet(std::uint32_t low, std::uint32_t high) { meetings_.emplace_back(low, high); }

  void make_cells(const std::function<double(std::uint32_t)>& factor,
                  const std::function<bool(std::uint32_t)>& is_fixed) {
    std::vector<std::uint32_t> roots;
    for (std::uint32_t s = 0; s < lattice_.shares.size(); ++s)
      if (together_.root(s) == s) roots.push_back(s);
    std::ranges::stable_sort(roots, earlier, [&](std::uint32_t s) { return lattice_.shares[s].place; });
    std::vector<std::uint32_t> cell_of(lattice_.shares.size(), kNone);
    for (const std::uint32_t s : roots) {
      cell_of[s] = static_cast<std::uint32_t>(lattice_.cells.size());
      lattice_.cells.emplace_back().place = lattice_.shares[s].place;
    }
    for (HexCell& cell : lattice_.cells) cell.spread.setZero();
    for (std::uint32_t s = 0; s < lattice_.shares.size(); ++s) {
      HexShare& share = lattice_.shares[s];
      share.cell = cell_of[together_.root(s)];
      if (is_fixed(share.tet)) continue;
      HexCell& cell = lattice_.cells[share.cell];
      cell.fill += share.volume;
      cell.stiffness += share.volume * (factor ? factor(share.tet) : 1);
      cell.offset += share.volume * (share.centroid - Vec3(cell.place[0], cell.place[1], cell.place[2]));
      cell.spread += share.volume * share.square;
    }
    for (HexCell& cell : lattice_.cells) {
      if (cell.fill == 0) {
        cell.spread = HexCell{}.spread;
        continue;
      }
      cell.stiffness /= cell.fill;
      const Vec3 mean = cell.offset / cell.fill;  // from 0 to 1
      cell.spread = 4 * (cell.spread / cell.fill - mean.cwiseProduct(mean)).cwiseMax(kLeastSpread);
      cell.offset = (2 * mean - Vec3::Ones()).cwiseMax(-1).cwiseMin(1);
    }
  }

  void make_nodes() {
    DisjointSets corners(8 * lattice_.cells.size());
    for (const auto& [low, high] : meetings_) {
      const HexShare &a = lattice_.shares[low], &b = lattice_.shares[high];
      const std::uint32_t step = 1u << next_along(a.place, b.place);
      for (std::uint32_t c = 0; c < 8; ++c)
        if ((c & step) != 0) corners.join(8 * a.cell + c, 8 * b.cell + (c ^ step));
    }
    std::vector<std::uint32_t> node_of(8 * lattice_.cells.size(), kNone);
    for (std::uint32_t i = 0; i < node_of.size(); ++i) {
      HexCell& cell = lattice_.cells[i / 8];
      std::uint32_t& node = node_of[corners.root(i)];
      if (node == kNone) {
        node = static_cast<std::uint32_t>(lattice_.nodes.size());
        const int c = static_cast<int>(i % 8);
        lattice_.nodes.push_back({cell.place[0] + (c & 1), cell.place[1] + (c >> 1 & 1), cell.place[2] + (c >> 2 & 1)});
      }
      cell.nodes[i % 8] = node;
    }
  }

 private:
  HexLattice& lattice_;
  DisjointSets together_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> meetings_;  // shares in neighbouring cells, lower place first
};

// Embeds each vertex in the nearest copy that has a share of one of its tetrahedra; of several, that with the largest
// share.
void bind_points(const TetMesh& mesh, HexLattice& lattice) {
  std::vector<Vec3> at;
  for (const Vec3& x : mesh.vertices_body_m) at.push_back(lattice.grid.at(x));
  lattice.points.resize(at.size());
  std::vector<std::pair<double, double>> best(at.size(), {HUGE_VAL, 0});
  for (const HexShare& share : lattice.shares) {
    const Vec3 corner(share.place[0], share.place[1], share.place[2]);
    for (const VertexId v : mesh.tetrahedra[share.tet]) {
      const Vec3 local = at[v] - corner;
      const double beyond = (local - local.cwiseMax(0).cwiseMin(1)).squaredNorm();
      const std::pair<double, double> rank{beyond, -share.volume};
      if (!(rank < best[v])) continue;
      best[v] = rank;
      lattice.points[v] = {share.cell, local};
    }
  }
}

}  // namespace

// A face of a tetrahedron, in cells.
struct LatticeMaker::Face {
  std::array<Vec3, 3> x;
  std::uint8_t flat = 3;  // the axis across which it lies in a plane of the grid, between cells
  bool is_below = false;  // the tetrahedron is below the plane
};

LatticeMaker::Face LatticeMaker::face_of(std::uint32_t t, std::size_t corner, const TetMesh& mesh) const {
  Face face;
  for (std::size_t k = 0; k < 3; ++k)
    face.x[k] = grid_.at(mesh.vertices_body_m[mesh.tetrahedra[t][kTetFaces[corner][k]]]);
  for (std::uint8_t k = 0; k < 3; ++k)
    if (face.x[0][k] == face.x[1][k] && face.x[0][k] == face.x[2][k] && face.x[0][k] == std::round(face.x[0][k]))
      face.flat = k;
  face.is_below = face.flat < 3 && centre(mesh, grid_, t)[face.flat] < face.x[0][face.flat];
  return face;
}

void LatticeMaker::look_at(std::span<const std::uint32_t> tetrahedra, const TetMesh& mesh, const TetStars& stars,
                           const IsFixed& is_fixed) {
  known_.resize(mesh.tetrahedra.size());
  for (const std::uint32_t t : tetrahedra) {
    known_[t] = {};
    if (mesh.tetrahedra[t] == kNoTetrahedron) continue;
    share_out(t, mesh);
    known_[t].is_fixed = is_fixed && std::ranges::all_of(mesh.tetrahedra[t], is_fixed);
  }
  std::vector<std::uint32_t> around(tetrahedra.begin(), tetrahedra.end());
  for (const std::uint32_t t : tetrahedra)
    for (std::size_t corner = 0; corner < 4 && mesh.tetrahedra[t] != kNoTetrahedron; ++corner)
      if (const std::uint32_t u = across(t, corner, mesh, stars); u != kNone) around.push_back(u);
  sort_unique(around);
  for (const std::uint32_t t : around)
    if (mesh.tetrahedra[t] != kNoTetrahedron) find_contacts(t, mesh, stars, is_fixed);
}

void LatticeMaker::share_out(std::uint32_t t, const TetMesh& mesh) {
  thread_local std::vector<GridPiece> pieces;
  std::array<Vec3, 4> x;
  for (std::size_t k = 0; k < 4; ++k) x[k] = grid_.at(mesh.vertices_body_m[mesh.tetrahedra[t][k]]);
  pieces_of(x, pieces);
  for (const GridPiece& p : pieces)
    if (p.size > kLeastVolume) known_[t].shares.push_back({t, 0, p.cell, p.size, p.centroid, p.square});
  const std::vector<HexShare>& shares = known_[t].shares;
  for (std::uint32_t a = 0; a < shares.size(); ++a)
    for (std::uint32_t b = 0; b < shares.size(); ++b)
      if (next_along(shares[a].place, shares[b].place) < 3) known_[t].within.push_back({a, t, b});
}

void LatticeMaker::find_contacts(std::uint32_t t, const TetMesh& mesh, const TetStars& stars, const IsFixed& is_fixed) {
  thread_local std::vector<GridPiece> pieces;
  Known& known = known_[t];
  known.across.clear();
  known.skin.clear();
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const std::uint32_t u = across(t, corner, mesh, stars);
    known.outside[corner] = u == kNone;
    if (is_fixed && !known.is_fixed && (u == kNone || known_[u].is_fixed)) {
      const auto& [i, j, k] = kTetFaces[corner];
      const Tetrahedron& c = mesh.tetrahedra[t];
      find_skin(face_of(t, corner, mesh), is_fixed(c[i]) && is_fixed(c[j]) && is_fixed(c[k]), known);
    }
    if (u == kNone || u < t) continue;
    const Face face = face_of(t, corner, mesh);
    pieces_of(face.x, pieces);
    for (const GridPiece& p : pieces) {
      if (p.size < kLeastArea) continue;
      GridPlace own = p.cell, other = p.cell;
      if (face.flat < 3) --(face.is_below ? own : other)[face.flat];
      const std::uint32_t mine = number_of(known.shares, own), theirs = number_of(known_[u].shares, other);
      if (mine != kNone && theirs != kNone) known.across.push_back({mine, u, theirs});
    }
  }
}

void LatticeMaker::find_skin(const Face& face, bool fixed, Known& known) const {
  thread_local std::vector<GridTriangle> triangles;
  if (!fixed && face.flat == 3) return;
  triangles_of(face.x, triangles);
  for (GridTriangle& part : triangles) {
    if (face.flat < 3 && face.is_below) --part.cell[face.flat];
    const std::uint32_t share = number_of(known.shares, part.cell);
    if (share != kNone) known.skin.push_back({share, face.flat, fixed, part.corners});
  }
}

HexLattice LatticeMaker::make(const TetMesh& mesh, const std::function<double(std::uint32_t)>& stiffness_factor) const {
  HexLattice lattice;
  lattice.grid = grid_;
  lattice.outside.assign(mesh.vertices_body_m.size(), 0);
  std::vector<std::uint32_t> first{0};  // by tetrahedron: index of its first share
  for (std::uint32_t t = 0; t < known_.size(); ++t) {
    lattice.shares.insert(lattice.shares.end(), known_[t].shares.begin(), known_[t].shares.end());
    first.push_back(static_cast<std::uint32_t>(lattice.shares.size()));
    for (std::size_t corner = 0; corner < 4; ++corner)
      for (std::size_t k = 0; k < 3 && known_[t].outside[corner] != 0; ++k)
        lattice.outside[mesh.tetrahedra[t][kTetFaces[corner][k]]] = 1;
  }
  Assembly assembly(lattice);
  for (std::uint32_t t = 0; t < known_.size(); ++t) {
    for (const Contact& c : known_[t].within) assembly.meet(first[t] + c.own, first[t] + c.other);
    for (const Contact& c : known_[t].across) {
      const std::uint32_t own = first[t] + c.own, other = first[c.tet] + c.other;
      const GridPlace &a = lattice.shares[own].place, &b = lattice.shares[other].place;
      if (a == b)
        assembly.join(own, other);
      else
        next_along(a, b) < 3 ? assembly.meet(own, other) : assembly.meet(other, own);
    }
  }
  assembly.make_cells(stiffness_factor, [&](std::uint32_t t) { return known_[t].is_fixed; });
  assembly.make_nodes();
  for (std::uint32_t t = 0; t < known_.size(); ++t)
    for (const HexSkin& part : known_[t].skin) {
      lattice.skin.push_back(part);
      lattice.skin.back().cell = lattice.shares[first[t] + part.cell].cell;
    }
  bind_points(mesh, lattice);
  return lattice;
}

Grid grid_around(const TetMesh& mesh, double cell_m) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.vertices_body_m) box.extend(x);
  if (!(((box.sizes() / cell_m).array() + 1).prod() < 5e6))
    throw InputError("volume: cell_m is too small: the body would have more than 5 million cells");
  if (const double length_m = box.sizes().maxCoeff(); cell_m > length_m) {
    throw InputError(formatted("volume: cell_m: a cell of %.3g m is larger than the whole body, which is %.3g m long",
                               cell_m, length_m));
  }
  return {box.min(), cell_m};
}

HexLattice lattice_of(const TetMesh& mesh, const Grid& grid,
                      const std::function<double(std::uint32_t)>& stiffness_factor) {
  LatticeMaker maker(grid);
  std::vector<std::uint32_t> all(mesh.tetrahedra.size());
  std::iota(all.begin(), all.end(), 0u);
  maker.look_at(all, mesh, TetStars(mesh));
  return maker.make(mesh, stiffness_factor);
}

namespace {

// The entries of a sorted list that have this key.
template <class T, class Key, class KeyOf>
std::span<const T> equal_to(const std::vector<T>& list, const Key& key, const KeyOf& key_of) {
  return {std::ranges::lower_bound(list, key, {}, key_of), std::ranges::upper_bound(list, key, {}, key_of)};
}

}  // namespace

std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before,
                                        const std::function<std::uint32_t(std::uint32_t)>& origin) {
  std::vector<std::uint32_t> from(now.cells.size(), kNone);
  for (const HexShare& share : now.shares) {
    if (from[share.cell] != kNone) continue;
    const auto of_origin = equal_to(before.shares, origin(share.tet), &HexShare::tet);
    const auto at = std::ranges::find(of_origin, share.place, &HexShare::place);
    if (at != of_origin.end()) from[share.cell] = at->cell;
  }
  for (const HexShare& share : now.shares) {
    if (from[share.cell] != kNone) continue;
    const auto of_origin = equal_to(before.shares, origin(share.tet), &HexShare::tet);
    SECTIO_ASSERT(!of_origin.empty(), "material was there before");
    from[share.cell] = std::ranges::max_element(of_origin, {}, &HexShare::volume)->cell;
  }
  return from;
}

std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before, const TetMesh& mesh_before) {
  std::vector<std::uint32_t> by_place(before.shares.size());
  std::iota(by_place.begin(), by_place.end(), 0u);
  const auto place_of = [&](std::uint32_t s) { return before.shares[s].place; };
  std::ranges::stable_sort(by_place, {}, place_of);
  std::vector<const HexShare*> largest(now.cells.size(), nullptr);
  for (const HexShare& share : now.shares)
    if (!largest[share.cell] || share.volume > largest[share.cell]->volume) largest[share.cell] = &share;
  std::vector<std::uint32_t> from(now.cells.size(), kNone);
  for (std::uint32_t c = 0; c < from.size(); ++c) {
    const Vec3& p = largest[c]->centroid;
    double most = -HUGE_VAL;  // the largest least barycentric coordinate: that of the tetrahedron that contains p
    std::span<const std::uint32_t> near = equal_to(by_place, now.cells[c].place, place_of);
    if (near.empty()) near = by_place;
    for (const std::uint32_t s : near) {
      const HexShare& share = before.shares[s];
      std::array<Vec3, 4> x;
      for (std::size_t k = 0; k < 4; ++k)
        x[k] = before.grid.at(mesh_before.vertices_body_m[mesh_before.tetrahedra[share.tet][k]]);
      const double whole = tet_volume_m3(x[0], x[1], x[2], x[3]);
      double least = HUGE_VAL;
      for (std::size_t k = 0; k < 4; ++k) {
        std::array<Vec3, 4> y = x;
        y[k] = p;
        least = std::min(least, tet_volume_m3(y[0], y[1], y[2], y[3]) / whole);
      }
      if (!(least > most)) continue;
      most = least;
      from[c] = share.cell;
    }
    SECTIO_ASSERT(from[c] != kNone, "material was there before");
  }
  return from;
}

}  // namespace sectio
