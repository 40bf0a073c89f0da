// The sharp edges of a surface. Its faces are the parts into which it falls when it is taken apart along edges at which
// its normal turns by more than kSharp_deg; a crease lies between two faces, and in a corner three or more meet. Faces
// smaller than a square of the lattice's cells count for nothing: no tetrahedra of that size can follow them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "sim_server/meshing/near_triangles.h"

namespace sectio {

// Faces of the surface on which a vertex lies, ascending: one inside a face, two on a crease, more in a corner; none
// when its face counts for nothing, or when it isn't on the surface.
using Seat = std::vector<std::uint32_t>;

Seat common_faces(const Seat& a, const Seat& b);

class SurfaceCreases {
 public:
  static constexpr double kSharp_deg = 40;

  // `surface` must outlive the creases.
  SurfaceCreases(const TriangleSoup& surface, double cell_m);

  bool empty() const { return creases_.empty(); }
  // The seat of a point on the surface.
  Seat seat_of(const Vec3& p) const;
  // The place of a vertex that was moved to p and must stay on its seat.
  Vec3 closest(const Vec3& p, const Seat& seat) const;

  struct Place {
    Vec3 point;
    Seat seat;
  };
  // The place closest to the segment from p to q on the creases between a face of a and a face of b.
  std::optional<Place> between(const Vec3& p, const Seat& a, const Vec3& q, const Seat& b) const;
  // The corner closest to p at which all these faces meet.
  std::optional<Place> corner_of(const Vec3& p, const Seat& faces) const;

 private:
  using Segment = std::array<VertexId, 2>;

  void find_faces(double least_area_m2);
  void find_creases();
  Place placed(const Segment& s, double share, const Seat& faces) const;

  const TriangleSoup& surface_;
  double cell_m_;
  NearTriangles near_;
  std::vector<std::uint32_t> face_;               // by triangle; kNone: counts for nothing
  std::map<Seat, std::vector<Segment>> creases_;  // by the two faces
  std::map<VertexId, Seat> corners_;              // by vertex of the surface
};

}  // namespace sectio
