// Cutting templates of "Virtual Cutting of Anatomical Structures" (paper A, section 2.3) as data: the subdivision of an
// active face, and the substructure that hangs under it, if any. Pure functions.
//
// The course of a cut of this style, which template_cut.h makes:
//
//   1. Between two poses the blade sweeps a quadrilateral of a plane. Active faces are the triangles that it crosses.
//      Each is crossed along one segment, so it has two active edges, or one, or none (sweep_path.h).
//   2. Three criteria alone choose a face's template from the table below: the class of the angle between
//      instrument and face normal, the number of active edges, the instrument vertices (tips of the sweep) inside the
//      body where the face's segment ends.
//   3. The face is subdivided as its figure says; the points of the path become pairs, open_top apart, square to the
//      path in the face. Ends of the path stay single.
//   4. The sweep covers a polygon inside the body, with the surface path above and the trail of the tip below. The
//      polygon becomes two side walls, divided at the verticals under the path, and bottom faces along the trail,
//      open_bottom wide.
//      A face with a substructure of its own puts a pair of bottom vertices under the points that it shares with
//      others of its kind; a face without one (90 degrees and beyond) leaves its points to the neighbour's wall. So the
//      neighbour is adjusted (figure 11), and beyond 90 degrees the walls end on vertices of the underside, old or new
//      (figure 13), with no case of its own.
//
// Both walls and the bottom come from the same polygon and close exactly the hole that the pairs open: closed by
// construction, whatever templates meet. A cut that does not fit is refused whole.
#pragma once

#include <cstdint>
#include <span>

#include "common/math/types.h"

namespace sectio {

enum class AngleClass : std::uint8_t {
  normal,       // the instrument stands on the face
  right_angle,  // it lies along it: a front face
  beyond,       // it comes from within: the underside
};
constexpr double kRightAngleTolerance_rad = 0.0873;  // 5 degrees on either side of 90
// The class of the angle between the instrument (from its tip upwards) and the face's outward normal, both of any
// length.
AngleClass angle_class(const Vec3& up_body, const Vec3& face_normal_body,
                       double tolerance_rad = kRightAngleTolerance_rad);

// The subdivision of the active face.
enum class Subdivision : std::uint8_t {
  slit,    // 1 -> 7 with 4 new vertices: both ends of the path and a pair in the middle
  end,     // 1 -> 4 with 3 new vertices: a pair on the active edge, one at the tip
  midway,  // 1 -> 3 with 4 new vertices: a pair on either active edge
};

// The structure that hangs under the face.
enum class Substructure : std::uint8_t {
  none,     // the walls of its neighbour, or of the faces above, close the hole
  cone,     // a vertex for each instrument vertex inside: 4 triangles with one, 6 with two
  taper,    // narrows to the tip in the face: side, side and bottom of one triangle each
  wedge,    // narrows to the vertical under the tip: sides of two triangles, bottom of one
  u_shape,  // two sides and a bottom of two triangles each
};

struct CutTemplate {
  AngleClass angle = AngleClass::normal;
  int active_edges = 0;
  int least_inside = 0, most_inside = 0;  // instrument vertices
  const char* figure = "";
  Subdivision subdivision = Subdivision::slit;
  Substructure substructure = Substructure::none;
  int faces = 0, new_vertices = 0;              // made by the subdivision
  int substructure_triangles = 0, bottoms = 0;  // bottoms are among the triangles
};

std::span<const CutTemplate> cut_templates();

// active_edges and vertices_inside in 0 ... 2: exactly one template fits.
const CutTemplate& template_for(AngleClass angle, int active_edges, int vertices_inside);

}  // namespace sectio
