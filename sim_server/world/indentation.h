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

// Brings the temporary elements to what instruments touch now: of each in order, the most important first. Fills
// `held`, for this step only. Returns the change of topology to publish, if there is one.
std::optional<TopologyDelta> press_body(Body& body, std::span<const ContactPoint> points, double step_s,
                                        std::vector<HeldParticle>& held);
// Undoes all of them; nothing if there are none.
std::optional<TopologyDelta> release_body(Body& body);

}  // namespace sectio
