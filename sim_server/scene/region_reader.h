// The key `regions:` of a body in a scene file.
#pragma once

#include "common/material/regions.h"

namespace sectio {

class YamlValue;

// A list; each with name*, shapes*, colour, grain_colour, rim: {width_m*, colour*}, ripple_m, stiffness_factor, marked.
// A shape is one of, in the frame of the mesh:
//   ellipsoid: {centre_body_m*, radii_m*, rotation_deg}      sphere: {centre_body_m*, radius_m*}
//   box: {min_body_m*, max_body_m*}                          tube: {points_body_m*, radii_m*}, two points or more
Regions read_regions(const YamlValue& list);

}  // namespace sectio
