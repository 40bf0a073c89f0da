// A loop cut into the organ of operation.h, so that a piece comes off.
#pragma once

#include "tests/support/operation.h"

namespace sectio::test {

constexpr double kLoopRadius_m = 0.012, kLoopDepth_m = 0.005;

Scene loop_scene(FreeParts free_parts);

// On the loop, the blade's sharp side ahead.
Pose loop_pose(double deg, double depth_m);

void cut_on(Operation& op, double from_deg, double to_deg);
// In from above, then along the loop. 375 degrees from anywhere close it.
void cut_arc(Operation& op, double from_deg, double to_deg);
void lift(Operation& op);

}  // namespace sectio::test
