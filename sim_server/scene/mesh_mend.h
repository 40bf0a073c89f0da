// Mending of triangles from a file without guessing at shape: what a person would call the same surface.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

// Vertices within this fraction of the bounding box's diagonal are one. Files hold six digits or single precision.
constexpr double kWeldFraction = 1e-6;

// Welds vertices, drops degenerate and duplicate triangles and vertices that no triangle uses, gives the triangles of a
// component one orientation, and turns each component outside out (a component inside another one is a cavity and is
// turned the other way). Returns what was done, one line for each kind; empty when nothing. Positions must be finite.
// A surface that can't be oriented, or is open, comes out as it can; check_soup() says so afterwards.
std::vector<std::string> mend(TriangleSoup& soup);

}  // namespace sectio
