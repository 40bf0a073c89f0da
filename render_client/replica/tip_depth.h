// How far an instrument's tip can be seen inside tissue. A server keeps this depth small by publishing at once on
// contact (paper A, 2.1).
#pragma once

#include "render_client/replica/frame.h"

namespace sectio {

// The distance in metres of the deepest tip A beneath skin, over all tools and bodies. A tip outside counts as 0, and
// so does a tip whose nearest surface is the wall of a cut, where instruments belong. O(triangles) for a tip inside the
// bounding box of a body, O(vertices) otherwise.
double visible_tip_depth_m(const Frame& frame);

}  // namespace sectio
