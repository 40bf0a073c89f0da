// Where an instrument touches a surface (paper A, section 2.2): the face under a point of it, and the edges that a line
// of it crosses between there and its end. Pure functions on a draft without temporary elements.
//
// Places are looked up on the surface at rest, in the body's frame: they depend on the instrument alone. On the surface
// as it is now they would be drawn to the dent, which an instrument that slides would drag along.
#pragma once

#include <vector>

#include "sim_server/surface/cutting/stroke.h"
#include "sim_server/surface/indentation/contact_templates.h"

namespace sectio {

// Downhill over neighbours, from a triangle that lives, to the point of the surface as it is now that is nearest to
// another.
SurfacePoint nearest_from(const MeshDraft& surface, TriangleId start, const Vec3& point_world_m);

// Over neighbours to the point of the surface at rest that lies over or under another, seen along a normal; where the
// surface folds over, the nearest.
SurfacePoint seen_along(const MeshDraft& surface, TriangleId start, const Vec3& point_body_m, const Vec3& normal_body);

// In the face, or on the edge that the point is close to: then both faces there are active. Near the border between the
// two it stays what it was before.
PathPoint contact_place(const MeshDraft& surface, const SurfacePoint& at, std::span<const ContactPoint> before);

// A line that leads from a point of an instrument to a corner of it.
struct ContactLine {
  TriangleId triangle = kNone;  // over or under the point
  Vec3 from_body_m = Vec3::Zero(), corner_body_m = Vec3::Zero();
  Vec3 normal_body = Vec3::UnitZ();
};
// A place with what of the line is over or under it.
struct PlaceOnLine {
  PathPoint place;
  Vec3 target_body_m = Vec3::Zero();
};
// What of it is beneath the surface: seen along the normal each edge that it crosses, and the face in which the corner
// is. What was touched before stays touched a little longer.
std::vector<PlaceOnLine> contact_places_along(const MeshDraft& surface, const ContactLine& line,
                                              std::span<const ContactPoint> before);

}  // namespace sectio
