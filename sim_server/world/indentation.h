// The temporary elements under instruments that press on a body (paper A, section 2.2), over the simulation's steps.
// They come with the first touch, follow the instrument, stay when it lets go until the surface is at rest again, and
// are undone before anything cuts or parts the body: nothing permanent ever meets them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/world/body.h"

namespace sectio {

// The surface without temporary elements, as it is now: what instruments are said to touch.
MeshDraft original_surface(const Body& body);
// The triangle of it that one of the body has come from, or one beside that.
TriangleId original_triangle(const Body& body, TriangleId t);

// The change that brings the temporary elements to what instruments touch now: of each in order, the most important
// first. Fills `held`, for this step only. The body's TemporaryContact already is as after the change. Nothing when
// nothing changes.
std::optional<Change> plan_indentation(Body& body, std::span<const ContactPoint> points, double step_s,
                                       std::vector<HeldParticle>& held);
// The change that undoes all of them; nothing if there are none.
std::optional<Change> plan_release(Body& body);

}  // namespace sectio
