// Organ-like shapes as implicit surfaces: f < 0 inside, f = 0 on the skin, f near the distance in metres around it.
// Body frame: origin in the middle, +z up, the side that faces the surgeon. Only square roots, no libm: the same
// numbers on every machine.
#pragma once

#include <functional>
#include <string>

#include "common/math/types.h"

namespace sectio {

using ImplicitShape = std::function<double(const Vec3&)>;

double liver(const Vec3& p_m);     // 0.22 x 0.16 x 0.08 m: right and left lobe, hollow underneath, notched at the front
double kidney(const Vec3& p_m);    // 0.11 x 0.06 x 0.045 m: a bean with its hilum at +y
double skin_pad(const Vec3& p_m);  // 0.12 x 0.12 x 0.02 m: flat, with a rounded rim

Vec3 gradient(const ImplicitShape& f, const Vec3& p_m);

// The nearest point of the surface, for points near it.
Vec3 projected(const ImplicitShape& f, Vec3 p_m);

// The first point of the surface met from outside_m towards inside_m, which must be inside.
Vec3 first_hit(const ImplicitShape& f, const Vec3& outside_m, const Vec3& inside_m);

}  // namespace sectio
