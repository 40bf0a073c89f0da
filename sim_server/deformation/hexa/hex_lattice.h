// Virtual nodes (Molino 2004; methods 1.6 M4): a lattice of cubic cells around a body given as tetrahedra, which carry
// no mechanics here: they say how much material is in a cell and what of it hangs together.
//
//   cell    one copy for each component of the material in it: tetrahedra are one where a face that they share passes
//           through the cell. So a cell that a cut crosses whole has two copies, one that it ends in has one
//   node    corners of two copies in neighbouring cells are one node where their material meets in the face between
//           the cells; chains of such meetings around a corner join, too
//   fill    of a copy: its material's volume over the cell's. The fills of all add up to the body's volume
//
// Each vertex of the tetrahedra rides on one copy, by eight weights. Deterministic; O(n log n). Pure functions.
#pragma once

#include <functional>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/hexa/grid_pieces.h"

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

// Numbers of tetrahedra and vertices that are not used any more (kNoTetrahedron) are passed over.
HexLattice lattice_of(const TetMesh& mesh, const Grid& grid,
                      const std::function<double(std::uint32_t tetrahedron)>& stiffness_factor = {});

// The origin is the lower corner of the mesh's box: a box of whole cells is filled by them.
Grid grid_around(const TetMesh& mesh, double cell_m);

// After tetrahedra were split and parted, which only divides copies, or some have left: for each cell of `now` the one
// of `before` whose material it has.
std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before, const TetMesh& mesh_before);

}  // namespace sectio
