// The place of a blade in a volume's shape at rest: a blade that goes through moving tissue cuts the same material,
// however that stretches, sags or springs.
#pragma once

#include <vector>

#include "sim_server/surface/cutting/blade_place.h"
#include "sim_server/volume/front_settings.h"
#include "sim_server/volume/volume.h"

namespace sectio {

// The sharp edge of a blade, in the shape at rest.
struct BladeEdge {
  Vec3 tip_m = Vec3::Zero(), heel_m = Vec3::Zero();
};

// A volume in one step, and how blades cut it.
struct Tissue {
  const Volume& volume;
  const SharedBody& body;
  const FrontSettings& settings;

  double metres(double edges) const { return edges * volume.mean_edge_m; }
  TetVertexState state_of(VertexId v) const { return volume.state_of(body, v); }
};

inline Vec3 heel_world_m(const Blade& blade) {
  return blade.tip_world_m + blade.length_m * blade.up_world;
}

// The tissue around a blade: its vertices, and how they have moved.
class TissueAround {
 public:
  // `begin`: vertices near the blade, from which the search goes on; `otherwise_world`: the frame where there are too
  // few.
  TissueAround(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world, std::vector<VertexId> begin);

  const std::vector<VertexId>& vertices() const { return vertices_; }  // `begin` when none is near
  const Pose& frame_world() const { return frame_world_; }             // the rest shape's, in the mean
  // Each place along the edge is carried to rest by a smooth field of the displacement of the tissue there, so that a
  // slit that gapes is closed in its middle; the straight edge closest to these is returned.
  BladeEdge at_rest(const Blade& blade) const;
  // Is there tissue at this place at rest? Asked of the tetrahedra around the blade.
  bool has_tissue(const Vec3& rest_m) const;

 private:
  struct Moved {
    Vec3 at_m, home_m;  // in the frame: now, and from there to rest
  };
  struct Displacement {
    Vec3 home_m = Vec3::Zero();
    double weight = 0;  // the tissue's there
  };
  Displacement displacement(const Vec3& at_m) const;

  const TetTopology& topology_;
  double reach_m_;
  std::vector<VertexId> vertices_;
  std::vector<Moved> moved_;
  Pose frame_world_;
};

}  // namespace sectio
