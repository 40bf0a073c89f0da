// How far an instrument's tip can be seen inside tissue: what publishing at once on contact keeps small (paper A, 2.1).
#pragma once

#include "render_client/replica/frame.h"

namespace sectio {

// Distance in metres from the tip A beneath skin, of the deepest tool over all bodies; 0 where it is outside, or where
// the nearest surface is the wall of a cut, in which an instrument belongs. O(triangles) for a tip inside the bounding
// box of a body, O(vertices) otherwise.
double visible_tip_depth_m(const Frame& frame);

}  // namespace sectio
