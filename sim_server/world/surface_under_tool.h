// The surface that an instrument touches or comes near to, for the contact model of its hand.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "sim_server/haptics/contact_model_fitter.h"
#include "sim_server/instruments/instrument.h"
#include "sim_server/world/body.h"

namespace sectio {

struct SurfaceUnderTool {
  std::uint32_t body_id = kNoBody;
  TriangleId triangle = kNone;
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the tissue
  double gap_m = 0;                   // between the instrument and the point
};

// The nearest point of all bodies to the corners of an instrument, whose tip may be a ball. The plane through it across
// the shortest way leaves the body behind it where that is convex. Nothing when no surface is within reach_m, or when
// the corner that is nearest lies inside a body.
std::optional<SurfaceUnderTool> nearest_surface(std::span<const std::unique_ptr<Body>> bodies, const ToolSpec& tool,
                                                const JointPose& pose, double reach_m);

// The surface at rest, without the dents of instruments, at the triangle that is nearest to a point of the surface.
struct RestSurface {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();
};
std::optional<RestSurface> rest_surface(Body& body, const Vec3& near_world_m);
// How far the corners of an instrument are outside of a plane; negative when one is beneath it.
double gap_m(const ToolSpec& tool, const JointPose& pose, const Vec3& point_world_m, const Vec3& normal_world);

// The motion of a point of the surface without the dent of an instrument there: the rigid motion of the surface around,
// which the dent hardly reaches. O(1): a bounded number of vertices is looked at.
struct SurfaceMotion {
  Vec3 from_undeformed_m = Vec3::Zero();
  Vec3 velocity_m_per_s = Vec3::Zero();
};
SurfaceMotion motion_beyond_dent(const Body& body, const Vec3& point_world_m);
// The velocity where nothing dents the surface. O(1).
Vec3 velocity_at(const Body& body, TriangleId triangle, const Vec3& point_world_m);

// The surface around a dent moves with it; that motion is not the tissue's own and is subtracted: with v the velocity
// of the surface around, t that of the tool, and g fitted to both, the tissue's own is v - g (t - v), g >= 0. A hand
// that goes along with breathing tissue teaches nothing.
class OwnDent {
 public:
  void learn(const Vec3& around_m_per_s, const Vec3& tool_m_per_s, double step_s);
  double share() const;  // g

  template <class A>
  void archive(A& a) {
    a(along_m2_per_s2_, square_m2_per_s2_);
  }

 private:
  double along_m2_per_s2_ = 0, square_m2_per_s2_ = 0;  // sums that fade
};

// The tissue of a body at a place, for an instrument in this state.
FeltTissue felt_tissue(Body& body, const Vec3& near_world_m, const ToolSpec& tool, ContactState state);

}  // namespace sectio
