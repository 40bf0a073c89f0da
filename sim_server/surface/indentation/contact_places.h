// The places at which an instrument touches a surface (paper A, section 2.2): the face under a point of the instrument,
// and the edges that a line from there to a corner of the instrument crosses. Pure functions on a draft without
// temporary elements.
//
// Places are looked up on the surface at rest, in the body's frame, so that they depend on the instrument alone. On the
// deformed surface they would be drawn to the dent, which an instrument that slides would drag along.
#pragma once

#include <vector>

#include "sim_server/surface/cutting/stroke.h"
#include "sim_server/surface/indentation/contact_templates.h"

namespace sectio {

// Walks downhill over neighbours, from a living triangle, to the point of the deformed surface that is nearest to a
// given point.
SurfacePoint nearest_from(const MeshDraft& surface, TriangleId start, const Vec3& point_world_m);

// The same, for a point that presses the skin there: it goes round an edge of the body only to a face that it is
// outside of, as both were at rest. One that presses beside an edge, deeper than that is far, is still under the same
// skin.
SurfacePoint pressed_from(const MeshDraft& surface, TriangleId start, const Vec3& point_world_m,
                          const Vec3& point_body_m);

// Walks over neighbours to the point of the surface at rest that lies over or under a given point, seen along a normal;
// to the nearest one if the surface folds over.
SurfacePoint seen_along(const MeshDraft& surface, TriangleId start, const Vec3& point_body_m, const Vec3& normal_body);

// The place in the face, or on the edge that the point is close to; both faces at an edge are then active. Near the
// border between the two cases the place stays the kind that it was before.
PathPoint contact_place(const MeshDraft& surface, const SurfacePoint& at, std::span<const ContactPoint> before);

// A line from a point of an instrument to one of its corners.
struct ContactLine {
  TriangleId triangle = kNone;  // above or below the point
  Vec3 from_body_m = Vec3::Zero(), corner_body_m = Vec3::Zero();
  Vec3 normal_body = Vec3::UnitZ();
};
// A place, and the point of the line that is over or under it.
struct PlaceOnLine {
  PathPoint place;
  Vec3 target_body_m = Vec3::Zero();
};
// The places under the line that is beneath the surface: each edge that it crosses, seen along the normal, and the face
// that holds its corner. Places that were touched before stay touched a little longer.
std::vector<PlaceOnLine> contact_places_along(const MeshDraft& surface, const ContactLine& line,
                                              std::span<const ContactPoint> before);

}  // namespace sectio
