// The pieces of a tetrahedron or a triangle in the cells of a cubic grid. Simplices are bisected at the grid's planes
// until each piece lies in one cell; sizes add up to the whole up to rounding. Pure functions, in units of a cell.
#pragma once

#include <array>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// The place of a cell's lower corner, or of a node.
using GridPlace = std::array<int, 3>;

struct Grid {
  Vec3 origin_m = Vec3::Zero();
  double cell_m = 1;

  // The place in cells; a coordinate that is on a plane of the grid up to rounding is put onto it exactly.
  Vec3 at(const Vec3& x_m) const;
  Vec3 point_m(const GridPlace& p) const { return origin_m + cell_m * Vec3(p[0], p[1], p[2]); }
};

struct GridPiece {
  GridPlace cell{};
  double size = 0;  // volume or area
  Vec3 centroid = Vec3::Zero();
  Vec3 square = Vec3::Zero();  // mean squares of the coordinates from the cell's lower corner
};

// A part of a triangle that lies in one cell.
struct GridTriangle {
  GridPlace cell{};
  std::array<Vec3, 3> corners;
};

// One entry a cell, ascending. A triangle in a plane of the grid belongs to the cells above it.
void pieces_of(const std::array<Vec3, 4>& tetrahedron, std::vector<GridPiece>& pieces);
void pieces_of(const std::array<Vec3, 3>& triangle, std::vector<GridPiece>& pieces);
// The same, divided into triangles.
void triangles_of(const std::array<Vec3, 3>& triangle, std::vector<GridTriangle>& triangles);

}  // namespace sectio
