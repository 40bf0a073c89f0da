// The contact of an instrument's round parts with a surface: capsules against samples that are fixed in the material,
// finer than the mesh. The triangles near a capsule carry a barycentric lattice of samples about half a radius apart. A
// sample presses when the capsule has reached it and its face looks at the capsule's axis. A face that the axis has
// pierced, because the instrument or the tissue moved far in a step, is pushed ahead of the tip; other faces are behind
// the instrument and don't push. Since samples keep their places in the material, an instrument that
// rests or slides has no foot that wanders over the mesh.
#pragma once

#include <span>
#include <vector>

#include "sim_server/collision/collision_engine.h"

namespace sectio {

struct Capsule {
  Vec3 from_world_m = Vec3::Zero(),
       to_world_m = Vec3::Zero();   // the ends of its axis, the tip first; of a ball the same
  Vec3 back_world = Vec3::UnitZ();  // unit, from the tip to the handle
  double radius_m = 0;
};
struct MovingCapsule {
  Capsule before, after;
};

struct SurfaceSample {
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Zero();
  double area_rest_m2 = 0;
  Vec3 point_world_m = Vec3::Zero();
  Vec3 target_world_m = Vec3::Zero();  // the nearest point of the capsule
  Vec3 normal_world = Vec3::UnitZ();   // unit, from the sample to the axis: out of the tissue
  double depth_m = 0;                  // inside the capsule; below 0: outside

  template <class A>
  void archive(A& a) {
    a(triangle, bary, area_rest_m2, point_world_m, target_world_m, normal_world, depth_m);
  }
};

// The samples within kBeforeCapsule_m of the capsules after their motion, by triangle. A motion longer than a part of
// the radius pushes samples ahead of it. The tree must be that of the view, and up to date. Cost: triangles near by.
constexpr double kBeforeCapsule_m = 0.0005;  // surface this close to a capsule may run into it in a step
std::vector<SurfaceSample> samples_at(const SurfaceView& view, const CollisionEngine& tree,
                                      std::span<const MovingCapsule> capsules);

}  // namespace sectio
