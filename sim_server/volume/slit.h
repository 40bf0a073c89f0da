// The cuts of a volume, whichever blades have made them, in its shape at rest: what the blades have swept, and the
// vertices of the walls. A blade that is in a slit has nothing to cut; one that leaves it goes on from its vertices.
#pragma once

#include <span>
#include <vector>

#include "sim_server/volume/blade_at_rest.h"

namespace sectio {

class Slit {
 public:
  // The tissue is open from one place of a blade's edge to the next.
  void open(const BladeEdge& from, const BladeEdge& to) { strips_.push_back({from, to}); }
  void add_vertices(std::span<const VertexId> vertices);
  template <class Pred>
  void forget_vertices(const Pred& is_gone) {
    std::erase_if(vertices_, is_gone);
  }

  bool empty() const { return strips_.empty(); }
  const std::vector<VertexId>& vertices() const { return vertices_; }  // ascending
  // Is the place between the outlines of a strip, and this close to it?
  bool contains(const Vec3& at_m, double beside_m) const;
  // The parts of an edge that are in a slit, and in tissue that is uncut. `is_tissue`: whether there is any at a place.
  struct Parts {
    double open_m = 0, uncut_m = 0;
  };
  template <class IsTissue>
  Parts parts(const BladeEdge& edge, double beside_m, const IsTissue& is_tissue) const {
    constexpr int kPlaces = 16;
    const double piece_m = (edge.heel_m - edge.tip_m).norm() / kPlaces;
    Parts parts;
    for (int k = 0; k < kPlaces; ++k) {
      const Vec3 at = edge.tip_m + (k + 0.5) / kPlaces * (edge.heel_m - edge.tip_m);
      if (is_tissue(at)) (contains(at, beside_m) ? parts.open_m : parts.uncut_m) += piece_m;
    }
    return parts;
  }

 private:
  struct Strip {
    BladeEdge from, to;
  };
  std::vector<Strip> strips_;
  std::vector<VertexId> vertices_;
};

}  // namespace sectio
