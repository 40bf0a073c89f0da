// The geometry of a body's incisions, at rest and in the world, as it follows from the mesh and the record of rungs.
//
// Both lips of a groove have the same places at rest. A lid is the quad between a piece of one lip and the same piece
// of the other, in the world: however far a groove gapes, skin and lids together are closed, with the topology of the
// organ uncut. A blade's line enters that surface in one place, which has coordinates at rest wherever the blade is.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim_server/surface/cutting/grooves.h"

namespace sectio {

// A piece of a lip: a directed edge with skin to its left and a wall to its right.
struct Lip {
  VertexId from = kNone, to = kNone;
};

// The lid between two pieces of lips that are one piece at rest; from and to of the one are to and from of the other.
// At the end of a cut two of the four corners are one vertex.
struct Lid {
  Lip lip, opposite;
};

// The vertices of lips that have the place at rest of this one, itself included; ascending. Two along a cut, one at its
// end, three or four where cuts meet.
std::vector<VertexId> twins_of(const MeshDraft& draft, const Grooves& grooves, VertexId lip);

// The lip that leads away from a vertex, and the one that leads to it.
std::optional<Lip> lip_from(const MeshDraft& draft, VertexId v);
std::optional<Lip> lip_to(const MeshDraft& draft, VertexId v);

std::optional<Lid> lid_of(const MeshDraft& draft, const Grooves& grooves, const Lip& lip);

// The polygons that close the surface where cuts meet; counter-clockwise seen from outside.
std::vector<std::vector<VertexId>> joints_of(const MeshDraft& draft, const Grooves& grooves, VertexId lip);

constexpr double kHeading_m = 2e-3;  // the last part of a cut, which says where it heads
// The unit direction in which a cut goes on at its end, at rest.
Vec3 heading_at(const MeshDraft& draft, VertexId end);

// The nearest place of the curves to a point at rest.
struct PlaceOnCurve {
  Lip lip;
  double along = 0;  // from lip.from to lip.to
  Vec3 rest_body_m = Vec3::Zero();
  double distance_m = 0;
};
std::optional<PlaceOnCurve> nearest_on_curves(const MeshDraft& draft, const Grooves& grooves, const Vec3& rest_body_m,
                                              double within_m);
// Likewise of the rims of holes, which pieces have left, at a place that is wanted.
std::optional<PlaceOnCurve> nearest_on_rims(const MeshDraft& draft, const Grooves& grooves, const Vec3& rest_body_m,
                                            double within_m, const std::function<bool(const Vec3&)>& wanted);

// Divides both lips and the bottom at one place at rest. The new vertex on `lip`; kNone where the groove is not plain.
//
//      from ---N--- to          the walls of both sides get the edge N - G
//        |     |     |
//       g1 --- G --- g2
VertexId insert_rung(MeshDraft& draft, Grooves& grooves, const Lip& lip, double along);

// Checks that skin and lids together are closed, oriented, and as connected as the uncut organ, whose
// `euler_characteristic` is given, and that each lip has a bottom beneath it. Returns the first flaw; empty: none. The
// mesh must have been cut by the progressive style alone; where islands have come free, only rungs are checked. O(all).
std::string flaw_of(const TriangleMesh& mesh, ParticleView particles, const Grooves& grooves, int euler_characteristic);

}  // namespace sectio
