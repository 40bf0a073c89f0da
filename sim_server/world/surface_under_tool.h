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

// The velocity of a point of the surface without the dent of an instrument there: of a rigid piece its own, else the
// rigid motion of the surface around, which the dent hardly reaches. O(1): a bounded number of vertices is looked at.
Vec3 velocity_beyond_dent(const Body& body, const Vec3& point_world_m);
// The same where nothing dents the surface. O(1).
Vec3 velocity_at(const Body& body, TriangleId triangle, const Vec3& point_world_m);

// The tissue of a body, for an instrument in this state, at a triangle; kNone: anywhere.
FeltTissue felt_tissue(const Body& body, TriangleId triangle, const InstrumentKind& instrument, ContactState state);

}  // namespace sectio
