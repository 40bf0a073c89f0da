// The cuts of a volume, whichever blades have made them, in its shape at rest: what the blades have swept, and the
// vertices of the walls. A blade that is in a slit has nothing to cut; one that leaves it goes on from its vertices.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/volume/blade_at_rest.h"

namespace sectio {

class Slit {
 public:
  // The tissue is open from one place of a blade's edge to the next. A blade that goes on makes one strip as long as
  // that is shorter than `strip_m`: where a blade has hardly moved, two places don't say where it went.
  void open(const BladeEdge& from, const BladeEdge& to, double strip_m);
  void add_vertices(std::span<const VertexId> vertices);
  template <class Pred>
  void forget_vertices(const Pred& is_gone) {
    std::erase_if(vertices_, is_gone);
  }

  bool empty() const { return strips_.empty(); }
  const std::vector<VertexId>& vertices() const { return vertices_; }  // ascending
  // Is the place between the outlines of a strip, and this close to it?
  bool contains(const Vec3& at_m, double beside_m) const;
  // The plane of the strip whose outline has this place, the closest one within `beside_m`.
  std::optional<SlitPlane> plane_at(const Vec3& at_m, double beside_m) const;
  // Square to the strip that was opened last; the slit isn't empty.
  Vec3 normal_at_end() const { return strips_.back().normal_m().stableNormalized(); }
  // Normals of the strips towards one side of a cut, which is that of `normal` at its end; zero for a strip that has
  // no side. A slit in tissue that sags on a neck is twisted, by a right angle and more: each strip faces where the
  // next one does, over `smooth_m` of the way. Around a corner it faces to the same side of the way. A strip that no
  // way leads from to the end is of the cut if it lies roughly along it.
  std::vector<Vec3> facing(const Vec3& normal, double smooth_m) const;
  // The plane of such a strip, the closest one within `beside_m`; for a place outside a corner one through the edge in
  // which two strips meet. `facing`: a normal for each strip.
  std::optional<SlitPlane> plane_facing(const Vec3& at_m, double beside_m, std::span<const Vec3> facing) const;
  // The parts of an edge that are in a slit, and in tissue that is uncut. `at`: its place from 0 at the tip to 1 at the
  // heel; `is_tissue`: whether there is any at a place.
  struct Parts {
    double open = 0, uncut = 0;  // shares
  };
  template <class At, class IsTissue>
  Parts parts(const At& at, double beside_m, const IsTissue& is_tissue) const {
    constexpr int kPlaces = 16;
    Parts parts;
    for (int k = 0; k < kPlaces; ++k) {
      const Vec3 place = at((k + 0.5) / kPlaces);
      if (is_tissue(place)) (contains(place, beside_m) ? parts.open : parts.uncut) += 1.0 / kPlaces;
    }
    return parts;
  }

  template <class A>
  void archive(A& a) {
    a(strips_, vertices_);
  }

 private:
  struct Strip {
    BladeEdge from, to;
    bool follows = false, is_followed = false;  // another strip ends where this begins, or begins where this ends

    // Its plane at a place between its two edges, which may be this far beyond their ends.
    std::optional<SlitPlane> plane_at(const Vec3& at_m, double beyond_share) const;
    Vec3 way_m(double share) const { return to.at(share) - from.at(share); }
    // A vector square to its plane in the middle, as long as the strip.
    Vec3 normal_m() const;

    template <class A>
    void archive(A& a) {
      a(from, to, follows, is_followed);
    }
  };
  std::optional<SlitPlane> outside_corner(const Vec3& at_m, double beside_m, std::span<const Vec3> facing) const;
  bool leads_to(std::size_t strip, std::size_t next, double gap_m) const;

  std::vector<Strip> strips_;
  std::vector<VertexId> vertices_;
};

}  // namespace sectio
