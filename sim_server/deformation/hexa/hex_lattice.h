// Virtual nodes (Molino 2004; methods 1.6 M4): a lattice of cubic cells around a body given as tetrahedra, which carry
// no mechanics here: they say how much material is in a cell and what of it hangs together.
//
//   cell    one copy for each component of the material in it: tetrahedra are one where a face that they share passes
//           through the cell. So a cell that a cut crosses whole has two copies, one that it ends in has one
//   node    corners of two copies in neighbouring cells are one node where their material meets in the face between
//           the cells; chains of such meetings around a corner join, too
//   fill    of a copy: its material's volume over the cell's. The fills of all add up to the body's volume
//
// Each vertex of the tetrahedra rides on one copy, by eight weights. Deterministic.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/hexa/grid_pieces.h"
#include "sim_server/deformation/tetra/tet_star.h"

namespace sectio {

// Corner c of a cell is at its place plus {c & 1, c >> 1 & 1, c >> 2 & 1}.
struct HexCell {
  GridPlace place{};
  std::array<std::uint32_t, 8> nodes{};
  double fill = 0;
  double stiffness = 0;  // mean of the factors of its material
};

// A point in a cell: where in it, 0 to 1 along each axis; a little beyond where its own cell holds too little.
struct HexPoint {
  std::uint32_t cell = 0;
  Vec3 local = Vec3::Zero();

  double weight(std::size_t corner) const {
    double w = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = local[static_cast<Eigen::Index>(k)];
      w *= (corner >> k & 1) != 0 ? x : 1 - x;
    }
    return w;
  }
};

// What of a tetrahedron is in a cell.
struct HexShare {
  std::uint32_t tet = 0;
  std::uint32_t cell = 0;
  GridPlace place{};
  double volume = 0;  // in cells
  Vec3 centroid = Vec3::Zero();
};

struct HexLattice {
  Grid grid;
  std::vector<HexCell> cells;         // ascending in place, z first
  std::vector<GridPlace> nodes;       // where they are at rest
  std::vector<HexPoint> points;       // of the mesh's vertices
  std::vector<std::uint8_t> outside;  // of these: on the surface
  std::vector<HexShare> shares;       // ascending in tetrahedron, then place

  Vec3 rest_m(std::uint32_t node) const { return grid.point_m(nodes[node]); }
};

// Makes lattices of a volume that is cut again and again: what each tetrahedron has in which cell, and where it passes
// into its neighbours, is kept for those that don't change. Numbers of tetrahedra and vertices that are not used any
// more (kNoTetrahedron) are passed over.
class LatticeMaker {
 public:
  explicit LatticeMaker(const Grid& grid) : grid_(grid) {}

  // To be called for all tetrahedra that are new, gone, or have another neighbour. O(these).
  void look_at(std::span<const std::uint32_t> tetrahedra, const TetMesh& mesh, const TetStars& stars);
  // `stiffness_factor`: of each tetrahedron; empty: 1. O(n).
  HexLattice make(const TetMesh& mesh,
                  const std::function<double(std::uint32_t tetrahedron)>& stiffness_factor = {}) const;

 private:
  // Between a share of one tetrahedron and one of another, or of the same: in one cell through a face, or in the next
  // one.
  struct Contact {
    std::uint32_t own = 0, tet = 0, other = 0;  // shares by their number in their tetrahedra
  };
  struct Known {
    std::vector<HexShare> shares;           // ascending in place
    std::vector<Contact> within;            // to shares of its own
    std::vector<Contact> across;            // to tetrahedra of higher numbers
    std::array<std::uint8_t, 4> outside{};  // faces opposite the corners
  };
  void share_out(std::uint32_t t, const TetMesh& mesh);
  void find_contacts(std::uint32_t t, const TetMesh& mesh, const TetStars& stars);

  Grid grid_;
  std::vector<Known> known_;
};

// All at once.
HexLattice lattice_of(const TetMesh& mesh, const Grid& grid,
                      const std::function<double(std::uint32_t tetrahedron)>& stiffness_factor = {});

// The origin is the lower corner of the mesh's box: a box of whole cells is filled by them.
Grid grid_around(const TetMesh& mesh, double cell_m);

// Of a part of a volume, or of one that was cut: for each cell of `now` the one of `before` whose material it has,
// found by where it is.
std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before, const TetMesh& mesh_before);
// The same, where `origin` names for each tetrahedron the one of before that it was cut out of. Where that had too
// little in the cell to count, by a rounding, it is the cell that it has most in.
std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before,
                                        const std::function<std::uint32_t(std::uint32_t)>& origin);

}  // namespace sectio
