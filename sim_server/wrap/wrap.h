// A watertight body around triangles that are no closed surface: open, doubled, crossing themselves, in many parts.
#pragma once

#include <string>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct Wrapped {
  TriangleSoup soup;     // closed, oriented, manifold, triangles about equilateral
  double size_m = 0;     // length of its edges, about
  double volume_m3 = 0;  // volume inside `soup`
  // From the soup to the triangles that were given: across holes it is as far as these are wide. Or from corners of
  // these that are outside the soup to it, if that is further.
  double furthest_m = 0;
  double mean_far_m = 0;  // from the soup, the mean
  double least_angle_rad = 0;
  std::size_t bubbles = 0;  // closed surfaces inside, or of less than a hundredth of the whole, that were left out
};

// The surface where the winding number of the given triangles is 1/2 (Jacobson 2013), found on a grid by tetrahedra
// (Doi and Koide 1991), made of even triangles, and inflated or deflated to the volume that it had. Hollows are filled.
// Triangles that hang together are turned to one side; closed ones outward, open ones so that they bulge outward.
// size_m: about the length of an edge, below which nothing is kept; 0: for about 8000 triangles.
// fill_sizes > 0: the body is whatever a ball of so many edges' radius does not reach from far away without touching a
// triangle (Portaneri 2022): walls thinner than an edge become the outside of a solid body, and narrow holes close.
// Throws InputError with the reason. Deterministic.
Wrapped wrap(const TriangleSoup& given, double size_m = 0, double fill_sizes = 0);

std::string to_string(const Wrapped& wrapped);  // one line

// The soup with the triangles that hang together turned to one side, as wrap() does.
TriangleSoup turned_outward(TriangleSoup soup);

}  // namespace sectio
