// Virtual nodes (Molino et al. 2004): a lattice of cubic cells around a body given as tetrahedra. The tetrahedra have
// no mechanics here; they say how much material is in a cell, and which of it is connected.
//
//   cell    one copy for each component of the material in it: two tetrahedra are connected if a common face passes
//           through the cell. So a cell that a cut crosses has two copies, and one that a cut ends in has one
//   node    corners of copies in neighbouring cells are one node if the copies' material meets in the face between the
//           cells; a chain of such meetings around a corner connects all of its corners
//   fill    volume of a copy's material over that of the cell. The fills of all copies add up to the body's volume
//
// Each vertex of the tetrahedra is embedded in one copy, by eight weights. Deterministic.
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
  double stiffness = 0;  // mean stiffness factor of its material
  // The centroid of its material, in coordinates from -1 to 1 along each axis, and mean squares about that.
  Vec3 offset = Vec3::Zero(), spread = Vec3::Constant(1.0 / 3);
};

// A point in a cell, with coordinates from 0 to 1 along each axis; slightly beyond if its own cell has too little fill.
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

// The share of a tetrahedron in a cell.
struct HexShare {
  std::uint32_t tet = 0;
  std::uint32_t cell = 0;
  GridPlace place{};
  double volume = 0;  // in cells
  Vec3 centroid = Vec3::Zero();
  Vec3 square = Vec3::Zero();  // see GridPiece
};

// A part of the surface of the tissue that can move: fixed, or in a plane of the lattice; only where something is
// fixed. Tetrahedra all of whose corners are fixed don't count: cells have none of their stiffness and mass, and where
// they meet others the surface is fixed.
struct HexSkin {
  std::uint32_t cell = 0;  // the cell that has the material beneath
  std::uint8_t axis = 3;   // axis of the plane; 3: it lies in none
  bool fixed = false;      // all corners of its triangle are
  std::array<Vec3, 3> corners;
};

struct HexLattice {
  Grid grid;
  std::vector<HexCell> cells;         // ascending in place, z first
  std::vector<GridPlace> nodes;       // rest places
  std::vector<HexPoint> points;       // one a vertex of the mesh
  std::vector<std::uint8_t> outside;  // one a vertex: it is on the surface
  std::vector<HexShare> shares;       // ascending in tetrahedron, then place
  std::vector<HexSkin> skin;          // ascending in tetrahedron

  Vec3 rest_m(std::uint32_t node) const { return grid.point_m(nodes[node]); }
};

// Makes lattices of a volume that is cut again and again. The shares of a tetrahedron in the cells, and its contacts
// with its neighbours, are kept until it changes. Numbers of tetrahedra and vertices that are no longer in use
// (kNoTetrahedron) are skipped.
class LatticeMaker {
 public:
  explicit LatticeMaker(const Grid& grid) : grid_(grid) {}
  const Grid& grid() const { return grid_; }

  using IsFixed = std::function<bool(VertexId)>;  // empty: nothing is
  // Must be called for all tetrahedra that are new, removed, or have another neighbour. O(their number).
  void look_at(std::span<const std::uint32_t> tetrahedra, const TetMesh& mesh, const TetStars& stars,
               const IsFixed& is_fixed = {});
  // `stiffness_factor`: by tetrahedron; empty: 1. O(n).
  HexLattice make(const TetMesh& mesh,
                  const std::function<double(std::uint32_t tetrahedron)>& stiffness_factor = {}) const;

 private:
  // A contact between two shares, of one tetrahedron or of two: through a face within a cell, or between neighbouring
  // cells.
  struct Contact {
    std::uint32_t own = 0, tet = 0, other = 0;  // own, other: numbers of the shares in their tetrahedra
  };
  struct Known {
    std::vector<HexShare> shares;           // ascending in place
    std::vector<Contact> within;            // with shares of the same tetrahedron
    std::vector<Contact> across;            // with tetrahedra of higher numbers
    std::vector<HexSkin> skin;              // `cell` is the number of a share
    std::array<std::uint8_t, 4> outside{};  // the face opposite a corner is on the surface
    bool is_fixed = false;                  // all its corners are
  };
  void share_out(std::uint32_t t, const TetMesh& mesh);
  struct Face;
  Face face_of(std::uint32_t t, std::size_t corner, const TetMesh& mesh) const;
  void find_contacts(std::uint32_t t, const TetMesh& mesh, const TetStars& stars, const IsFixed& is_fixed);
  void find_skin(const Face& face, bool fixed, Known& known) const;

  Grid grid_;
  std::vector<Known> known_;
};

// Makes a lattice without a LatticeMaker.
HexLattice lattice_of(const TetMesh& mesh, const Grid& grid,
                      const std::function<double(std::uint32_t tetrahedron)>& stiffness_factor = {});

// The origin is the lower corner of the mesh's box, so that the cells fit a box whose sides are multiples of the cell.
Grid grid_around(const TetMesh& mesh, double cell_m);

// For the lattice of a part of a volume, or of a volume after a cut: for each cell of `now`, the cell of `before` that
// had its material, found by its place.
std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before, const TetMesh& mesh_before);
// The same, where `origin` names for each tetrahedron the former one that it was cut out of. If that one's share of the
// cell was below the rounding limit, the result is the cell in which it has its largest share.
std::vector<std::uint32_t> cells_before(const HexLattice& now, const HexLattice& before,
                                        const std::function<std::uint32_t(std::uint32_t)>& origin);

}  // namespace sectio
