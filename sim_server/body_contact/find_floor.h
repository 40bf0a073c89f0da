// Contacts of the points of one body with a plane z = floor.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/positions_view.h"
#include "sim_server/body_contact/body_contact.h"

namespace sectio {

// Appends contacts of points below the plane, or above it by at most `reach_m`, as a contact manifold of few points:
// the deepest one, and those that meet the plane first when the body tilts a little, by three angles in eight
// directions. No other point can reach the plane before these: on an uneven face the body rocks on the points that
// support it, and comes to rest. O(points).
void find_floor_contacts(PositionsView points_world_m, double floor_z_m, double reach_m, std::uint32_t body,
                         std::vector<BodyContact>& contacts);

}  // namespace sectio
