// The place of a blade in the material: where its line enters the skin, or a lid over a groove (incisions.h).
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "sim_server/surface/cutting/incisions.h"

namespace sectio {

inline constexpr double kCosRim = 0.7;  // between the normals of faces that meet in a rim

// The line of an instrument that cuts, at one pose: from the tip upwards along the sharp edge (paper B, figure 3: A to
// C; a cautery hook: D to C).
struct Blade {
  Vec3 tip_world_m = Vec3::Zero();
  Vec3 up_world = Vec3::UnitZ();  // unit
  double max_depth_m = 1e9;       // largest depth of the groove that the tissue's thickness allows
  Vec3 up_body = Vec3::Zero();    // up_world in the frame of the tissue at rest; zero: as the triangle has turned
  double length_m = 1e9;          // length of the sharp edge

  template <class A>
  void archive(A& a) {
    a(tip_world_m, up_world, max_depth_m, up_body, length_m);
  }
};

// The part of a blade's line that is asked for the surface: a little longer than the blade at both ends, so that a tip
// that has just dented the skin is on it.
struct BladeLine {
  Vec3 heel_world_m, tip_world_m;
};
BladeLine line_of(const Blade& blade);

struct BladePlace {
  enum class On : std::uint8_t { skin, lid };
  On on = On::skin;
  TriangleId triangle = kNone;  // on skin
  Vec3 bary = Vec3::Zero();
  Lid lid;                          // on a lid
  Vec3 rest_body_m = Vec3::Zero();  // on a lid: on the curve
  Vec3 point_world_m = Vec3::Zero();
};

// The place in the material of a point of the skin: at rest, by the skin around it. Its triangle may be another. On a
// wall: as its triangle has it.
BladePlace place_on_skin(const MeshDraft& draft, TriangleId triangle, const Vec3& bary);

// The place where the line of a blade first enters the skin, of the triangles given.
std::optional<BladePlace> place_on_skin(const MeshDraft& draft, std::span<const TriangleId> triangles,
                                        const Blade& blade);

// The place where the line first enters a lid. Nothing: the blade is in no groove.
std::optional<BladePlace> place_on_lid(const MeshDraft& draft, const Grooves& grooves, const Blade& blade);

}  // namespace sectio
