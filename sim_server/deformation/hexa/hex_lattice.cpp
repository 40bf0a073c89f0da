#include "sim_server/deformation/hexa/hex_lattice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kLeastVolume = 1e-9;  // cells: less of a tetrahedron in a cell is none of it
constexpr double kLeastArea = 1e-9;

class Joined {
 public:
  explicit Joined(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t of(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = of(a), b = of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

bool earlier(const GridPlace& a, const GridPlace& b) {
  return std::tuple(a[2], a[1], a[0]) < std::tuple(b[2], b[1], b[0]);
}

// The axis along which b comes next after a, 3 when it doesn't.
std::size_t next_along(const GridPlace& a, const GridPlace& b) {
  std::size_t axis = 3;
  for (std::size_t k = 0; k < 3; ++k) {
    if (a[k] == b[k]) continue;
    if (b[k] != a[k] + 1 || axis != 3) return 3;
    axis = k;
  }
  return axis;
}

struct SharedFace {
  std::array<VertexId, 3> corners;
  std::uint32_t a = 0, b = 0;  // tetrahedra
};

// Those that one tetrahedron has are twice its own: outside.
std::vector<SharedFace> all_faces(const TetMesh& mesh) {
  std::vector<SharedFace> sides, faces;
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (const auto& face : kTetFaces) {
      if (mesh.tetrahedra[t] == kNoTetrahedron) break;
      std::array<VertexId, 3> v{mesh.tetrahedra[t][face[0]], mesh.tetrahedra[t][face[1]], mesh.tetrahedra[t][face[2]]};
      std::ranges::sort(v);
      sides.push_back({v, t, t});
    }
  std::ranges::stable_sort(sides, {}, &SharedFace::corners);
  for (const SharedFace& side : sides)
    if (!faces.empty() && faces.back().corners == side.corners)
      faces.back().b = side.a;
    else
      faces.push_back(side);
  return faces;
}

class Builder {
 public:
  Builder(const TetMesh& mesh, const Grid& grid, const std::function<double(std::uint32_t)>& factor)
      : mesh_(mesh), factor_(factor) {
    lattice_.grid = grid;
    lattice_.outside.assign(mesh.vertices_body_m.size(), 0);
    for (const Vec3& x : mesh.vertices_body_m) at_.push_back(grid.at(x));
  }

  HexLattice build() {
    share_out();
    Joined together(lattice_.shares.size());
    join_material(together);
    make_cells(together);
    make_nodes();
    bind_points();
    return std::move(lattice_);
  }

 private:
  void share_out() {
    std::vector<GridPiece> pieces;
    first_.push_back(0);
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      const Tetrahedron& c = mesh_.tetrahedra[t];
      if (c == kNoTetrahedron) {
        first_.push_back(first_.back());
        continue;
      }
      pieces_of({at_[c[0]], at_[c[1]], at_[c[2]], at_[c[3]]}, pieces);
      for (const GridPiece& p : pieces)
        if (p.size > kLeastVolume) lattice_.shares.push_back({t, 0, p.cell, p.size, p.centroid});
      first_.push_back(static_cast<std::uint32_t>(lattice_.shares.size()));
    }
  }

  std::uint32_t share_of(std::uint32_t t, const GridPlace& place) const {
    for (std::uint32_t s = first_[t]; s < first_[t + 1]; ++s)
      if (lattice_.shares[s].place == place) return s;
    return kNone;
  }

  void join_material(Joined& together) {
    std::vector<GridPiece> pieces;
    for (const SharedFace& face : all_faces(mesh_)) {
      if (face.a == face.b) {
        for (const VertexId v : face.corners) lattice_.outside[v] = 1;
        continue;
      }
      const std::array<Vec3, 3> x{at_[face.corners[0]], at_[face.corners[1]], at_[face.corners[2]]};
      pieces_of(x, pieces);
      Eigen::Index flat = 3;  // the face lies in a plane of the grid, between cells
      for (Eigen::Index k = 0; k < 3; ++k)
        if (x[0][k] == x[1][k] && x[0][k] == x[2][k] && x[0][k] == std::round(x[0][k])) flat = k;
      for (const GridPiece& p : pieces) {
        if (p.size < kLeastArea) continue;
        GridPlace below = p.cell;
        if (flat < 3) --below[static_cast<std::size_t>(flat)];
        const bool a_below = flat < 3 && centre(face.a)[flat] < x[0][flat];
        const std::uint32_t a = share_of(face.a, a_below ? below : p.cell);
        const std::uint32_t b = share_of(face.b, flat < 3 && !a_below ? below : p.cell);
        if (a == kNone || b == kNone) continue;
        if (flat == 3)
          together.join(a, b);
        else
          meetings_.push_back(a_below ? std::pair(a, b) : std::pair(b, a));
      }
    }
    for (std::uint32_t t = 0; t + 1 < first_.size(); ++t)
      for (std::uint32_t a = first_[t]; a < first_[t + 1]; ++a)
        for (std::uint32_t b = first_[t]; b < first_[t + 1]; ++b)
          if (next_along(lattice_.shares[a].place, lattice_.shares[b].place) < 3) meetings_.emplace_back(a, b);
  }

  Vec3 centre(std::uint32_t t) const {
    const Tetrahedron& c = mesh_.tetrahedra[t];
    return 0.25 * (at_[c[0]] + at_[c[1]] + at_[c[2]] + at_[c[3]]);
  }

  void make_cells(Joined& together) {
    std::vector<std::uint32_t> roots;
    for (std::uint32_t s = 0; s < lattice_.shares.size(); ++s)
      if (together.of(s) == s) roots.push_back(s);
    std::ranges::stable_sort(roots, earlier, [&](std::uint32_t s) { return lattice_.shares[s].place; });
    std::vector<std::uint32_t> cell_of(lattice_.shares.size(), kNone);
    for (const std::uint32_t s : roots) {
      cell_of[s] = static_cast<std::uint32_t>(lattice_.cells.size());
      lattice_.cells.push_back({lattice_.shares[s].place, {}, 0, 0});
    }
    for (std::uint32_t s = 0; s < lattice_.shares.size(); ++s) {
      HexShare& share = lattice_.shares[s];
      share.cell = cell_of[together.of(s)];
      HexCell& cell = lattice_.cells[share.cell];
      cell.fill += share.volume;
      cell.stiffness += share.volume * (factor_ ? factor_(share.tet) : 1);
    }
    for (HexCell& cell : lattice_.cells) cell.stiffness /= cell.fill;
  }

  void make_nodes() {
    Joined corners(8 * lattice_.cells.size());
    for (const auto& [low, high] : meetings_) {
      const HexShare &a = lattice_.shares[low], &b = lattice_.shares[high];
      const std::uint32_t step = 1u << next_along(a.place, b.place);
      for (std::uint32_t c = 0; c < 8; ++c)
        if ((c & step) != 0) corners.join(8 * a.cell + c, 8 * b.cell + (c ^ step));
    }
    std::vector<std::uint32_t> node_of(8 * lattice_.cells.size(), kNone);
    for (std::uint32_t i = 0; i < node_of.size(); ++i) {
      HexCell& cell = lattice_.cells[i / 8];
      std::uint32_t& node = node_of[corners.of(i)];
      if (node == kNone) {
        node = static_cast<std::uint32_t>(lattice_.nodes.size());
        const int c = static_cast<int>(i % 8);
        lattice_.nodes.push_back({cell.place[0] + (c & 1), cell.place[1] + (c >> 1 & 1), cell.place[2] + (c >> 2 & 1)});
      }
      cell.nodes[i % 8] = node;
    }
  }

  // To the copy that a tetrahedron of the vertex has nearest to it, of several the fullest by that tetrahedron.
  void bind_points() {
    lattice_.points.resize(at_.size());
    std::vector<std::pair<double, double>> best(at_.size(), {HUGE_VAL, 0});
    for (const HexShare& share : lattice_.shares) {
      const Vec3 corner(share.place[0], share.place[1], share.place[2]);
      for (const VertexId v : mesh_.tetrahedra[share.tet]) {
        const Vec3 local = at_[v] - corner;
        const double beyond = (local - local.cwiseMax(0).cwiseMin(1)).squaredNorm();
        const std::pair<double, double> rank{beyond, -share.volume};
        if (!(rank < best[v])) continue;
        best[v] = rank;
        lattice_.points[v] = {share.cell, local};
      }
    }
  }

  const TetMesh& mesh_;
  const std::function<double(std::uint32_t)>& factor_;
  std::vector<Vec3> at_;
  HexLattice lattice_;
  std::vector<std::uint32_t> first_;                               // of the shares of a tetrahedron
  std::vector<std::pair<std::uint32_t, std::uint32_t>> meetings_;  // shares in neighbouring cells, the lower one first
};

}  // namespace

Grid grid_around(const TetMesh& mesh, double cell_m) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.vertices_body_m) box.extend(x);
  if (!(((box.sizes() / cell_m).array() + 1).prod() < 5e6))
    throw InputError("cells of the lattice too small: more than 5 million");
  return {box.min(), cell_m};
}

HexLattice lattice_of(const TetMesh& mesh, const Grid& grid,
                      const std::function<double(std::uint32_t)>& stiffness_factor) {
  return Builder(mesh, grid, stiffness_factor).build();
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
    double most = -HUGE_VAL;  // of the least barycentric coordinate: the tetrahedron that p is in
    for (const std::uint32_t s : std::ranges::equal_range(by_place, now.cells[c].place, {}, place_of)) {
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
