// The temporary elements under instruments that press on a body (paper A, section 2.2), over the steps of a simulation.
// They come with the first touch, follow the instrument, stay after it has let go until the surface is at rest again,
// and are undone before anything cuts or parts the body, so that no permanent element meets them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/world/body.h"

namespace sectio {

// The present surface without temporary elements, which contacts of instruments refer to.
MeshDraft original_surface(const Body& body);
// The triangle of that surface from which a triangle of the body was made, or one beside it.
TriangleId original_triangle(const Body& body, TriangleId t);

// Call once a step, before plan_indentation(): counts for how long the particles of contacts that instruments have let
// go have been still.
void watch_particles_let_go(Body& body, std::span<const ContactPoint> points, double step_s);
// The change that brings the temporary elements to the instruments' present contacts, ordered by instrument, the most
// important first. Fills `held`, for this step only. Nothing when nothing changes.
std::optional<Change> plan_indentation(const Body& body, std::span<const ContactPoint> points,
                                       std::vector<HeldParticle>& held);
// The change that undoes all temporary elements; nothing if there are none.
std::optional<Change> plan_release(const Body& body);

}  // namespace sectio
