// An edge of an instrument meets a body from outside: pure queries of its surface.
#pragma once

#include <optional>
#include <span>

#include "sim_server/world/body.h"
#include "sim_server/world/instrument_edge.h"
#include "sim_server/world/press_point.h"

namespace sectio {

constexpr double kToolReach_m = 0.02;  // a body whose box is further from an instrument than this is not looked at

bool is_near(Body& body, const InstrumentEdge& edge, const std::optional<JointPose>& before,
             std::span<const JointPose> poses);
// No part of the instrument is in the body, nor across its surface.
bool is_clear_of(Body& body, const InstrumentEdge& edge);
// For blades that open.
bool lower_blade_is_clear_of(Body& body, const InstrumentEdge& edge);

// The point at which an edge that need not press reaches into the tissue.
std::optional<SurfaceHit> reaches_in(Body& body, const InstrumentEdge& edge, const ToolContact& contact);

// The part of the instrument that has come to press the surface.
struct Pressing {
  PressPoint::OnTool on_tool;
  SurfaceHit hit;
};
std::optional<Pressing> tip_presses(const InstrumentKind& kind, const ToolContact& contact);
std::optional<Pressing> side_presses(const InstrumentKind& kind, const ToolContact& contact);

// The place at which the line of a blade first enters the skin, from its heel down to a point.
std::optional<SurfaceHit> skin_entered(Body& body, const BladeLine& line, const Vec3& down_to_world_m);
// The place at which a blade has come between the lips of a cut. So has one that presses a wall of it, `wall`, came in
// between the lips, and reaches up with its edge through the skin beyond the end of the cut.
std::optional<Entry> enters_open_cut(Body& body, const InstrumentEdge& edge, std::optional<TriangleId> wall);

}  // namespace sectio
